"""Crossings of objects with each other and with themselves, and which lies on top (not in the paper).

The curves are intersected, not the centre lines: those run through the very same pixels where cables lie side by side,
and so the positions lie on the published curves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from dloftbs.config import DepthConfig
from dloftbs.data.depth import unit_of
from dloftbs.data.detection import Crossing, Detection
from dloftbs.data.frame import Frame
from dloftbs.fitting.crossings.kernels import crossing_order as order
from dloftbs.fitting.crossings.kernels.crossing_groups import select_crossings
from dloftbs.fitting.crossings.kernels.intersections import flatten, intersect, measure_arcs
from dloftbs.support.arrays import BoolArray, FloatArray, IntArray
from dloftbs.support.values import unchecked

MIN_CONFIDENCE = 0.6
"""Probability, a share of 1, below which the upper pass counts as unknown.

Source: by hand; nearer to even, an answer is a guess.
"""

_DEPTH_ODDS = 0.8
"""Log-odds, nats, for each deviation of the noise by which depth agrees better with one pass than with the other.

Source: fitted to 850 crossings of `rgbd_camera`, of all its errors, by logistic regression; the errors of the
predictions are not only noise.
"""

_MAX_DEPTH_ODDS = 1.6
"""Largest log-odds that depth is worth, nats.

Source: measured on the same; with all errors at once 83 of 100 are right however clear depth is.
"""

_IMAGE_ODDS = 15.0
"""Log-odds, nats, for each unit by which the image agrees better with one pass than with the other.

Source: as `_DEPTH_ODDS`, on 980 pictures of cables of the same and of other colours, sharp, blurred, in shadow, noisy.
"""

_MAX_IMAGE_ODDS = 4.0
"""Largest log-odds that the image is worth, nats.

Source: by hand; 0.98, as 24 of 24 in photographs and all of the clear ones of the same pictures do not contradict.
"""

_CROWDED_ODDS = 0.5
"""Largest log-odds that the image is worth beside a third stretch of the same objects, nats.

Source: by hand; 0.62: of 18 such orders in 40 drawings of tight ropes, 7 are right, whatever their odds.
"""

_CROWDED_WIDTHS = 2.5
"""Distance, mean widths, within which a third stretch is near to a crossing.

Source: measured on the same drawings; from there on orders are right as often as elsewhere.
"""

_CHORD_WIDTHS = 0.75
"""Length of the chords that stand for a curve, widths.

Source: geometry; at a radius of two widths these chords stray from the curve by 4 % of the width.
"""

_MIN_CHORD_PX = 1.5
"""Smallest length of such a chord, px.

Source: by hand; about the distance of two pixels.
"""

_MAX_CHORDS = 20_000
"""Largest number of chords of a curve.

