"""The pinhole camera: from pixels and depth to metres, and back."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.errors import InputError


@dataclass(frozen=True)
class PinholeCamera:
    """Intrinsics of a camera without distortion; x to the right, y down, z forward.

    Parameters
    ----------
    fx, fy : float
        Focal lengths, px.
    cx, cy : float
        Principal point, px; the centre of the top left pixel is (0, 0).

    Raises
    ------
    InputError
        If a focal length is not positive or a value is not finite.
    """

    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        for name in ("fx", "fy", "cx", "cy"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not math.isfinite(value):
                raise InputError(f"{name} must be a finite number, got {value!r}")
            object.__setattr__(self, name, float(value))
        if self.fx <= 0 or self.fy <= 0:
            raise InputError(f"focal lengths must be positive, got fx={self.fx}, fy={self.fy}")

    @property
    def matrix(self) -> FloatArray:
        """The camera matrix K, shape (3, 3)."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def project(self, points_m: npt.ArrayLike) -> FloatArray:
        """Project points in the camera's frame to the image.

        Parameters
        ----------
        points_m : array_like, shape (..., 3)
            In metres; z must be positive.

        Returns
        -------
        numpy.ndarray, shape (..., 2)
            ``(x, y)`` px.

        Raises
        ------
        InputError
            If the last axis is not 3 or a point is not in front of the camera.
        """
        points = np.asarray(points_m, dtype=np.float64)
        if points.ndim < 1 or points.shape[-1] != 3:
            raise InputError(f"points_m must have shape (..., 3), got {points.shape}")
        z = points[..., 2]
        if not (z > 0).all():
            raise InputError("points_m must lie in front of the camera (z > 0)")
        return np.stack((self.fx * points[..., 0] / z + self.cx, self.fy * points[..., 1] / z + self.cy), axis=-1)

    def deproject(self, points_px: npt.ArrayLike, depth_m: npt.ArrayLike) -> FloatArray:
        """Lift pixels with known depth to points in the camera's frame.

        Parameters
        ----------
        points_px : array_like, shape (..., 2)
            ``(x, y)`` px.
        depth_m : array_like, shape (...)
            Depth along z, metres.

        Returns
        -------
        numpy.ndarray, shape (..., 3)
            In metres.

        Raises
        ------
        InputError
            If the shapes disagree.
        """
        points = np.asarray(points_px, dtype=np.float64)
        depth = np.asarray(depth_m, dtype=np.float64)
        if points.ndim < 1 or points.shape[-1] != 2:
            raise InputError(f"points_px must have shape (..., 2), got {points.shape}")
        if depth.shape != points.shape[:-1]:
            raise InputError(f"depth_m must have shape {points.shape[:-1]}, got {depth.shape}")
        x = (points[..., 0] - self.cx) / self.fx * depth
        y = (points[..., 1] - self.cy) / self.fy * depth
        return np.stack((x, y, depth), axis=-1)
