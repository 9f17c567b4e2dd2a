"""As published: each pixel of the centre line brings its depth (paper: extension to 3D)."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.config import PixelLiftingConfig
from dloftbs.data.depth import to_metres
from dloftbs.support.arrays import FloatArray

MIN_POINTS = 4
"""Points with depth that a curve in space needs."""


def lift_pixels(
    points: FloatArray, depth: npt.NDArray[Any], depth_unit_m: float, camera: PinholeCamera, config: PixelLiftingConfig
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Lift the pixels of a centre line into space: on to the surface of the object, as the depth image has it.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, 2)
        Pixel centres inside the depth image.
    depth : numpy.ndarray, shape (H, W)
        Metres where floating point, counts of `depth_unit_m` where integer.
    depth_unit_m : float
    camera : PinholeCamera
    config : PixelLiftingConfig

    Returns
    -------
    points_m : numpy.ndarray, shape (m, 3)
        Those with depth, in the camera's frame, metres.
    seen : numpy.ndarray, shape (n,), bool
        Points that have depth, as `to_metres` says; and a ray, which pixels
        beyond the field of the camera's lens model have not.
    """
    column, row = np.rint(points).astype(np.intp).T
    metres = to_metres(depth[row, column], depth_unit_m, config)
    seen = ~np.isnan(metres)
    points_m = camera.deproject(points[seen], metres[seen])
    known = np.isfinite(points_m).all(axis=1)  # not beyond the field of the lens model
    seen[seen] = known
    return points_m[known], seen


def holes_of(u: FloatArray, length_px: float, width_px: float) -> tuple[tuple[float, float], ...]:
    """Return the intervals of a curve's parameter between points with depth that are more than a width apart.

    Parameters
    ----------
    u : numpy.ndarray, shape (n,)
        Of the points with depth, ascending from 0 to 1.
    length_px, width_px : float
        Of the curve in the image.
    """
    (before,) = np.nonzero(np.diff(u) * length_px > width_px)
    return tuple((float(u[k]), float(u[k + 1])) for k in before)
