"""From curves in space to the passes of a diagram."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.data.curve import BSplineCurve
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray, as_points
from dloftbs.support.values import check_flag, shown

_CHORDS = 400
"""Number of chords that stand for a spline in space.

Source: geometry; a curve of ten full turns strays by 3e-3 of a turn's radius from these.
"""


_PARALLEL = 1e-12
"""Sine of the angle between two sides below which they count as parallel, and do not cross.

Source: numerics; sides on one line differ by the rounding of float64.
"""


class CrossingPasses(NamedTuple):
    """Crossing of two strands, or of one with itself, as seen with the y axis upwards."""

    at: tuple[tuple[int, float], tuple[int, float]]
    """Strand and place on it, growing along it, of both passes."""
    cross: float
    """Cross product of the directions of the first pass and the second."""
    top: int | None
    confidence: float
    label: int


def assemble_passes(closed: Sequence[bool], crossings: Sequence[CrossingPasses]) -> dict[str, Any]:
    """Return the fields of a diagram, in which a crossing's first pass is that which is met first."""
    ordered = [
        one if one.at[0] <= one.at[1] else _exchanged(one) for one in sorted(crossings, key=lambda one: one.label)
    ]
    met: list[list[tuple[float, int]]] = [[] for _ in closed]
    for number, one in enumerate(ordered):
        for strand, place in one.at:
            met[strand].append((place, number))
    return {
        "passes": tuple([tuple([number for _, number in sorted(strand)]) for strand in met]),
        "closed": tuple(closed),
        "turns": tuple([1 if one.cross > 0.0 else -1 for one in ordered]),
        "tops": tuple([one.top for one in ordered]),
        "confidences": tuple([one.confidence for one in ordered]),
        "labels": tuple([one.label for one in ordered]),
    }


def _exchanged(one: CrossingPasses) -> CrossingPasses:
    top = None if one.top is None else 1 - one.top
    return one._replace(at=(one.at[1], one.at[0]), cross=-one.cross, top=top)


def cross_product(a: FloatArray, b: FloatArray) -> Any:
    """Return the cross product of vectors in the plane, whatever their third coordinate."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def passes_of_curves(
    curves: Sequence[BSplineCurve | npt.ArrayLike], closed: bool | Sequence[bool] | None
) -> dict[str, Any]:
    """Return the fields of a diagram of curves in space, seen from the end of the z axis.

    Raises
    ------
    InputError
        If a curve has another shape, or two meet, or a corner or a side of one lies exactly above the other.
    """
    if isinstance(curves, (str, bytes)) or not isinstance(curves, Sequence):
        raise InputError(f"curves must be a sequence of curves in space, got {shown(curves)}")
    flags = _flags(curves, closed)
    lines = [_polyline(curve, flag) for curve, flag in zip(curves, flags, strict=True)]
    base = np.concatenate([np.zeros((0, 3)), *(line[:-1] for line in lines)])
    step = np.concatenate([np.zeros((0, 3)), *(np.diff(line, axis=0) for line in lines)])
    owner = np.concatenate([np.zeros(0, int), *(np.full(len(line) - 1, k) for k, line in enumerate(lines))])
    place = np.concatenate([np.zeros(0, int), *(np.arange(len(line) - 1) for line in lines)])
    rounding = _PARALLEL * float(np.abs(base[:, :2]).max(initial=0.0))
    found: list[CrossingPasses] = []
    for i in range(len(base) - 1):
        later = np.arange(i + 1, len(base))
        same = owner[later] == owner[i]
        beside = same & (place[later] == place[i] + 1)
        if flags[owner[i]] and place[i] == 0:
            beside |= same & (place[later] == len(lines[owner[i]]) - 2)
        offset, slope = base[later] - base[i], cross_product(step[i], step[later])
        parallel = np.abs(slope) <= _PARALLEL * np.hypot(*step[i, :2]) * np.hypot(*step[later, :2].T)
        overlaid = later[parallel & _are_overlaid(offset, step[i], step[later], rounding)]
        if len(overlaid):
            raise InputError(
                f"a side of curve {owner[i]} lies over one of curve {owner[overlaid[0]]}: turn them a little"
            )
        with np.errstate(divide="ignore", invalid="ignore"):
            s, t = cross_product(offset, step[later]) / slope, cross_product(offset, step[i]) / slope
        cuts = np.flatnonzero(~(parallel | beside) & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1))
        for j, a, b, cross in zip(later[cuts], s[cuts], t[cuts], slope[cuts], strict=True):
            above = float(base[i, 2] + a * step[i, 2] - base[j, 2] - b * step[j, 2])
            if above == 0.0 or not (0 < a < 1 and 0 < b < 1):
                raise InputError(
                    f"curves {owner[i]} and {owner[j]} meet, or a corner of one lies over the other: turn them a little"
                )
            at = (int(owner[i]), float(place[i] + a)), (int(owner[j]), float(place[j] + b))
            found.append(CrossingPasses(at, float(cross), int(above < 0.0), 1.0, len(found)))
    return {**assemble_passes(flags, found), "objects": tuple(range(len(flags)))}


def _are_overlaid(offset: FloatArray, step: FloatArray, steps: FloatArray, rounding: float) -> npt.NDArray[np.bool_]:
    """Return which of some sides (n, 3), parallel to another one (3,), lie along a part of it, as seen.

    Parameters
    ----------
    offset : numpy.ndarray, shape (n, 3)
        Starts of the sides, from the start of the other one.
    step, steps : numpy.ndarray, shapes (3,) and (n, 3)
    rounding : float
        Length that is none.
    """
    length = float(np.hypot(*step[:2]))
    way = step[:2] / (length or 1.0)
    starts, ends = offset[:, :2] @ way, (offset + steps)[:, :2] @ way
    shared = np.minimum(np.maximum(starts, ends), length) - np.maximum(np.minimum(starts, ends), 0.0)
    overlaid: npt.NDArray[np.bool_] = (np.abs(cross_product(way, offset)) <= rounding) & (shared > rounding)
    return overlaid


def _flags(curves: Sequence[Any], closed: bool | Sequence[bool] | None) -> list[bool]:
    if closed is None:
        return [isinstance(curve, BSplineCurve) and curve.closed for curve in curves]
    if isinstance(closed, Sequence) and len(closed) == len(curves):
        return [check_flag("closed", flag) for flag in closed]
    return [check_flag("closed", closed)] * len(curves)


def _polyline(curve: BSplineCurve | npt.ArrayLike, closed: bool) -> FloatArray:
    """Return the corners of a curve (n, 3); of a closed one the first is the last."""
    if isinstance(curve, BSplineCurve):
        points = as_points("a curve", curve.sample(_CHORDS + 1), (3,))
        return np.concatenate([points[:-1], points[:1]]) if closed else points
    points = as_points("a curve", curve, (3,))
    points = points[np.append([True], (np.diff(points, axis=0) != 0.0).any(axis=1))]
    if closed and len(points) > 1 and (points[0] == points[-1]).all():
        points = points[:-1]
    if len(points) < 2 + closed:
        raise InputError(f"a curve needs at least {2 + closed} different points, got {len(points)}")
    return np.concatenate([points, points[:1]]) if closed else points
