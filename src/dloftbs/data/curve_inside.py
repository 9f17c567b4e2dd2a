"""The parts of a curve that lie inside of a polygon."""

from __future__ import annotations

import math

import numpy as np
from scipy.interpolate import PPoly

from dloftbs.data.curve_like import CurveLike
from dloftbs.data.spans import Spans
from dloftbs.support.arrays import BoolArray, FloatArray


def spans_inside(curve: CurveLike, corners: FloatArray) -> Spans:
    """Return the intervals of ``u``, ascending, over which a curve in the plane lies inside of a polygon (n, 2)."""
    breaks = curve.breaks
    powers = range(curve.degree, -1, -1)
    pieces = np.stack([curve.spline(breaks[:-1], nu=n) / math.factorial(n) for n in powers])
    sides = np.roll(corners, -1, axis=0) - corners
    normals = np.stack((-sides[:, 1], sides[:, 0]), axis=1)
    heights = pieces @ normals.T  # above the line of each side
    heights[-1] -= (normals * corners).sum(axis=1)
    # Where a piece lies on a line, all of it is a root, which is said by NaN.
    roots = [PPoly(heights[..., i], breaks).roots(discontinuity=False, extrapolate=False) for i in range(len(corners))]
    found = np.concatenate([[0.0, 1.0], *roots])
    edges = np.unique(found[(found >= 0.0) & (found <= 1.0)])
    inside = _holds(corners, curve.spline(0.5 * (edges[:-1] + edges[1:])))
    changes = np.flatnonzero(np.diff(inside, prepend=False, append=False))
    u = curve.u_at(edges[changes]).reshape(-1, 2)
    return tuple((low, high) for low, high in u.tolist() if high > low)


def _holds(corners: FloatArray, points: FloatArray) -> BoolArray:
    """Return which points (n, 2) lie inside of a polygon: a ray from them crosses an odd number of its sides."""
    (x0, y0), (x1, y1) = corners.T, np.roll(corners, -1, axis=0).T
    x, y = points[:, :1], points[:, 1:]
    spans = (y0 > y) != (y1 > y)
    rise = np.where(y1 == y0, 1.0, y1 - y0)
    right = x < x0 + (y - y0) / rise * (x1 - x0)
    inside: BoolArray = (spans & right).sum(axis=1) % 2 == 1
    return inside
