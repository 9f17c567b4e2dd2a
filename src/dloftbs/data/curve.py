"""The result of everything: one cubic B-spline in the plane or in space."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline

from dloftbs.data.spans import Spans
from dloftbs.data.spline_geometry import ArcLength, bends, directions, measure, nearest_place
from dloftbs.errors import InputError
from dloftbs.support.arrays import (
    LARGEST,
    FloatArray,
    as_float_array,
    as_numbers,
    as_points,
    as_vector,
    check_mask,
    frozen,
)
from dloftbs.support.values import check_flag, check_integer, check_number, shown, values_of

_HIGHEST_DEGREE = 9  # higher ones are of no use, and oscillate
_SHORTEST_SPAN = 1e-12  # of knots: derivatives by shorter ones are not finite
_MAX_POINTS = 10_000_000  # of a sample, against a number that was not meant
_MAX_DERIVATIVES = 2  # by the length; the spline has more, by its own parameter
ROUNDING = 1e-9  # of a parameter that is meant to be 0 or 1


class BSplineCurve:
    """A B-spline curve with a parameter ``u`` from 0 to 1: the normalised arc length, gaps counted in.

    Immutable; its arrays are read-only. The knots belong to the spline's own parameter ``t``, which is near ``u`` where
    the spline was fitted, and is not it: `t_at` and `u_at` lead from one to the other, to 1e-4.

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
        """The same curve as a `scipy.interpolate.BSpline`, by its own parameter ``t``: see `t_at`."""
        extrapolate: bool | str = "periodic" if self._closed else True
        # Copies, since scipy 1.10 does not evaluate read-only arrays.
        return BSpline.construct_fast(self._knots.copy(), self._control_points.copy(), self._degree, extrapolate)

    @cached_property
    def _along(self) -> ArcLength:
        return measure(self.spline, self._base)

    @property
    def _base(self) -> FloatArray:
        """The knots from 0 to 1."""
        return self._knots[self._degree : len(self._control_points) + 1]

    @cached_property
    def breaks(self) -> FloatArray:
        """The distinct knots from 0 to 1, shape (m,): between two of them, the curve is one polynomial."""
        return frozen(np.unique(self._base))

    @property
    def length(self) -> float:
        """Arc length, in the unit of the control points, to 1e-4 of it or better."""
        return self._along.total

    @property
    def start(self) -> FloatArray:
        """The point at ``u = 0``, shape (ndim,)."""
        result: FloatArray = self.spline(0.0)
        return result

    @property
    def end(self) -> FloatArray:
        """The point at ``u = 1``, shape (ndim,); of a loop that is its start."""
        result: FloatArray = self.spline(1.0)
        return result

    def __call__(self, u: npt.ArrayLike, derivative: int = 0, *, extrapolate: bool = False) -> FloatArray:
        """Evaluate the curve or a derivative by ``u``.

        Parameters
        ----------
        u : array_like, shape (...)
            Shares of the length; a loop goes on around beyond 0..1.
        derivative : int
            0 for the points, 1 for the first derivative by ``u``, as long as the curve, and 2 for the second one.
        extrapolate : bool
            Whether an open curve goes on straight beyond its ends.

        Returns
        -------
        numpy.ndarray, shape (..., ndim)

        Raises
        ------
        InputError
            If `u` is no number, or beyond the ends of an open curve, and not by rounding, unless `extrapolate`.
        """
        at = as_numbers("u", u)
        derivative = check_integer("derivative", derivative, 0, _MAX_DERIVATIVES)
        extrapolate = check_flag("extrapolate", extrapolate)
        beyond = at - np.clip(at, 0.0, 1.0) if extrapolate and not self._closed else np.zeros(())
        t = self.t_at(at - beyond)
        if derivative == 0:
            result: FloatArray = self.spline(t)
            return result + (beyond * self.length)[..., None] * directions(self.spline, t) if beyond.any() else result
        if derivative == 1:
            return self.length * directions(self.spline, t)
        return np.where((beyond == 0.0)[..., None], self.length**2 * bends(self.spline, t), 0.0)

    def t_at(self, u: npt.ArrayLike) -> FloatArray:
        """Return the spline's own parameters ``t`` of places on the curve, shape (...): ``spline(t)`` is there.

        Parameters
        ----------
        u : array_like, shape (...)
            Shares of the length; a loop goes on around beyond 0..1.

        Raises
        ------
        InputError
            If a value is no number, or beyond the ends of an open curve, and not by rounding.
        """
        turns, at = self._on_curve("u", u)
        return turns + self._along.parameters(at)

    def u_at(self, t: npt.ArrayLike) -> FloatArray:
        """Return the shares ``u`` of the length at parameters ``t`` of the spline, shape (...): the inverse of `t_at`.

        Parameters
        ----------
        t : array_like, shape (...)
            As the knots have them.

        Raises
        ------
        InputError
            As `t_at`.
        """
        turns, at = self._on_curve("t", t)
        return turns + self._along.shares(at)

    def _on_curve(self, name: str, values: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return the whole turns around a loop, 0 on an open curve, and the rest, in 0..1."""
        if self._closed:
            at = as_float_array(name, values)
            turns = np.floor(at)
            return turns, at - turns
        at = as_numbers(name, values)
        if at.size:
            low, high = float(at.min()), float(at.max())
            if not (low >= -ROUNDING and high <= 1.0 + ROUNDING):
                raise InputError(
                    f"{name} must be within 0..1 on an open curve, got {low:g} to {high:g}; "
                    "a call with extrapolate=True goes on straight"
                )
        return np.zeros(()), np.clip(at, 0.0, 1.0)

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
        t, distance = nearest_place(self.spline, self._base, as_vector("point", point, self.ndim))
        return float(self.u_at(t)), distance

    def sample(self, n: int | None = None, *, spacing: float | None = None) -> FloatArray:
        """Return points at equal distances along the curve, both ends included, shape (n, ndim).

        Parameters
        ----------
        n : int, optional
            Number of points, two or more.
        spacing : float, optional
            In its place, the distance from point to point along the curve, in its unit: the largest one up to this that
            divides the length.

        Raises
        ------
        InputError
            If `n` is no integer of at least 2, the spacing is not positive or gives more points than fit into memory,
            or there are both or neither.
        """
        if (n is None) == (spacing is None):
            raise InputError(f"give either n or spacing, got n={shown(n)} and spacing={shown(spacing)}")
        if spacing is not None:
            step = check_number("spacing", spacing, self.length / (_MAX_POINTS - 1), LARGEST)
            n = max(math.ceil(self.length / step - ROUNDING), 1) + 1 if step > 0.0 else 2
        return self(np.linspace(0.0, 1.0, check_integer("n", n, 2, _MAX_POINTS)))

    def resample(self, n: int) -> FloatArray:
        """Return `n` points at equal distances along the curve: `sample` under the name of other packages."""
        return self.sample(n)

    def tangent(self, u: npt.ArrayLike) -> FloatArray:
        """Return unit tangents towards growing ``u``, shape (..., ndim); zero where the curve stands still."""
        return directions(self.spline, self.t_at(u))

    def curvature(self, u: npt.ArrayLike) -> FloatArray:
        """Return the curvature (1 / radius), shape (...), in one over the unit of the control points.

        Without sign, in the plane as in space; 0 where the curve stands still.
        """
        return np.linalg.norm(bends(self.spline, self.t_at(u)), axis=-1)

    def bend_radius(self, u: npt.ArrayLike, over: float | None = None) -> FloatArray:
        """Return the radius of the bend, shape (...), in the unit of the control points; infinite where it is straight.

        Parameters
        ----------
        u : array_like, shape (...)
        over : float, optional
            Shortest wave along the curve that is a bend and no noise, in that unit: half of its curvature is left at
            most, and hardly anything of shorter ones. By default the distance between knots, as fitted curves need it,
            since their knots follow the noise of pixels. The curvature is averaged over longer stretches, as long as
            the noise explains what these differ by. 0 takes the curve as it is: ``1 / curve.curvature(u)``.

        Raises
        ------
        InputError
            If a ``u`` is not on the curve, or the length is negative.
        """
        from dloftbs.data.curve_bends import bend_radius

        return bend_radius(self, u, over)

    def tightest_bend(self, over: float | None = None) -> tuple[float, float]:
        """Return where the curve bends most, and the radius there, the least one of `bend_radius`.

        Parameters
        ----------
        over : float, optional
            As in `bend_radius`.

        Returns
        -------
        u : float
        radius : float
            In the unit of the control points; infinite of a straight line.

        Raises
        ------
        InputError
            If the length is negative.
        """
        from dloftbs.data.curve_bends import tightest_bend

        return tightest_bend(self, over)

    def slack(self, u_a: float, u_b: float) -> float:
        """Return how much longer the curve is between two places than the straight way, in its unit.

        Around a loop, the way from `u_a` on towards growing ``u`` is taken.

        Raises
        ------
        InputError
            If a ``u`` is no number, or not on the curve.
        """
        a, b = (check_number(name, u, -LARGEST, LARGEST) for name, u in (("u_a", u_a), ("u_b", u_b)))
        (start, end), along = self([a, b]), (b - a) % 1.0 if self._closed else abs(b - a)
        return max(along * self.length - float(np.linalg.norm(end - start)), 0.0)

    def distance(self, other: BSplineCurve | npt.ArrayLike) -> tuple[float, float, float]:
        """Return the two places at which this curve and another one are nearest to each other, and their distance.

        Parameters
        ----------
        other : BSplineCurve, or array_like, shape (n, ndim)
            A curve, or points that are joined by straight lines, two or more.

        Returns
        -------
        u, u_other : float
            Of several nearest places, one; of a polyline, the share of its length.
        distance : float
            In the unit of the control points; 0 where they cross.

        Raises
        ------
        InputError
            If the other one has another number of dimensions, fewer than two points, or a value is no finite number.
        """
        from dloftbs.data.curve_distance import nearest_places

        if not isinstance(other, BSplineCurve):
            points = as_points("other", other, (self.ndim,))
            if len(points) < 2:
                raise InputError(f"a polyline needs two points or more, got {len(points)}; `nearest` takes one point")
            other = BSplineCurve(np.concatenate(([0.0], np.linspace(0.0, 1.0, len(points)), [1.0])), points, 1)
        check_curve("other", other, self.ndim)
        return nearest_places(self, other)

    def nearest_pixel(self, mask: npt.ArrayLike) -> tuple[float, tuple[float, float], float] | None:
        """Return where a curve in the image is nearest to a pixel that is set in a mask.

        Parameters
        ----------
        mask : array_like, shape (H, W), bool or any integer type
            Any non-zero is set.

        Returns
        -------
        u : float
        pixel : (float, float)
            ``(x, y)`` px.
        distance : float
            From the curve to the middle of the pixel, px. None in place of all three, if no pixel is set.

        Raises
        ------
        InputError
            If it is no mask, or the curve is one in space.
        """
        from dloftbs.data.curve_distance import nearest_pixel

        self._check_plane("nearest_pixel")
        return nearest_pixel(self, check_mask(mask))

    def inside(self, polygon: npt.ArrayLike) -> Spans:
        """Return the parts of a curve in the image that lie inside of a polygon, as intervals of ``u``, ascending.

        Parameters
        ----------
        polygon : array_like, shape (n, 2)
            Its corners in order, three or more, px; it is closed by itself. Where it crosses itself, what is enclosed
            an even number of times lies outside.

        Raises
        ------
        InputError
            If it is no polygon, or the curve is one in space.
        """
        from dloftbs.data.curve_inside import spans_inside

        self._check_plane("inside")
        corners = as_points("polygon", polygon, (2,))
        if len(corners) < 3:
            raise InputError(f"a polygon needs three corners or more, got {len(corners)}")
        return spans_inside(self, corners)

    def poses(self, us: npt.ArrayLike, towards: npt.ArrayLike = (0.0, 0.0, 1.0)) -> FloatArray:
        """Return poses on the curve, as a gripper takes them.

        In space they are SE(3): x runs along the curve, z across it, and the frame turns about the curve no more than
        it must from one pose to the next (rotation-minimising), however the curve bends.

        Parameters
        ----------
        us : array_like, shape (n,)
            Shares of the length, in 0..1.
        towards : array_like, shape (3,)
            Direction that z is nearest to at ``u = 0``: by default the camera's line of sight, so that a gripper whose
            z points out of its palm comes from the camera. It is carried along from there. Curves in the plane have no
            use for it.

        Returns
        -------
        numpy.ndarray, shape (n, 4, 4), or (n, 3, 3) of a curve in the plane
            Homogeneous matrices from the pose to the curve's frame. In the plane they are SE(2): x along the curve, y
            to where a quarter of a turn leads from the image's x to its y.

        Raises
        ------
        InputError
            If a ``u`` is not in 0..1, or the direction is none.
        """
        from dloftbs.data.curve_frames import frames_in_plane, frames_in_space

        at = as_vector("us", us)
        if not ((at >= -ROUNDING) & (at <= 1.0 + ROUNDING)).all():
            raise InputError(f"us must be in 0..1, got {shown(at.tolist())}")
        at = np.clip(at, 0.0, 1.0)
        if self.ndim == 2:
            return frames_in_plane(self, at)
        direction = as_vector("towards", towards, 3)
        if not (size := float(np.linalg.norm(direction))) > 0.0:
            raise InputError("towards must be a direction, got zeros")
        return frames_in_space(self, at, direction / size)

    def _check_plane(self, name: str) -> None:
        if self.ndim != 2:
            raise InputError(f"{name} takes a curve in the image, and this one is in space: project it first")

    def reversed(self) -> BSplineCurve:
        """Return the same curve run the other way: its ``u`` is this one's ``1 - u``."""
        knots, control = 1.0 - self._knots[::-1], self._control_points[::-1].copy()
        return self._unchecked(knots, control, self._degree, self._closed)

    def transformed(self, matrix: npt.ArrayLike, offset: npt.ArrayLike | None = None) -> BSplineCurve:
        """Return the curve under the affine map ``p -> matrix @ p + offset``, exactly.

        Parameters
        ----------
        matrix : array_like, shape (m, ndim), or without an offset (ndim + 1, ndim + 1)
            The latter is homogeneous, with the offset in its last column: 4 x 4 in space, as of poses, 3 x 3 in the
            image.
        offset : array_like, shape (m,), optional
            With m of 2 or 3.

        Raises
        ------
        InputError
            If the shapes disagree, or a value, or a control point then, is no finite number, or the last row of a
            homogeneous matrix is another than zeros and a one.
        """
        turn = as_float_array("matrix", matrix)
        if offset is None:
            turn, offset = self._parts_of(turn)
        shift = as_vector("offset", offset)
        if turn.shape != (len(shift), self.ndim):
            raise InputError(f"matrix must have shape ({len(shift)}, {self.ndim}), got {turn.shape}")
        control = as_points("control_points", self._control_points @ turn.T + shift)
        return self._unchecked(self._knots, control, self._degree, self._closed)

    def _parts_of(self, matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what a homogeneous matrix multiplies by and what it adds."""
        side = self.ndim + 1
        if matrix.shape != (side, side):
            raise InputError(f"without an offset, matrix must have shape ({side}, {side}), got {matrix.shape}")
        if not np.allclose(matrix[-1], np.eye(side)[-1], rtol=0.0, atol=ROUNDING):
            last = " ".join("0" * self.ndim + "1")
            raise InputError(f"the last row of a homogeneous matrix must be {last}, got {shown(matrix[-1].tolist())}")
        return matrix[:-1, :-1], matrix[:-1, -1]

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
        keys = "knots", "control_points", "degree", "closed"
        knots, control_points, degree, closed = values_of("a curve", data, *keys)
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


def spans_by_length(curve: BSplineCurve, spans: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Return spans of a spline's own parameter as spans of the curve's ``u``."""
    return tuple([(low, max(low, high)) for low, high in curve.u_at(spans).tolist()]) if spans else ()


def check_curve(name: str, curve: object, ndim: int) -> None:
    """Raise an `InputError` if a value is no curve of that number of dimensions."""
    if not isinstance(curve, BSplineCurve) or curve.ndim != ndim:
        raise InputError(f"{name} must be a BSplineCurve with {ndim} dimensions, got {shown(curve)}")
