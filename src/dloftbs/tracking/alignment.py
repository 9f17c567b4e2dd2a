"""Place along a track of a detection that is shorter."""

from __future__ import annotations

import math

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.observation import Seen
from dloftbs.tracking.kernels import alignment as kernels
from dloftbs.tracking.partial_match import WHOLE
from dloftbs.tracking.track_model import Memory

_LEAVING, _AS_BEFORE = 0.3, 0.7  # how much less a misfit counts, where the other end is at the border, or was hidden
_CLEARLY = 0.7  # of the misfit at an end: where a part fits elsewhere so much better, both ends are hidden
_SHIFT = 0.3  # of a shift as a whole: a motion that was not expected must not hide where a part lies
_SHAPE_S, _BY_MOTION = 0.5, 0.2  # how long a shape tells where a part lies, and what its motion adds to that
_MOST = 0.5  # of a detection
_CUT = 0.5  # of the misfit as a whole: where the rest fits so much better as it was, an end was cut off
_BORDER_PX = 3.0


def place_on(
    memory: Memory, expected: FloatArray, shown: Seen, start: float, size: tuple[int, int] | None
) -> tuple[float, float]:
    """Return where a detection lies on a track that is longer: at one of its ends, unless it clearly does not.

    Parameters
    ----------
    memory : Memory
    expected : numpy.ndarray, shape (SAMPLES, 2)
        Predicted place of the track.
    shown : Seen
        Run in the track's direction.
    start : float
        Place where it fits best.
    size : (int, int) or None
        ``(H, W)`` of the image.
    """
    share = shown.length / memory.length
    first, last, free = (_misfit_at(memory, expected, shown, low) for low in (0.0, 1.0 - share, start))
    leaves = leaving(shown, size, memory.width)
    were = [any(low <= 0.0 for low, _ in memory.hidden), any(high >= 1.0 for _, high in memory.hidden)]
    for signs, weight in ((leaves, _LEAVING), (were, _AS_BEFORE)):
        if signs[0] != signs[1]:
            first, last = (first, last * weight) if signs[0] else (first * weight, last)
    anchored = (0.0, share) if first <= last else (1.0 - share, 1.0)
    away = min(start, 1.0 - start - share) * memory.length
    if away > memory.slack_px and free < _CLEARLY * min(first, last):
        return start, start + share
    return anchored


def in_plain_sight(memory: Memory, expected: FloatArray, shown: Seen, size: tuple[int, int] | None) -> Seen | None:
    """Return all of a detection that shows one track alone, in the track's direction; None if that is but a part of it.

    It is the whole object, however long, tilted or bent, unless the image's border cuts it, or an end was cut off or
    added since the last frame: then what is seen stays where it was expected.
    """
    if shown.curve.closed or memory.curve.closed:
        return None
    seen = shown.between(0.0, 1.0)
    length = float(np.hypot(*np.diff(expected, axis=0).T).sum())
    if abs(seen.length - length) < memory.slack_px:
        if shown.length > _MOST * seen.length:
            return seen
        return min(  # all of it tells the direction better than a small part does
            (seen, seen.reversed()), key=lambda one: kernels.misfit_at(one.points, expected, 1.0, 0.0, _SHIFT)
        )
    if not seen.clear or memory.hidden or any(leaving(seen, size, memory.width)):
        return None
    share = seen.length / length
    short, long = (seen.points, expected) if share <= 1.0 else (expected, seen.points)
    share = min(share, 1.0 / share)
    whole = kernels.misfit_at(seen.points, expected, 1.0, 0.0, 1.0)
    cut = min(kernels.misfit_at(short, long, share, low, 1.0) for low in (0.0, 1.0 - share))
    return seen if cut > _CUT * whole else None


def _misfit_at(memory: Memory, expected: FloatArray, shown: Seen, low: float) -> float:
    """Return how badly a detection fits there: by motion and, while that is recent, by the shape last seen."""
    share = shown.length / memory.length
    by_motion = kernels.misfit_at(shown.points, expected, share, low, _SHIFT)
    if memory.shape_s > _SHAPE_S:
        return by_motion
    return kernels.misfit_at(shown.points, memory.shape, share, low, 0.0) + _BY_MOTION * by_motion


def anchored(start: float, share: float, memory: Memory) -> tuple[float, float]:
    """Return where a part lies that starts about there: at an end of the track, where it comes near to one."""
    if share >= 1.0 - memory.tolerance_px / memory.length:
        return WHOLE
    before, after = start, 1.0 - start - share
    if min(before, after) * memory.length < memory.slack_px:
        return (0.0, share) if before <= after else (1.0 - share, 1.0)
    return start, start + share


def leaving(shown: Seen, size: tuple[int, int] | None, width: float) -> list[bool]:
    """Tell which end of a detection is where the border of the image may cut it."""
    return [size is not None and at_border(end, size, width) for end in shown.points[[0, -1]]]


def at_border(point: FloatArray, size: tuple[int, int], width: float) -> bool:
    """Tell whether a point lies within about a width of the border of the image, ``(H, W)`` px."""
    reach = _BORDER_PX + (0.0 if math.isnan(width) else 1.5 * width)
    x, y = float(point[0]), float(point[1])
    return min(x, y, size[1] - 1.0 - x, size[0] - 1.0 - y) < reach
