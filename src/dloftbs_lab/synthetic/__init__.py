"""Generated sequences: cables on a workbench, rendered with the truth beside them.

All functions that make a suite, such as `kinds`, take the same arguments: `scale`, more than 0, which multiplies the
number of sequences or that of their frames; `seed`, not negative, of which another one gives other scenes; `size`,
``(H, W)`` px. They raise `InputError` where a value is out of range.
"""

from __future__ import annotations

from dloftbs_lab.synthetic.cables import StrewnSequence, TangleSequence, several_cables
from dloftbs_lab.synthetic.degrade import NOISY, OCCLUDED, Degradation, DegradedSequence
from dloftbs_lab.synthetic.demo_sequence import DemoSequence
from dloftbs_lab.synthetic.depth_camera import DEPTH_CAMERAS, DepthCamera
from dloftbs_lab.synthetic.depth_noise import TYPICAL_NOISE, DepthNoise, depth_sigma
from dloftbs_lab.synthetic.edge_cases import EDGE_CASES, EdgeCaseSequence, edge_cases
from dloftbs_lab.synthetic.excerpt import Excerpt
from dloftbs_lab.synthetic.free_ends import END_STYLES, FreeEnd, draw_cable_mask
from dloftbs_lab.synthetic.harnesses import HARNESS_VIEWS, HarnessSequence, harnesses
from dloftbs_lab.synthetic.kinds import KINDS, KindSequence, kinds
from dloftbs_lab.synthetic.ladder import LADDER_BASES, LadderBase, Rung, noise_ladder
from dloftbs_lab.synthetic.network_masks import NETWORK, NetworkFaults
from dloftbs_lab.synthetic.plain_sight import PLAIN_SIGHT_KINDS, PlainSightSequence, plain_sight
from dloftbs_lab.synthetic.real_footage import FOOTAGE_FAMILIES, RealFootageSequence, real_footage
from dloftbs_lab.synthetic.real_motion import REAL_MOTION_VARIANTS, RealMotionSequence, missing_recordings, real_motion
from dloftbs_lab.synthetic.rgb import RGB_SCENARIOS, RgbSequence, rgb
from dloftbs_lab.synthetic.rgbd import RgbdSequence
from dloftbs_lab.synthetic.rgbd_camera import DEPTH_SCENES, DepthCameraSequence, rgbd_camera
from dloftbs_lab.synthetic.rgbd_suites import rgbd_artificial, rgbd_manipulation, rgbd_noisy
from dloftbs_lab.synthetic.simulated import SIMULATED_KINDS, SimulatedSequence, simulated
from dloftbs_lab.synthetic.simulation import REMEDY as SIMULATION_REMEDY
from dloftbs_lab.synthetic.simulation import available as simulation_available
from dloftbs_lab.synthetic.strand import random_curve
from dloftbs_lab.synthetic.tracking_sequences import TRACKING_FAMILIES, TrackingSequence, known_occluders, tracking
from dloftbs_lab.synthetic.tube import draw_tube_mask
from dloftbs_lab.synthetic.two_cameras import TWO_CAMERA_VARIANTS, TwoCameraSequence, TwoViewFrame, two_cameras

__all__ = [
    "DEPTH_CAMERAS",
    "DEPTH_SCENES",
    "EDGE_CASES",
    "END_STYLES",
    "FOOTAGE_FAMILIES",
    "HARNESS_VIEWS",
    "KINDS",
    "LADDER_BASES",
    "NETWORK",
    "NOISY",
    "OCCLUDED",
    "PLAIN_SIGHT_KINDS",
    "REAL_MOTION_VARIANTS",
    "RGB_SCENARIOS",
    "SIMULATED_KINDS",
    "SIMULATION_REMEDY",
    "TRACKING_FAMILIES",
    "TWO_CAMERA_VARIANTS",
    "TYPICAL_NOISE",
    "Degradation",
    "DegradedSequence",
    "DemoSequence",
    "DepthCamera",
    "DepthCameraSequence",
    "DepthNoise",
    "EdgeCaseSequence",
    "Excerpt",
    "FreeEnd",
    "HarnessSequence",
    "KindSequence",
    "LadderBase",
    "NetworkFaults",
    "PlainSightSequence",
    "RealFootageSequence",
    "RealMotionSequence",
    "RgbSequence",
    "RgbdSequence",
    "Rung",
    "SimulatedSequence",
    "StrewnSequence",
    "TangleSequence",
    "TrackingSequence",
    "TwoCameraSequence",
    "TwoViewFrame",
    "depth_sigma",
    "draw_cable_mask",
    "draw_tube_mask",
    "edge_cases",
    "harnesses",
    "kinds",
    "known_occluders",
    "missing_recordings",
    "noise_ladder",
    "plain_sight",
    "random_curve",
    "real_footage",
    "real_motion",
    "rgb",
    "rgbd_artificial",
    "rgbd_camera",
    "rgbd_manipulation",
    "rgbd_noisy",
    "several_cables",
    "simulated",
    "simulation_available",
    "tracking",
    "two_cameras",
]
