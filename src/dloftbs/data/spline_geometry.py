"""The geometry of a spline by its own parameter: the length along it, directions, bends, the place nearest a point."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline

from dloftbs.support.arrays import FloatArray

_NODES = 7
"""Number of Gauss-Legendre nodes of a piece.

Source: numerics; of a cable, nearly every knot span is then a piece by itself.
"""

_MAX_SPREAD = 0.001
"""Largest square of the spread of a piece's speeds over its fastest one, as a share of the length of the curve.

Source: measured; lengths and shares of them are then right to 2e-5, on 1000 splines with control points at random.
"""

_ROUNDING = 1e-12
"""Length that is nothing but rounding, as a share of the largest coordinate of a control point.

Source: numerics; some thousand times the rounding of one number.
"""

_MAX_HALVINGS = 40
"""Largest number of times that a knot span is halved.

Source: numerics; at a cusp, the length of the piece that holds it falls below the tolerance long before.
"""

_MAX_STEPS = 6
"""Largest number of steps of Newton's method.

Source: numerics; it takes two or three, and more only at a cusp.
"""

_ENOUGH = 1e-4
"""Step within a piece after which its parameter is known, widths of the piece.

Source: numerics; the next step would be some 1e-9.
"""

_TINY = float(np.finfo(np.float64).tiny)
"""Least divisor.

Source: numerics.
"""


def _make_tables() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the nodes in 0..1, their weights, and from speeds there to power coefficients of the length."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    at = 0.5 + 0.5 * nodes
    return at, 0.5 * weights, np.linalg.inv(np.vander(at, increasing=True)) / np.arange(1.0, _NODES + 1.0)[:, None]


_AT, _WEIGHTS, _POWERS = _make_tables()


class ArcLength(NamedTuple):
    """The length along a spline, piece by piece: within each, its speed is a polynomial.

    Parameters
    ----------
    starts, widths : numpy.ndarray, shape (m,)
        Of the pieces, in the spline's own parameter.
    speeds : numpy.ndarray, shape (7, m)
        At the nodes of each piece, times its width.
    lengths : numpy.ndarray, shape (m + 1,)
        From the first start to each, and to the end.
    """

    starts: FloatArray
    widths: FloatArray
    speeds: FloatArray
    lengths: FloatArray

    @property
    def total(self) -> float:
        """The whole length."""
        return float(self.lengths[-1])

    def _powers_of(self, piece: npt.NDArray[np.intp]) -> FloatArray:
        """Return the coefficients (7, ...) of the length from the start of pieces: of ``y``, ``y**2`` and so on."""
        return (_POWERS @ self.speeds)[:, piece]

    def shares(self, parameters: FloatArray) -> FloatArray:
        """Return the shares of the length at parameters in 0..1; the parameters themselves where there is no length."""
        if not self.total > 0.0:
            return parameters
        piece = np.maximum(np.searchsorted(self.starts, parameters, "right") - 1, 0)
        length, _ = _length_and_speed(self._powers_of(piece), (parameters - self.starts[piece]) / self.widths[piece])
        return np.where(parameters >= 1.0, 1.0, np.minimum((self.lengths[piece] + length) / self.total, 1.0))

    def parameters(self, shares: FloatArray) -> FloatArray:
        """Return the parameters at shares of the length in 0..1: by Newton's method, by halving where it fails."""
        if not self.total > 0.0:
            return shares
        wanted = shares * self.total
        piece = np.minimum(np.searchsorted(self.lengths[1:], wanted, "right"), len(self.starts) - 1)
        powers, wanted = self._powers_of(piece), wanted - self.lengths[piece]
        y = wanted / np.maximum(self.lengths[piece + 1] - self.lengths[piece], _TINY)
        for _ in range(_MAX_STEPS):
            length, speed = _length_and_speed(powers, y)
            step = (length - wanted) / np.maximum(speed, _TINY)
            y = np.minimum(np.maximum(y - step, 0.0), 1.0)
            left = np.abs(step) > _ENOUGH
            if not left.any():
                break
        else:
            y = np.asarray(y)  # a scalar, of a single share, takes no items
            y[left] = _by_halving(powers[:, left], wanted[left])
        return np.where(shares >= 1.0, 1.0, np.minimum(self.starts[piece] + y * self.widths[piece], 1.0))


