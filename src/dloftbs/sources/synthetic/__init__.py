"""Generated sequences: cables on a workbench, rendered with the truth beside them."""

from __future__ import annotations

from dloftbs.sources.synthetic.cables import TangleSequence, several_cables
from dloftbs.sources.synthetic.degrade import NETWORK, NOISY, OCCLUDED, Degradation, DegradedSequence
from dloftbs.sources.synthetic.demo import DemoSequence
from dloftbs.sources.synthetic.depth_noise import DepthNoise, depth_sigma
from dloftbs.sources.synthetic.free_ends import END_STYLES, FreeEnd, draw_cable_mask
from dloftbs.sources.synthetic.kinds import KINDS, KindSequence, kinds
from dloftbs.sources.synthetic.ladder import LADDER_BASES, LadderBase, Rung, noise_ladder
from dloftbs.sources.synthetic.plain_sight import PLAIN_SIGHT_KINDS, PlainSightSequence, plain_sight
from dloftbs.sources.synthetic.rgb import RGB_SCENARIOS, RgbSequence, rgb
from dloftbs.sources.synthetic.rgbd import RgbdSequence
from dloftbs.sources.synthetic.rgbd_suites import TYPICAL_NOISE, rgbd_artificial, rgbd_manipulation, rgbd_noisy
from dloftbs.sources.synthetic.strand import random_curve
from dloftbs.sources.synthetic.tracking import TRACKING_FAMILIES, TrackingSequence, tracking
from dloftbs.sources.synthetic.tube import draw_tube_mask

__all__ = [
    "END_STYLES",
    "KINDS",
    "LADDER_BASES",
    "NETWORK",
    "NOISY",
    "OCCLUDED",
    "PLAIN_SIGHT_KINDS",
    "RGB_SCENARIOS",
    "TRACKING_FAMILIES",
    "TYPICAL_NOISE",
    "Degradation",
    "DegradedSequence",
    "DemoSequence",
    "DepthNoise",
    "FreeEnd",
    "KindSequence",
    "LadderBase",
    "PlainSightSequence",
    "RgbSequence",
    "RgbdSequence",
    "Rung",
    "TangleSequence",
    "TrackingSequence",
    "depth_sigma",
    "draw_cable_mask",
    "draw_tube_mask",
    "kinds",
    "noise_ladder",
    "plain_sight",
    "random_curve",
    "rgb",
    "rgbd_artificial",
    "rgbd_manipulation",
    "rgbd_noisy",
    "several_cables",
    "tracking",
]