Source: bounds time and memory.
"""


class _Lines(NamedTuple):
    """The curves flattened, as the kernels take them."""

    points: FloatArray
    arc: FloatArray
    first: IntArray
    closed: BoolArray
    widths: FloatArray


def find_crossings(detections: Sequence[Detection], frame: Frame, config: DepthConfig) -> tuple[Crossing, ...]:
    """Find where detections cross each other and themselves, across gaps too, and which pass lies on top there.

    Passes that share a stretch, or come together several times within one and a half widths, cross once or not at all:
    once if they leave on other sides than they came. A pass that ends within half a width of the other does not cross.

    Which is on top comes from depth and from the image, as far as there are any: the top one is that whose surface at
    the crossing is as its two sides make one expect. The log-odds of both are added, and the confidence is the
    probability that follows.

    Parameters
    ----------
    detections : sequence of Detection
    frame : Frame
        That they were found in.
    config : DepthConfig
        Range of valid depth.

    Returns
    -------
    tuple of Crossing
        By their passes.
    """
    if not detections:
        return ()
    widths = np.array([detection.width_px for detection in detections])
    curves = [detection.curve for detection in detections]
    points, u, first = flatten(
        np.concatenate([curve.knots for curve in curves]),
        np.concatenate([curve.control_points for curve in curves]),
        np.array([len(curve.control_points) for curve in curves]),
        np.maximum(_CHORD_WIDTHS * widths, _MIN_CHORD_PX),
        _MAX_CHORDS,
    )
    chords, shares = intersect(points, first)
    if not len(chords):
        return ()
    arc, closed = measure_arcs(points, first), np.array([curve.closed for curve in curves])
    lines = _Lines(points, arc, first, closed, widths)
    pairs, places, parameters, at = select_crossings(points, u, arc, first, closed, widths, chords, shares)
    if not len(pairs):
        return ()
    verdicts = _on_top(lines, pairs, at, places, frame, config)
    found = []
    for place, (a, b), (u_a, u_b), verdict in zip(
        places.tolist(), pairs.tolist(), parameters.tolist(), verdicts.tolist(), strict=True
    ):
        probability = 1.0 / (1.0 + math.exp(-abs(verdict)))
        known = probability >= MIN_CONFIDENCE
        top, confidence = (int(verdict < 0.0), probability) if known else (None, 0.0)
        passes, both = ((a, u_a), (b, u_b)), (curves[a], curves[b])
        made = unchecked(
            Crossing, position=(place[0], place[1]), _fitted=(passes, both), top=top, confidence=confidence
        )
        found.append((passes, made))
    return tuple([crossing for _, crossing in sorted(found, key=itemgetter(0))])


def _on_top(
    lines: _Lines, pairs: IntArray, at: FloatArray, centres: FloatArray, frame: Frame, config: DepthConfig
) -> FloatArray:
    """Return for each crossing the log-odds, nats, that its first pass is on top; 0 is unknown."""
    odds = np.zeros(len(pairs))
    if frame.depth is None and frame.image is None:
        return odds
    rows, columns = order.find_pixels(order.choose_places(*lines, pairs, at), *frame.size)
    if frame.depth is not None:
        stored = frame.depth[rows, columns].astype(np.float64)
        stored[rows < 0] = np.nan
        exact = np.issubdtype(frame.depth.dtype, np.floating)
        unit, seen = unit_of(frame.depth, frame.depth_unit_m), lines.widths[pairs].min(axis=1) ** 2
        agreement = order.judge_depth(stored, unit, *config.range_m, seen, 0.0 if exact else unit)
        odds += np.minimum(np.maximum(_DEPTH_ODDS * agreement, -_MAX_DEPTH_ODDS), _MAX_DEPTH_ODDS)
    if frame.image is not None:
        agreement = order.judge_image(frame.image, rows, columns)
        most = np.where(_is_crowded(lines, pairs, at, centres), _CROWDED_ODDS, _MAX_IMAGE_ODDS)
        odds += np.minimum(np.maximum(_IMAGE_ODDS * agreement, -most), most)
    return odds


def _is_crowded(lines: _Lines, pairs: IntArray, at: FloatArray, centres: FloatArray) -> BoolArray:
    """Return whether a third stretch of the same two objects comes near to each crossing: its sides may show that."""
    reach = _CROWDED_WIDTHS * lines.widths[pairs].mean(axis=1)
    sizes = np.diff(lines.first)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    lengths = np.where(lines.closed, lines.arc[lines.first[1:] - 1], np.inf)[owner]
    near = np.hypot(*(lines.points[:, :, None] - centres.T).transpose(1, 0, 2)) < reach
    near &= (owner[:, None] == pairs[:, 0]) | (owner[:, None] == pairs[:, 1])  # others may look otherwise
    for p in range(2):
        along = np.abs(lines.arc[:, None] - at[:, p])
        along = np.minimum(along, lengths[:, None] - along)
        # A pass may turn back in a half circle, and is still the same stretch.
        near &= (owner[:, None] != pairs[:, p]) | (along > 0.5 * math.pi * reach)
    crowded: BoolArray = near.any(axis=0)
    return crowded
