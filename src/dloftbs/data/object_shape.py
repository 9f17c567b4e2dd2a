"""Answers on the shape of an object with a width, which detections and tracks have in common."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_bends import WIDTHS_PER_WAVE, wave_of_knots
from dloftbs.data.u_mapping import to_image, to_space
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray

_TOUCH_PX = 1.0
"""Distance between two edges up to which objects touch in the image, px.

Source: by definition; pixels side by side.
"""


_SAMPLES = 100
"""Number of points of a curve that its scale is the median of.

Source: numerics.
"""

_STEP = 1e-4
"""Length across a curve whose image is measured, share of the depth.

Source: numerics; over so little the image is linear, and its rounding is 1e-8 of it.
"""


class ObjectShape:
    """Base of `Detection` and `Track`: what is asked of an object is computed then, and not before."""

    curve: BSplineCurve
    curve_3d: BSplineCurve | None
    camera: PinholeCamera | None

    @property
    def width_m(self) -> float | None:
        """Width of the object in space, by that in the image, `curve_3d` and the lens; None where it is not known."""
        width = self._known_width()
        if width is None or self.curve_3d is None or self.camera is None:
            return None
        return width_in_space(width, self.curve_3d, self.camera)

    def u_3d(self, u: npt.ArrayLike) -> FloatArray:
        """Return the ``u`` on `curve_3d` of the places that have these on `curve`, in the same shape.

        Each curve's ``u`` is its own arc length, and what recedes from the camera is shorter in the image than it is.

        Raises
        ------
        InputError
            If there is no curve in space, with the reason, or a ``u`` is not in 0..1.
        """
        return to_space(u, *self._placed())

    def u_2d(self, u_3d: npt.ArrayLike) -> FloatArray:
        """Return the ``u`` on `curve` of the places that have these on `curve_3d`, in the same shape.

        Raises
        ------
        InputError
            As `u_3d`.
        """
        return to_image(u_3d, *self._placed())

    def bend_radius(self, u: npt.ArrayLike) -> FloatArray:
        """Return the radius of the bend of `curve`, shape (...), px; waves too short for its width are noise.

        Parameters
        ----------
        u : array_like, shape (...)

        Raises
        ------
        InputError
            If a ``u`` is not on the curve.
        """
        return self.curve.bend_radius(u, _wave(self.curve, self._known_width()))

    def tightest_bend(self) -> tuple[float, float]:
        """Return the ``u`` of `curve` where it bends most, and the radius there, px; noise is left out as above."""
        return self.curve.tightest_bend(_wave(self.curve, self._known_width()))

    def bend_radius_3d(self, u_3d: npt.ArrayLike) -> FloatArray:
        """Return the radius of the bend of `curve_3d`, shape (...), metres; as `bend_radius`.

        Raises
        ------
        InputError
            If a ``u`` is not on the curve, or there is no curve in space.
        """
        curve = self._in_space()
        return curve.bend_radius(u_3d, _wave(curve, self.width_m))

    def tightest_bend_3d(self) -> tuple[float, float]:
        """Return the ``u`` of `curve_3d` where it bends most, and the radius there, metres.

        Raises
        ------
        InputError
            If there is no curve in space.
        """
        curve = self._in_space()
        return curve.tightest_bend(_wave(curve, self.width_m))

    def touches(self, other: ObjectShape) -> bool:
        """Return whether this object and another one touch.

        In space where both have curves and widths there: their axes are no farther apart than their radii together, and
        the deviations of both there. Else in the image, where one that lies across another one touches it, too.

        Raises
        ------
        InputError
            If the other one is no detection or track, or a width is not known.
        """
        if not isinstance(other, ObjectShape):
            raise InputError(f"other must be a Detection or a Track, got {type(other).__name__}")
        widths_m = self.width_m, other.width_m
        if widths_m[0] is not None and widths_m[1] is not None:
            u, u_other, apart = self._in_space().distance(other._in_space())
            unsure = float(np.hypot(self._std_or_0(u), other._std_or_0(u_other)))
            return apart <= 0.5 * (widths_m[0] + widths_m[1]) + unsure
        widths = self._known_width(), other._known_width()
        if widths[0] is None or widths[1] is None:
            raise InputError("whether objects touch is known by their widths, and one has none")
        return self.curve.distance(other.curve)[2] <= 0.5 * (widths[0] + widths[1]) + _TOUCH_PX

    def curve_std(self, u: npt.ArrayLike) -> FloatArray:
        """Return the standard deviation of points of `curve` across it; see the classes."""
        raise NotImplementedError  # a detection has it, and a track that of its detection

    def curve_3d_std(self, u_3d: npt.ArrayLike) -> FloatArray:
        """Return the standard deviation of points of `curve_3d` across it; see the classes."""
        raise NotImplementedError  # as above

    def _known_width(self) -> float | None:
        """Return the width in the image, px, which classes have as a field or as a property."""
        width: Any = getattr(self, "width_px", None)
        return None if width is None else float(width)

    def _in_space(self) -> BSplineCurve:
        if self.curve_3d is None:
            reason = getattr(self, "no_3d_reason", None)
            raise InputError("there is no curve in space" + (f": {reason}" if reason else ""))
        return self.curve_3d

    def _placed(self) -> tuple[BSplineCurve, PinholeCamera]:
        curve = self._in_space()
        if self.camera is None:
            raise InputError("the camera of the curve in space must be known; a frame with a camera tells it")
        return curve, self.camera

    def _std_or_0(self, u_3d: float) -> float:
        """Return the deviation in space at a place; 0 for a track without a detection, of which it is not known."""
        try:
            return float(self.curve_3d_std(u_3d))
        except InputError:
            return 0.0


def width_in_space(width_px: float, curve_3d: BSplineCurve, camera: PinholeCamera) -> float | None:
    """Return the width, metres, of a round object around a curve in space that has a width in the image.

    The width in the image is the median along the curve there, across the curve and through the lens. So the scale is
    the median of how many pixels a metre measures that lies across the curve and across the ray to it.

    Parameters
    ----------
    width_px : float
    curve_3d : BSplineCurve
        The axis, in the camera's frame.
    camera : PinholeCamera

    Returns
    -------
    float or None
        None where no part of the curve has an image that shows a width.
    """
    t = np.linspace(0.0, 1.0, _SAMPLES)
    points, along = curve_3d.spline(t), curve_3d.spline(t, nu=1)
    ahead = points[:, 2] > 0.0
    points, along = points[ahead], along[ahead]
    if len(points) < 2:
        return None
    step_m = _STEP * points[:, 2:]
    across = step_m * _units(np.cross(points, along))
    places = camera.project(points)
    forward = _units(camera.project(points + step_m * _units(along)) - places)
    ends = camera.project(points + across) - camera.project(points - across)
    px_per_m = np.abs(forward[:, 0] * ends[:, 1] - forward[:, 1] * ends[:, 0]) / (2.0 * step_m[:, 0])
    known = px_per_m > 0.0  # not beyond the field of the lens, nor where the curve is seen from its end
    if not known.any():
        return None
    places, px_per_m = places[known], px_per_m[known]
    lengths = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))))
    return width_px / float(np.median(np.interp(np.linspace(0.0, lengths[-1], _SAMPLES), lengths, px_per_m)))


def _units(vectors: FloatArray) -> FloatArray:
    """Return vectors (n, d) of length one, or of length 0 where they have no direction."""
    units: FloatArray = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), np.finfo(float).tiny)
    return units


def _wave(curve: BSplineCurve, width: float | None) -> float:
    """Return the length of the shortest waves of a curve that are no noise."""
    return wave_of_knots(curve) if width is None else WIDTHS_PER_WAVE * width
