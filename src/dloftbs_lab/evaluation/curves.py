"""Errors of a found curve against the true one: at equal arc lengths, at the ends, in length.

Every function takes a `BSplineCurve` or points in order, ``(x, y)`` px or ``(x, y, z)`` m; results have the same unit.
Points are taken at equal distances along both curves; ``samples`` must be dense enough for the tightest bend: between
neighbours ``h`` apart, a bend of radius ``r`` is known to ``h**2 / (8 r)``, and L3, which lets a point lie anywhere on
the segment between two, comes out too small by up to ``h``. A curve against itself scores 0 at any density.

Closed curves have no ends. Where one takes part, `curve_l3` and `point_error` are the least over its starting points
(the true curve's, if both are closed). Points given as an array are always open.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.evaluation.metrics import distances_to_sides, mean_distance_to_sides
from dloftbs_lab.evaluation.traces import SAMPLES, CurveLike, Trace, align, traces_of


@dataclass(frozen=True)
class PointError:
    """Distances between the points of two curves at equal normalised arc length.

    Parameters
    ----------
    mean, max : float
        Over the points of one alignment, in their unit.
    forward : bool
        Whether the found curve was taken in its own direction.
    """

    mean: float
    max: float
    forward: bool


def curve_l3(found: CurveLike, true: CurveLike, *, directed: bool = True, samples: int = SAMPLES) -> float:
    """Distance of a curve from the true one (paper: evaluation, ``L3``), least over the starting point of a closed one.

    `l3` of `samples` points at equal distances along each. There the arc lengths of both are the same, and the segment
    that brackets a point is the one that begins there (for the last, the one that ends there), whatever the rounding.

    Parameters
    ----------
    found, true : BSplineCurve or array_like, shape (n, d)
    directed : bool
        Whether the direction counts; else the better one of both.
    samples : int
        Points along each curve, at equal distances.

    Returns
    -------
    float
        In the unit of the points.

    Raises
    ------
    InputError
        If a curve has less than two points, its shape is wrong, a value is not finite, the dimensions differ, or
        `samples` is less than 2.
    """
    return align(*traces_of(found, true, samples), samples, even_l3, directed=directed).error


def point_error(found: CurveLike, true: CurveLike, *, directed: bool = True, samples: int = SAMPLES) -> PointError:
    """Distances between the points of two curves at equal normalised arc length.

    ``d(s) = |found(s) - true(s)|`` at ``samples`` evenly spaced ``s`` from 0 to 1, both included. Unlike L3, a point
    that slid along the curve counts. Direction and the starting point of a closed curve are those of the least mean.

    Parameters
    ----------
    found, true, directed, samples
        As `curve_l3` has them.

    Raises
    ------
    InputError
        As `curve_l3`.
    """
    best = align(*traces_of(found, true, samples), samples, _mean_distance, directed=directed)
    return PointError(best.error, float(_distances(best.found, best.true).max()), best.forward)


def endpoint_error(found: CurveLike, true: CurveLike, *, directed: bool = True) -> float:
    """Mean distance of the two ends of a curve from the true ones.

    ``(|found(0) - true(0)| + |found(1) - true(1)|) / 2``.

    Parameters
    ----------
    found, true : BSplineCurve or array_like, shape (n, d)
        If `found` alone is closed, its seam counts as both of its ends.
    directed : bool
        Whether the first end must be the true curve's first; else the better one of both pairings.

    Returns
    -------
    float
        In the unit of the points; NaN if `true` is closed and so has no ends.

    Raises
    ------
    InputError
        As `curve_l3`.
    """
    traces = traces_of(found, true, SAMPLES)
    if traces[1].closed:
        return math.nan
    ends, true_ends = (trace.points[[0, -1]] for trace in traces)
    forward = _mean_distance(ends, true_ends)
    return forward if directed else min(forward, _mean_distance(ends[::-1], true_ends))


def length_error(found: CurveLike, true: CurveLike) -> float:
    """Relative error of a curve's length: ``|length - true length| / true length``.

    Parameters
    ----------
    found, true : BSplineCurve or array_like, shape (n, d)

    Returns
    -------
    float
        Without unit: 0.1 is ten per cent.

    Raises
    ------
    InputError
        As `curve_l3`, or if the true curve has no length.
    """
    length, true_length = map(length_of, (found, true), traces_of(found, true, SAMPLES))
    if true_length == 0.0:
        raise InputError("true must have a length, got points that are all the same")
    return abs(length - true_length) / true_length


def length_of(curve: CurveLike, trace: Trace) -> float:
    """Return the length of a curve, or that of the polyline which is its trace."""
    return curve.length if isinstance(curve, BSplineCurve) else _polyline_length(trace.points)


def even_l3(x: FloatArray, y: FloatArray) -> float:
    """`l3` of points (n, d), ``x[i]`` and ``y[i]`` being at the same normalised arc length; nothing is checked."""
    k = np.minimum(np.arange(len(x)), len(x) - 2)
    return (mean_distance_to_sides(x, y, k) + mean_distance_to_sides(y, x, k)) / 2.0


def even_distances(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return what `even_l3` is the mean of, at each arc length, shape (n,)."""
    k = np.minimum(np.arange(len(x)), len(x) - 2)
    return (distances_to_sides(x, y, k) + distances_to_sides(y, x, k)) / 2.0


def _distances(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.linalg.norm(x - y, axis=1)


def _mean_distance(x: FloatArray, y: FloatArray) -> float:
    return float(_distances(x, y).mean())


def _polyline_length(points: FloatArray) -> float:
    return float(_distances(points[1:], points[:-1]).sum())
