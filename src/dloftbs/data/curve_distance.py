"""The least distance between two curves, and between a curve and the pixels of a mask.

Curves are cut into pieces of equal length. Those that are too far away to hold the nearest place are left out, and the
others are halved, until pieces are short. What then lies nearest is looked at closely.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from dloftbs.data.curve_like import CurveLike
from dloftbs.support.arrays import AnyArray, BoolArray, FloatArray

_PIECES = 256
"""Number of pieces of a curve at first.

Source: bounds time; with fewer, more rounds of halving follow.
"""

_MAX_PIECES = 1 << 14
"""Number of pieces of a curve from which on they are not halved, where another curve is looked for.

Source: bounds time; two curves of one length that run side by side have an eighth of these.
"""

_SHORT = 1e-3
"""Length of two pieces that are not halved, as a share of the length of the shorter curve.

Source: numerics; a distance is wrong by so much at most, and next to nothing where `_REFINED` holds the nearest place.
"""

_SHORTEST = 1e-9
"""The same, as a share of the length of the longer curve, where the other one is a point.

Source: numerics; some thousand times the rounding of a length.
"""

_SHORT_PX = 1e-6
"""Length of a piece that is not halved to find a pixel, px.

Source: by definition; pixels whose distances differ by less are equally near.
"""

_MAX_PIECES_PER_PX = 8
"""Number of pieces, for each px of the curve, from which on they are not halved to find a pixel.

Source: bounds time; so many remain where a row of pixels runs beside the curve, and these are equally near.
"""

_REFINED = 8
"""Number of the nearest places or pixels that are looked at closely.

Source: numerics; the nearest one of the pieces is nearly always the nearest one.
"""


class _Pieces(NamedTuple):
    """Pieces of a curve of equal length.

    Parameters
    ----------
    curve : CurveLike
    u : numpy.ndarray, shape (n,)
        Their middles, ascending.
    width : float
        Share of the length of the curve that each of them has.
    """

    curve: CurveLike
    u: FloatArray
    width: float

    @classmethod
    def of(cls, curve: CurveLike) -> _Pieces:
        """Cut a curve."""
        return cls(curve, (np.arange(_PIECES) + 0.5) / _PIECES, 1.0 / _PIECES)

    @property
    def reach(self) -> float:
        """Distance from the middle of a piece within which all of it lies: half would do if lengths were exact."""
        return self.width * self.curve.length

    def halved(self) -> _Pieces:
        """Return the halves of the pieces."""
        off = 0.25 * self.width
        return _Pieces(self.curve, np.stack((self.u - off, self.u + off), axis=1).ravel(), 0.5 * self.width)

    def part(self, kept: BoolArray) -> _Pieces:
        """Return some of the pieces."""
        return self._replace(u=self.u[kept])

    def around(self, i: int) -> tuple[float, float, float]:
        """Return the parameter of the middle of a piece, and those of the middles beside it, within the curve."""
        beside = self.u[i] + self.width * np.array([0.0, -1.0, 1.0])
        t, low, high = self.curve.t_at(beside if self.curve.closed else np.clip(beside, 0.0, 1.0)).tolist()
        return t, low, high


def nearest_places(a: CurveLike, b: CurveLike) -> tuple[float, float, float]:
    """Return the places ``u`` on two curves that are nearest to each other, and their distance."""
    one, other = _Pieces.of(a), _Pieces.of(b)
    lengths = a.length, b.length
    short = max(_SHORT * min(lengths), _SHORTEST * max(lengths))
    while one.reach + other.reach > short and max(len(one.u), len(other.u)) < _MAX_PIECES:
        if one.reach > other.reach:
            one = one.halved()
        else:
            other = other.halved()
        near, near_other = _nearest_ones(a(one.u), b(other.u), one.reach + other.reach)
        one, other = one.part(near), other.part(near_other)
    distances, nearest = cKDTree(b(other.u)).query(a(one.u))
    before, after = np.append(np.inf, distances[:-1]), np.append(distances[1:], np.inf)
    (lowest,) = np.nonzero((distances <= before) & (distances <= after))
    best = (np.inf, 0.0, 0.0)
    for i in lowest[np.argsort(distances[lowest], kind="stable")][:_REFINED]:
        best = min(best, _refined(a, b, *one.around(int(i)), *other.around(int(nearest[i]))))
    distance, at_a, at_b = best
    u_a, u_b = (float(one.u_at(at)) for one, at in ((a, at_a), (b, at_b)))
    return u_a % 1.0 if a.closed else u_a, u_b % 1.0 if b.closed else u_b, distance


def nearest_pixel(curve: CurveLike, mask: AnyArray) -> tuple[float, tuple[float, float], float] | None:
    """Return the place of a curve that is nearest to a set pixel, that pixel's ``(x, y)``, and the distance."""
    rows, columns = np.nonzero(mask)
    if not len(rows):
        return None
    pixels = np.column_stack((columns, rows)).astype(np.float64)
    pieces = _Pieces.of(curve)
    while True:
        near, near_pieces = _nearest_ones(pixels, curve(pieces.u), pieces.reach)
        pixels, pieces = pixels[near], pieces.part(near_pieces)
        if len(pixels) <= _REFINED or pieces.reach <= _SHORT_PX or len(pieces.u) > _MAX_PIECES_PER_PX * curve.length:
            break
        pieces = pieces.halved()
    distances, _ = cKDTree(curve(pieces.u)).query(pixels)
    first = pixels[np.argsort(distances, kind="stable")[:_REFINED]]
    distance, u, number = min((*curve.nearest(pixel)[::-1], number) for number, pixel in enumerate(first))
    x, y = first[number].tolist()
    return u, (x, y), distance


def _nearest_ones(points: FloatArray, others: FloatArray, reach: float) -> tuple[BoolArray, BoolArray]:
    """Return which of two sets of points may have a nearest place at most `reach` nearer than they are themselves."""
    distances, _ = cKDTree(others).query(points)
    limit = float(distances.min()) + reach
    near: BoolArray = distances <= limit
    back, _ = cKDTree(points[near]).query(others)
    return near, back <= limit


def _refined(
    a: CurveLike, b: CurveLike, t: float, low: float, high: float, s: float, low_s: float, high_s: float
) -> tuple[float, float, float]:
    """Return the least distance within two intervals of the splines' parameters, and the two parameters."""
    start, widths = np.array([low, low_s]), np.array([high - low, high_s - low_s])
    unit = float(np.linalg.norm(a.spline(low) - a.spline(high)) + np.linalg.norm(b.spline(low_s) - b.spline(high_s)))

    def squared(y: FloatArray) -> tuple[float, FloatArray]:
        at = start + widths * y
        apart = (a.spline(at[0]) - b.spline(at[1])) / unit
        slopes = np.array([apart @ a.spline(at[0], nu=1), -apart @ b.spline(at[1], nu=1)]) / unit
        return float(apart @ apart), 2.0 * widths * slopes

    first = (np.array([t, s]) - start) / widths
    found = first
    if unit > 0.0:
        options = {"ftol": 0.0, "gtol": 1e-14}
        found = minimize(squared, first, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * 2, options=options).x
    ends = [start + widths * y for y in (first, found)]
    return min((float(np.linalg.norm(a.spline(at[0]) - b.spline(at[1]))), *at.tolist()) for at in ends)