def measure(spline: BSpline, knots: FloatArray) -> ArcLength:
    """Measure a spline from the first to the last of some knots, which do not decrease.

    Nodes in each knot span alone are too few where the spline bends sharply, as its speed falls there. So spans are
    halved until the speeds at the nodes of a piece differ little, the less the longer it is.
    """
    spans = knots[1:] - knots[:-1]
    starts, widths = knots[:-1][spans > 0.0], spans[spans > 0.0]
    least = 0.0
    done: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    for halvings in range(_MAX_HALVINGS + 1):
        velocity = spline(starts + widths * _AT[:, None], nu=1)
        speeds = np.sqrt(np.einsum("ijk,ijk->ij", velocity, velocity)) * widths
        if not done:
            least = _MAX_SPREAD * float((_WEIGHTS @ speeds).sum())
        fastest = speeds.max(axis=0)
        rough = (fastest - speeds.min(axis=0)) ** 2 > least * fastest
        if not done and rough.any():
            least = max(least, _ROUNDING * float(np.abs(spline.c).max()))
            rough &= fastest > least
        if halvings == _MAX_HALVINGS or not rough.any():
            done.append((starts, widths, speeds))
            break
        done.append((starts[~rough], widths[~rough], speeds[:, ~rough]))
        widths = np.tile(0.5 * widths[rough], 2)
        starts = np.concatenate((starts[rough], starts[rough] + widths[: len(widths) // 2]))
    if len(done) > 1:
        starts, widths, speeds = (np.concatenate(parts, axis=-1) for parts in zip(*done, strict=True))
        order = np.argsort(starts)
        starts, widths, speeds = starts[order], widths[order], speeds[:, order]
    lengths = np.zeros(len(starts) + 1)
    np.cumsum(_WEIGHTS @ speeds, out=lengths[1:])
    return ArcLength(starts, widths, speeds, lengths)


def _length_and_speed(powers: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the length from the start of pieces, and its derivative; powers (7, ...) and ``y`` (...) in 0..1."""
    length, speed = powers[-1], np.zeros_like(y)
    for power in powers[-2::-1]:
        speed = speed * y + length
        length = length * y + power
    return length * y, speed * y + length


def _by_halving(powers: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return where in 0..1 the length from the start of pieces is as wanted, (k,), however slow they get."""
    low, high = np.zeros_like(wanted), np.ones_like(wanted)
    for _ in range(np.finfo(np.float64).nmant):
        middle = 0.5 * (low + high)
        before = _length_and_speed(powers, middle)[0] < wanted
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return 0.5 * (low + high)


def directions(spline: BSpline, t: FloatArray) -> FloatArray:
    """Return unit tangents at parameters (...), shape (..., ndim); zero where the spline stands still."""
    velocity = spline(t, nu=1)
    speed = np.linalg.norm(velocity, axis=-1, keepdims=True)
    return np.divide(velocity, speed, out=np.zeros_like(velocity), where=speed > 0)


def bends(spline: BSpline, t: FloatArray) -> FloatArray:
    """Return the second derivatives by the length, shape (..., ndim): across the spline, as long as its curvature."""
    along, velocity, change = directions(spline, t), spline(t, nu=1), spline(t, nu=2)
    across = change - (change * along).sum(axis=-1, keepdims=True) * along
    squared = (velocity**2).sum(axis=-1, keepdims=True)
    return np.divide(across, squared, out=np.zeros_like(across), where=squared > 0)


def nearest_place(spline: BSpline, knots: FloatArray, point: FloatArray) -> tuple[float, float]:
    """Return the parameter between the first and the last knot that is nearest to a point, and its distance."""
    breaks = np.unique(knots)
    enough = float(np.linalg.norm(spline(breaks) - point, axis=1).min())
    candidates = [breaks]
    powers = range(spline.k, -1, -1)
    for start, width in zip(breaks[:-1], np.diff(breaks), strict=True):
        first = int(np.searchsorted(spline.t, start, "right")) - 1 - spline.k
        hull = spline.c[first : first + spline.k + 1]  # the piece of curve lies in their box
        outside = np.maximum(np.maximum(hull.min(axis=0) - point, point - hull.max(axis=0)), 0.0)
        if float(np.linalg.norm(outside)) <= enough:  # there, the derivative of the squared distance is zero
            piece = np.stack([spline(start, nu=n) * (width**n / math.factorial(n)) for n in powers])
            piece[-1] -= point
            slope = sum(np.convolve(np.polyder(axis), axis) for axis in piece.T)
            candidates.append(start + width * np.clip(np.roots(slope).real, 0.0, 1.0))
    t = np.concatenate(candidates)
    distances = np.linalg.norm(spline(t) - point, axis=1)
    nearest = int(distances.argmin())
    return float(t[nearest]), float(distances[nearest])
