"""The result of everything: one cubic B-spline in the plane or in space."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline

from dloftbs._arrays import FloatArray, as_float_array, as_numbers, as_points, as_vector, frozen
from dloftbs._values import check_flag, check_integer, shown
from dloftbs.errors import InputError

# Five Gauss-Legendre nodes a knot span integrate the speed of a cubic to far below the noise of a pixel.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)

_HIGHEST_DEGREE = 9  # higher ones are of no use, and oscillate
_SHORTEST_SPAN = 1e-12  # of knots: derivatives by shorter ones are not finite
_MOST_POINTS = 10_000_000  # of a sample, against a number that was not meant
_MOST_DERIVATIVES = 100  # all beyond the degree are zero
ROUNDING = 1e-9  # of a parameter that is meant to be 0 or 1


class BSplineCurve:
    """A B-spline curve with a parameter ``u`` from 0 to 1: the normalised distance along the object, gaps counted in.

    Immutable; its arrays are read-only.

    Parameters
    ----------
    knots : array_like, shape (n + degree + 1,)
        Non-decreasing; the base interval ``knots[degree]`` to ``knots[n]`` must be 0 to 1.
    control_points : array_like, shape (n, 2) or (n, 3)
        In pixels ``(x, y)`` or in metres ``(x, y, z)``.
    degree : int
        Polynomial degree, 3 throughout this package.
    closed : bool
        Whether the curve is periodic: a loop without ends.

    Raises
    ------
    InputError
        If the shapes disagree, a value is no finite number, the knots decrease, more than ``degree + 1`` of them are
        the same, or the base interval is not 0 to 1.
    """

    __slots__ = ("__dict__", "_closed", "_control_points", "_degree", "_knots")
    _knots: FloatArray
    _control_points: FloatArray
    _degree: int
    _closed: bool

    def __init__(
        self, knots: npt.ArrayLike, control_points: npt.ArrayLike, degree: int = 3, *, closed: bool = False
    ) -> None:
        control = as_points("control_points", control_points)
        degree = check_integer("degree", degree, 1, _HIGHEST_DEGREE)
        if len(control) < degree + 1:
            raise InputError(
                f"a curve of degree {degree} needs {degree + 1} control points or more, got {len(control)}"
            )
        vector = as_vector("knots", knots, len(control) + degree + 1)
        if (np.diff(vector) < 0).any():
            raise InputError("knots must not decrease")
        if not (vector[degree + 1 :] > vector[: -degree - 1]).all():
            raise InputError(f"no more than {degree + 1} knots may be the same")
        ends = (float(vector[degree]), float(vector[len(control)]))
        if not np.allclose(ends, (0.0, 1.0), rtol=0.0, atol=1e-9):
            raise InputError(f"knots must span 0 to 1 between knots[{degree}] and knots[{len(control)}], got {ends}")
        spans = np.diff(vector[degree : len(control) + 1])
        if ((spans > 0.0) & (spans < _SHORTEST_SPAN)).any():
            raise InputError(f"knots must be the same or at least {_SHORTEST_SPAN:g} apart, got {spans.min()}")
        self._set(vector, control, degree, check_flag("closed", closed))

    @classmethod
    def _unchecked(cls, knots: FloatArray, control_points: FloatArray, degree: int, closed: bool) -> BSplineCurve:
        """Wrap arrays that are known to be right and that nobody else will change; nothing is checked or copied."""
        curve = cls.__new__(cls)
        curve._set(frozen(knots), frozen(control_points), degree, closed)
        return curve

    def _set(self, knots: FloatArray, control_points: FloatArray, degree: int, closed: bool) -> None:
        put = object.__setattr__
        put(self, "_knots", knots)
        put(self, "_control_points", control_points)
        put(self, "_degree", degree)
        put(self, "_closed", closed)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a curve is immutable: cannot set {name!r}")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"a curve is immutable: cannot delete {name!r}")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self)._unchecked, (self._knots, self._control_points, self._degree, self._closed)

    @property
    def knots(self) -> FloatArray:
        """The knot vector, shape (n + degree + 1,)."""
        return self._knots

    @property
    def control_points(self) -> FloatArray:
        """The control points, shape (n, ndim), in pixels or in metres."""
        return self._control_points

    @property
    def degree(self) -> int:
        """The polynomial degree."""
        return self._degree

    @property
    def closed(self) -> bool:
        """True if the curve is a loop without ends."""
        return self._closed

    @property
    def ndim(self) -> int:
        """2 in the image, 3 in space."""
        return int(self._control_points.shape[1])

    @cached_property
    def spline(self) -> BSpline:
        """The same curve as a `scipy.interpolate.BSpline`."""
        extrapolate: bool | str = "periodic" if self._closed else True
        # Copies, since scipy 1.10 does not evaluate read-only arrays.
        return BSpline.construct_fast(self._knots.copy(), self._control_points.copy(), self._degree, extrapolate)

    @cached_property
    def length(self) -> float:
        """Arc length, in the unit of the control points."""
        breaks = np.unique(self._knots[self._degree : len(self._control_points) + 1])
        half = np.diff(breaks)[:, None] / 2.0
        u = breaks[:-1, None] + half * (1.0 + _NODES)
        speed = np.linalg.norm(self(u.ravel(), 1), axis=1).reshape(u.shape)
        return float((speed * half * _WEIGHTS).sum())

    @property
    def start(self) -> FloatArray:
        """The point at ``u = 0``, shape (ndim,)."""
        return self(0.0)

    @property
    def end(self) -> FloatArray:
        """The point at ``u = 1``, shape (ndim,); of a loop that is its start."""
        return self(1.0)

    def __call__(self, u: npt.ArrayLike, derivative: int = 0, *, extrapolate: bool = False) -> FloatArray:
        """Evaluate the curve or a derivative by ``u``.

        Parameters
        ----------
        u : array_like, shape (...)
            Parameters; a loop goes on around beyond 0..1.
        derivative : int
            0 for the points, 1 for the first derivative by ``u``, and so on.
        extrapolate : bool
            Whether an open curve is led on beyond its ends, which soon goes anywhere.

        Returns
        -------
        numpy.ndarray, shape (..., ndim)

        Raises
        ------
        InputError
            If `u` is no number, or beyond the ends of an open curve, and not by rounding, unless `extrapolate`.
        """
        at = as_numbers("u", u)
        derivative = check_integer("derivative", derivative, 0, _MOST_DERIVATIVES)
        if not self._closed and at.size and not check_flag("extrapolate", extrapolate):
            low, high = float(at.min()), float(at.max())
            if not (low >= -ROUNDING and high <= 1.0 + ROUNDING):
                raise InputError(
                    f"u must be within 0..1 on an open curve, got {low:g} to {high:g}; extrapolate=True leads it on"
                )
        result: FloatArray = self.spline(at, nu=derivative)
        return result

    def nearest(self, point: npt.ArrayLike) -> tuple[float, float]:
        """Return the parameter of the point of the curve that is nearest to another point, and their distance.

        Parameters
        ----------
        point : array_like, shape (ndim,)

        Returns
        -------
        u : float
        distance : float
            In the unit of the control points.

        Raises
        ------
        InputError
            If the point has another shape, or a value is no finite number.
        """
        place = as_vector("point", point, self.ndim)
        breaks = np.unique(self._knots[self._degree : len(self._control_points) + 1])
        enough = float(np.linalg.norm(self(breaks) - place, axis=1).min())
        candidates = [breaks]
        powers = range(self._degree, -1, -1)
        for start, width in zip(breaks[:-1], np.diff(breaks), strict=True):
            first = int(np.searchsorted(self._knots, start, "right")) - 1 - self._degree
            hull = self._control_points[first : first + self._degree + 1]  # the piece of curve lies in their box
            outside = np.maximum(np.maximum(hull.min(axis=0) - place, place - hull.max(axis=0)), 0.0)
            if float(np.linalg.norm(outside)) <= enough:  # there, the derivative of the squared distance is zero
                piece = np.stack([self(start, n) * (width**n / math.factorial(n)) for n in powers])
                piece[-1] -= place
                slope = sum(np.convolve(np.polyder(axis), axis) for axis in piece.T)
                candidates.append(start + width * np.clip(np.roots(slope).real, 0.0, 1.0))
        u = np.concatenate(candidates)
        distances = np.linalg.norm(self(u) - place, axis=1)
        nearest = int(distances.argmin())
        return float(u[nearest]), float(distances[nearest])

    def sample(self, n: int) -> FloatArray:
        """Return `n` points at evenly spaced ``u`` from 0 to 1, both included, shape (n, ndim).

        Raises
        ------
        InputError
            If `n` is no integer of at least 2.
        """
        return self(np.linspace(0.0, 1.0, check_integer("n", n, 2, _MOST_POINTS)))

    def tangent(self, u: npt.ArrayLike) -> FloatArray:
        """Return unit tangents towards growing ``u``, shape (..., ndim); zero where the curve stands still."""
        velocity = self(u, 1)
        speed = np.linalg.norm(velocity, axis=-1, keepdims=True)
        return np.divide(velocity, speed, out=np.zeros_like(velocity), where=speed > 0)

    def curvature(self, u: npt.ArrayLike) -> FloatArray:
        """Return the curvature (1 / radius), shape (...), in one over the unit of the control points.

        ``|c' x c''| / |c'|^3``; without sign, in the plane as in space; 0 where the curve stands still.
        """
        first, second = self(u, 1), self(u, 2)
        squared_speed = (first**2).sum(axis=-1)
        # |a x b|^2 = |a|^2 |b|^2 - (a . b)^2 holds in any dimension.
        squared_cross = squared_speed * (second**2).sum(axis=-1) - (first * second).sum(axis=-1) ** 2
        cross = np.sqrt(np.maximum(squared_cross, 0.0))
        return np.divide(cross, squared_speed**1.5, out=np.zeros_like(cross), where=squared_speed > 0)

    def reversed(self) -> BSplineCurve:
        """Return the same curve run the other way: its ``u`` is this one's ``1 - u``."""
        knots, control = 1.0 - self._knots[::-1], self._control_points[::-1].copy()
        return self._unchecked(knots, control, self._degree, self._closed)

    def transformed(self, matrix: npt.ArrayLike, offset: npt.ArrayLike) -> BSplineCurve:
        """Return the curve under the affine map ``p -> matrix @ p + offset``, exactly.

        Parameters
        ----------
        matrix : array_like, shape (m, ndim)
        offset : array_like, shape (m,)
            With m of 2 or 3.

        Raises
        ------
        InputError
            If the shapes disagree, or a value, or a control point then, is no finite number.
        """
        turn, shift = as_float_array("matrix", matrix), as_vector("offset", offset)
        if turn.shape != (len(shift), self.ndim):
            raise InputError(f"matrix must have shape ({len(shift)}, {self.ndim}), got {turn.shape}")
        control = as_points("control_points", self._control_points @ turn.T + shift)
        return self._unchecked(self._knots, control, self._degree, self._closed)

    def to_dict(self) -> dict[str, Any]:
        """Return plain lists and numbers, ready for JSON; `from_dict` takes them back without loss."""
        return {
            "degree": self._degree,
            "closed": self._closed,
            "knots": self._knots.tolist(),
            "control_points": self._control_points.tolist(),
            "length": self.length,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> BSplineCurve:
        """Build a curve from what `to_dict` gave.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        if not isinstance(data, Mapping):
            raise InputError(f"a curve needs a dictionary as of to_dict, got {shown(data)}")
        try:
            knots, control_points, degree = data["knots"], data["control_points"], data["degree"]
            closed = data["closed"]
        except KeyError as error:
            raise InputError(f"a curve needs the key {error.args[0]!r}, got {shown(list(data))}") from error
        return cls(knots, control_points, degree, closed=closed)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, BSplineCurve):
            return NotImplemented
        return (
            self._degree == other._degree
            and self._closed == other._closed
            and np.array_equal(self._knots, other._knots)
            and np.array_equal(self._control_points, other._control_points)
        )

    def __hash__(self) -> int:
        # Adding 0.0 turns -0.0 into 0.0, which it equals.
        return hash((self._degree, self._closed, (self._knots + 0.0).tobytes(), (self._control_points + 0.0).tobytes()))

    def __repr__(self) -> str:
        kind = "closed" if self._closed else "open"
        return (
            f"BSplineCurve({kind}, {self.ndim}D, {len(self._control_points)} control points, length {self.length:.4g})"
        )


def check_curve(name: str, curve: object, ndim: int) -> None:
    """Raise an `InputError` if a value is no curve of that number of dimensions."""
    if not isinstance(curve, BSplineCurve) or curve.ndim != ndim:
        raise InputError(f"{name} must be a BSplineCurve with {ndim} dimensions, got {shown(curve)}")
