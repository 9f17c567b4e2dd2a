"""The lens of a camera: distortion of rays, and its inverse, in normalised image coordinates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dloftbs.camera.kernels.lens_projection import FISHEYE, NO_LENS, POLYNOMIAL, distort, undistort
from dloftbs.support.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Lens:
    """Parameters of a lens as the kernels take them.

    Parameters
    ----------
    model : int
        `NO_LENS`, `POLYNOMIAL` or `FISHEYE`.
    coefficients : numpy.ndarray, shape (12,)
    tilt, untilt : numpy.ndarray, shape (3, 3)
        Homography of a tilted sensor, and its inverse.
    field : float
        Limit of the field in which distortion can be inverted: a squared radius, an angle for the fisheye.
    """

    model: int
    coefficients: FloatArray
    tilt: FloatArray
    untilt: FloatArray
    field: float

    def distorted(self, points: FloatArray) -> FloatArray:
        """Distort rays (..., 2); NaN outside of the field."""
        flat = np.ascontiguousarray(points.reshape(-1, 2))
        out = np.empty_like(flat)
        distort(flat, self.model, self.coefficients, self.tilt, self.field, out)
        return out.reshape(points.shape)

    def undistorted(self, points: FloatArray) -> FloatArray:
        """Return the rays (..., 2) that `distorted` takes to these points; NaN where there are none."""
        flat = np.ascontiguousarray(points.reshape(-1, 2))
        out = np.empty_like(flat)
        undistort(flat, self.model, self.coefficients, self.untilt, self.field, out)
        return out.reshape(points.shape)


def make_lens(model: str, distortion: Sequence[float]) -> Lens:
    """Return the lens of a `PinholeCamera` by its model and coefficients, which are valid."""
    coefficients = np.zeros(12)
    known = np.asarray(distortion, dtype=np.float64)[:12]
    coefficients[: len(known)] = known
    if not len(distortion):
        return Lens(NO_LENS, coefficients, np.eye(3), np.eye(3), math.inf)
    if model == "fisheye":
        return Lens(FISHEYE, coefficients, np.eye(3), np.eye(3), _widest_angle(coefficients))
    tilt: FloatArray = _tilt(*distortion[12:]) if len(distortion) > 12 else np.eye(3)
    return Lens(
        POLYNOMIAL,
        coefficients,
        tilt,
        np.ascontiguousarray(np.linalg.inv(tilt), dtype=np.float64),
        _widest_squared_radius(coefficients),
    )


def _widest_squared_radius(k: FloatArray) -> float:
    """Return where the radial distortion stops to grow with the radius, or has a pole."""
    s = np.polynomial.Polynomial([0.0, 1.0])
    numerator = np.polynomial.Polynomial([1.0, k[0], k[1], k[4]])
    denominator = np.polynomial.Polynomial([1.0, k[5], k[6], k[7]])
    # The derivative of r n(r^2) / d(r^2) by r, times d^2.
    slope = (numerator + 2 * s * numerator.deriv()) * denominator - 2 * s * numerator * denominator.deriv()
    return min(_first_positive_root(slope), _first_positive_root(denominator))


def _widest_angle(k: FloatArray) -> float:
    """Return the angle from the axis where distortion stops to grow, a right angle at most."""
    slope = np.polynomial.Polynomial([1.0, 3 * k[0], 5 * k[1], 7 * k[2], 9 * k[3]])
    return min(math.pi / 2, math.sqrt(_first_positive_root(slope)))


def _first_positive_root(polynomial: np.polynomial.Polynomial) -> float:
    roots = polynomial.trim(1e-12).roots()  # less says nothing within any image
    real = roots.real[(np.abs(roots.imag) <= 1e-9 * np.abs(roots)) & (roots.real > 0.0)]
    return float(real.min(initial=math.inf))


def _tilt(about_x: float, about_y: float) -> FloatArray:
    """Return the homography of a sensor tilted by two angles, as OpenCV's documentation of the camera has it."""
    cx, sx, cy, sy = math.cos(about_x), math.sin(about_x), math.cos(about_y), math.sin(about_y)
    turn_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, sx], [0.0, -sx, cx]])
    turn_y = np.array([[cy, 0.0, -sy], [0.0, 1.0, 0.0], [sy, 0.0, cy]])
    turn = turn_y @ turn_x
    onto = np.array([[turn[2, 2], 0.0, -turn[0, 2]], [0.0, turn[2, 2], -turn[1, 2]], [0.0, 0.0, 1.0]])
    return np.ascontiguousarray(onto @ turn)
