"""Walking along a drawn line by arc length."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.support.arrays import FloatArray

Span = tuple[float, float]
"""From and to."""

# Chords of 4 px stray from a bend of 10 px radius by 0.2 px; much shorter ones bead where their anti-aliased ends meet.
_CHORD_PX = 4.0
_MIN_CHORDS, _MAX_CHORDS = 16, 20_000
# What is repeated along a line: only curves that leave the picture by far are so long.
_MAX_REPEATS = 1_000


class Path:
    """A line through points, measured along its length.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, 2)
        ``(x, y)`` px; two or more.
    u : numpy.ndarray, shape (n,), optional
        A parameter that does not decrease; by default the share of the length.
    """

    def __init__(self, points: FloatArray, u: FloatArray | None = None) -> None:
        self.points = points
        self._s = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
        self._u = self._s / max(self.length, 1e-12) if u is None else u

    @classmethod
    def of(cls, curve: BSplineCurve) -> Path:
        """Flatten a curve in the image."""
        rough = np.linalg.norm(np.diff(curve.sample(_MIN_CHORDS), axis=0), axis=1).sum()
        chords = min(max(math.ceil(1.5 * rough / _CHORD_PX), _MIN_CHORDS), _MAX_CHORDS)
        u = np.linspace(0.0, 1.0, chords + 1)
        return cls(curve(u), u)

    @property
    def length(self) -> float:
        """Arc length, px."""
        return float(self._s[-1])

    def arc_at(self, u: float) -> float:
        """Return the arc length at which the parameter is `u`; outside of it, the nearer end's."""
        return float(np.interp(u, self._u, self._s))

    def share_near(self, point: FloatArray, low: float = 0.0, high: float = 1.0) -> float:
        """Return the parameter in ``low..high`` at which the line is nearest to a point (2,), to half a chord."""
        (among,) = np.nonzero((self._u >= low) & (self._u <= high))
        if not len(among):
            return min(max(low, 0.0), 1.0)
        return float(self._u[among[np.linalg.norm(self.points[among] - point, axis=1).argmin()]])

    def point(self, s: float) -> FloatArray:
        """Return the point at arc length `s`, shape (2,)."""
        return np.array([np.interp(s, self._s, self.points[:, 0]), np.interp(s, self._s, self.points[:, 1])])

    def direction(self, s: float, reach: float) -> FloatArray:
        """Return the unit vector, shape (2,), from `reach` px before `s` to as much after; zero where nothing moves."""
        chord = self.point(s + reach) - self.point(s - reach)
        norm = float(np.linalg.norm(chord))
        return chord / norm if norm > 0.0 else chord

    def piece(self, span: Span) -> FloatArray:
        """Return the points of the line from one arc length to another, shape (n, 2), both ends included."""
        inside = self.points[(self._s > span[0]) & (self._s < span[1])]
        return np.vstack((self.point(span[0]), inside, self.point(span[1])))


def complement(spans: Sequence[Span], length: float) -> list[Span]:
    """Return what of ``0..length`` no span covers, in order."""
    rest: list[Span] = []
    end = 0.0
    for low, high in sorted(spans):
        if low > end:
            rest.append((end, low))
        end = max(end, high)
    if end < length:
        rest.append((end, length))
    return rest


def repeats(wanted: float) -> int:
    """Return how often to repeat something: the nearest whole number, at least once and within reason."""
    return min(max(1, round(wanted)), _MAX_REPEATS)


def dashes(span: Span, dash: float, space: float) -> list[Span]:
    """Return whole dashes that fill a span, about `dash` long and `space` apart, with a space at either end."""
    length = span[1] - span[0]
    count = repeats((length - space) / (dash + space))
    scale = length / (count * (dash + space) + space)
    starts = [span[0] + scale * (space + i * (dash + space)) for i in range(count)]
    return [(start, start + scale * dash) for start in starts]
