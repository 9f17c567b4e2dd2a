"""Selection of occluders that leave enough in sight: the hidden part must follow from the rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.support.arrays import BoolArray, FloatArray

_STEP_PX = 2.0
_MAX_TURNING = math.pi


def leaves_enough(curves: Sequence[BSplineCurve], centres: FloatArray, radii: FloatArray, least_px: float) -> bool:
    """Return whether discs leave both ends of all curves to be seen, and hide no more than a half turn at a stretch.

    A whole loop behind a disc looks like a straight cable behind a disc.

    Parameters
    ----------
    curves : sequence of BSplineCurve
        Open, px.
    centres : numpy.ndarray, shape (n, 2)
        Of the discs, px.
    radii : numpy.ndarray, shape (n,)
        Of the discs, px.
    least_px : float
        Shorter pieces, px, count as hidden: a speck between two discs says nothing.
    """
    return all(_follows(curve, centres, radii, least_px) for curve in curves)


def _follows(curve: BSplineCurve, centres: FloatArray, radii: FloatArray, least_px: float) -> bool:
    points = curve.spline(np.linspace(0.0, 1.0, max(3, math.ceil(curve.length / _STEP_PX))))
    steps = np.diff(points, axis=0)
    spacing = float(np.linalg.norm(steps, axis=1).mean())
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    turning = np.concatenate(([0.0, 0.0], np.cumsum(np.abs(np.diff(heading))), [0.0]))
    turning[-1] = turning[-2]
    hidden = _without_specks(_inside(points, centres, radii), math.ceil(least_px / spacing))
    if hidden[0] or hidden[-1]:
        return False
    return all(turning[stop] - turning[start] <= _MAX_TURNING for start, stop, dark in _runs(hidden) if dark)


def _inside(points: FloatArray, centres: FloatArray, radii: FloatArray) -> BoolArray:
    distance = np.linalg.norm(points[:, None] - centres[None], axis=2)
    return (distance <= radii).any(axis=1)


def _without_specks(hidden: BoolArray, least: int) -> BoolArray:
    """Return `hidden` (n,) with runs of less than `least` visible samples hidden, too."""
    result = hidden.copy()
    for start, stop, dark in _runs(hidden):
        result[start : stop + 1] |= dark or stop + 1 - start < least
    return result


def _runs(flags: BoolArray) -> list[tuple[int, int, bool]]:
    """Return the first and last index of each run of equal flags, and the flag."""
    runs = []
    for flag, group in groupby(enumerate(flags.tolist()), key=lambda item: item[1]):
        indices = [index for index, _ in group]
        runs.append((indices[0], indices[-1], flag))
    return runs
