"""Curves as evenly spaced points, and the start and direction in which two of them fit best.

A closed curve has no ends; where its ``u`` begins is a matter of convention, and so its start is chosen where it fits
best. Open curves are taken as they are, or in the better of both directions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize_scalar

from dloftbs.data.centerline import arc_parameter
from dloftbs.data.curve import BSplineCurve
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray, as_points
from dloftbs.support.values import check_integer

CurveLike: TypeAlias = BSplineCurve | npt.ArrayLike
"""A curve, or points (n, 2) px or (n, 3) m in order, at least two, that make an open polyline."""

Criterion: TypeAlias = Callable[[FloatArray, FloatArray], float]

SAMPLES = 500
"""Points per curve where nothing else is asked for: every 3 px of a cable as long as an HD image is wide."""

# Chords between the points of a curve cut its corners by the square of their length: a sixteenth of that of `samples`.
_OVERSAMPLING = 4
_MAX_SAMPLES = 1_000_000  # against a number that was not meant
_STARTS = 64  # tried around a loop before the best is refined


@dataclass(frozen=True, eq=False)
class Trace:
    """A curve as a polyline.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, d)
        At least two; of a closed curve the last is the first again.
    closed : bool
    """

    points: FloatArray
    closed: bool

    @cached_property
    def arc(self) -> FloatArray:
        """Normalised arc length at each point, shape (n,)."""
        return arc_parameter(self.points)

    @cached_property
    def backwards(self) -> Trace:
        """The trace run the other way."""
        return Trace(self.points[::-1], self.closed)

    def resampled(self, count: int, start: float = 0.0) -> FloatArray:
        """Return `count` points at equal distances along it, both ends included, shape (count, d).

        A closed trace begins at the arc length `start` and comes back to it.
        """
        if not start and count in self._from_its_start:
            return self._from_its_start[count]
        s = np.linspace(start, start + 1.0, count)
        if start:
            s %= 1.0
        made = np.stack([np.interp(s, self.arc, values) for values in self.points.T], axis=1)
        if not start:
            self._from_its_start[count] = made
        return made

    @cached_property
    def _from_its_start(self) -> dict[int, FloatArray]:
        """Points that were asked for: every curve of a frame is compared with several others."""
        return {}


def trace_of(name: str, curve: CurveLike, samples: int) -> Trace:
    """Return a curve as a dense polyline.

    Raises
    ------
    InputError
        If it has less than two points, a wrong shape or values that are not finite, or `samples` is less than 2.
    """
    check_integer("samples", samples, 2, _MAX_SAMPLES)
    if isinstance(curve, BSplineCurve):
        return Trace(curve.sample(_OVERSAMPLING * samples), curve.closed)
    points = as_points(name, curve)
    if len(points) < 2:
        raise InputError(f"{name} must have 2 or more points, got {len(points)}")
    return Trace(points, closed=False)


def traces_of(found: CurveLike, true: CurveLike, samples: int) -> tuple[Trace, Trace]:
    """Return both curves of a comparison as dense polylines.

    Raises
    ------
    InputError
        As `trace_of`, or if one is in the plane and one in space.
    """
    traces = trace_of("found", found, samples), trace_of("true", true, samples)
    check_dimensions(*traces)
    return traces


def check_dimensions(found: Trace, true: Trace) -> None:
    """See that both are in the plane, or both in space.

    Raises
    ------
    InputError
        If not.
    """
    shapes = found.points.shape[1], true.points.shape[1]
    if shapes[0] != shapes[1]:
        raise InputError(f"found and true must have the same dimension, got {shapes[0]} and {shapes[1]}")


@dataclass(frozen=True, eq=False)
class Alignment:
    """Two curves, run so that a criterion between them is least.

    Parameters
    ----------
    error : float
        The criterion.
    forward : bool
        Whether `found` runs as the truth does; a tie counts as forward.
    found, true : numpy.ndarray, shape (samples, d)
        The points that were compared.
    """

    error: float
    forward: bool
    found: FloatArray
    true: FloatArray


def align(found: Trace, true: Trace, samples: int, criterion: Criterion, *, directed: bool) -> Alignment:
    """Return the alignment with the least criterion that the freedoms of the two curves allow.

    Parameters
    ----------
    found, true : Trace
        If `true` is closed its start is free, else that of `found` if that one is closed.
    samples : int
        Evenly spaced points of each that the criterion gets.
    criterion : callable
        From points (samples, d) of both to a number; the smaller the better.
    directed : bool
        Whether `found` must be taken in its own direction; else the better one of both.
    """
    forward = _align_one_way(found, true, samples, criterion)
    if directed:
        return Alignment(forward[0], True, *forward[1:])
    backward = _align_one_way(found.backwards, true, samples, criterion)
    best = min(forward, backward, key=lambda fit: fit[0])
    return Alignment(best[0], best is forward, *best[1:])


def _align_one_way(
    found: Trace, true: Trace, samples: int, criterion: Criterion
) -> tuple[float, FloatArray, FloatArray]:
    def points(start: float) -> tuple[FloatArray, FloatArray]:
        turns_true = true.closed
        return (
            found.resampled(samples, 0.0 if turns_true else start),
            true.resampled(samples, start if turns_true else 0.0),
        )

    start = _best_start(lambda s: criterion(*points(s))) if found.closed or true.closed else 0.0
    x, y = points(start)
    return criterion(x, y), x, y


def _best_start(error: Callable[[float], float]) -> float:
    """Return the start with the least error: the best of a grid, then refined between its neighbours."""
    grid = np.arange(_STARTS) / _STARTS
    errors = [error(start) for start in grid]
    best = int(np.argmin(errors))
    step = 1.0 / _STARTS
    # From 1 on rather than from 0, so that the interval before the seam does not become negative.
    around = (1.0 + grid[best] - step, 1.0 + grid[best] + step)
    refined = minimize_scalar(error, bounds=around, method="bounded", options={"xatol": 1e-9})
    return float(refined.x) if refined.fun < errors[best] else float(grid[best])
