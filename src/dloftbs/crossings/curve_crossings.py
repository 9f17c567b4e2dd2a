"""Stage 7: where objects cross each other and themselves, and which lies on top (not in the paper).

The curves are intersected, not the centre lines: those run through the very same pixels where cables lie side by side,
and so the positions lie on the published curves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.config import DepthConfig
from dloftbs.crossings.kernels import crossing_order as order
from dloftbs.crossings.kernels.crossing_groups import select_crossings
from dloftbs.crossings.kernels.intersections import flatten, intersect, measure_arcs
from dloftbs.depth import to_metres
from dloftbs.detection import Crossing, Detection
from dloftbs.frame import Frame

MIN_CONFIDENCE = 0.2
"""Share by which one explanation must be better than the other, or the upper pass counts as unknown.

Source: by hand.
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

_NEAR_WIDTHS = 1.5
"""Distance of two intersections of the same two passes, mean widths, up to which they are one crossing.

Source: by hand; two cables that meet at 40 degrees overlap over as much.
"""

_REACH_WIDTHS = 0.5
"""Distance from another object, widths of it, within which a curve stays with that object.

Source: geometry; half a width from the axis is the border.
"""

_TURN_WIDTHS = 2.0 * math.pi * _REACH_WIDTHS
"""Length of a curve, widths, within which two of its chords are no crossing.

Source: geometry; the round of a circle with the least radius that a cable can have, half its width.
"""


class _Lines(NamedTuple):
    """The curves flattened, as the kernels take them."""

    points: FloatArray
    arc: FloatArray
    first: npt.NDArray[np.int64]
    closed: npt.NDArray[np.bool_]
    widths: FloatArray


def find_crossings(detections: Sequence[Detection], frame: Frame, config: DepthConfig) -> tuple[Crossing, ...]:
    """Find where detections cross each other and themselves, across gaps too, and which pass lies on top there.

    Passes that share a stretch, or come together several times within one and a half widths, cross once or not at all:
    once if they leave on other sides than they came. A pass that ends within half a width of the other does not cross.

    Which is on top comes from depth, where it tells, and otherwise from the image, where there is one: the top one is
    that whose surface at the crossing is as its two sides make one expect, and the confidence is the share by which
    that holds better for it than for the other.

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
    widths = np.array([detection.width for detection in detections])
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
    pairs, places, parameters, at = select_crossings(
        points, u, arc, first, closed, widths, chords, shares, _TURN_WIDTHS, _NEAR_WIDTHS, _REACH_WIDTHS
    )
    if not len(pairs):
        return ()
    verdicts = _on_top(lines, pairs, at, frame, config)
    found = []
    for place, (a, b), (u_a, u_b), verdict in zip(
        places.tolist(), pairs.tolist(), parameters.tolist(), verdicts.tolist(), strict=True
    ):
        known = abs(verdict) >= MIN_CONFIDENCE
        top, confidence = (int(verdict < 0.0), abs(verdict)) if known else (None, 0.0)
        found.append(Crossing._unchecked((place[0], place[1]), ((a, u_a), (b, u_b)), top, confidence))
    return tuple(sorted(found, key=lambda crossing: crossing.passes))


def _on_top(
    lines: _Lines, pairs: npt.NDArray[np.int64], at: FloatArray, frame: Frame, config: DepthConfig
) -> FloatArray:
    """Return for each crossing how surely its first pass is on top, below 0 its second; 0 is unknown."""
    verdicts = np.zeros(len(pairs))
    if frame.depth is None and frame.image is None:
        return verdicts
    pixels = order.find_pixels(order.choose_places(*lines, pairs, at), *frame.size)
    if frame.depth is not None:
        exact = np.issubdtype(frame.depth.dtype, np.floating)
        rows, columns = pixels
        metres = to_metres(frame.depth[rows, columns], config)
        metres[rows < 0] = np.nan
        seen = lines.widths[pairs].min(axis=1) ** 2
        verdicts = order.judge_depth(metres, seen, 0.0 if exact else config.integer_unit_m)
    if frame.image is not None:
        unknown = np.abs(verdicts) < MIN_CONFIDENCE
        if unknown.any():
            rows, columns = (axis[unknown] for axis in pixels)
            verdicts[unknown] = order.judge_image(_values(frame.image, rows, columns))
    return verdicts


def _values(array: npt.NDArray[Any], rows: npt.NDArray[np.int64], columns: npt.NDArray[np.int64]) -> FloatArray:
    """Return what an array (H, W, ...) holds at pixels (k, n), as float64; NaN at those of index -1."""
    values = array[rows, columns].astype(np.float64)
    values[rows < 0] = np.nan
    return values
