"""Depth of one camera, brought into the pixels of another."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.camera.calibration_files import read_registration
from dloftbs.camera.pinhole import PinholeCamera
from dloftbs.camera.poses import is_rotation
from dloftbs.errors import InputError
from dloftbs.support.array_likes import as_array
from dloftbs.support.arrays import AnyArray, FloatArray, as_vector, check_depth
from dloftbs.support.values import DEPTH_UNITS_M, MILLIMETRE_M, abridged, check_number, check_path, check_size


@dataclass(frozen=True, repr=False)
class DepthRegistration:
    """Pose of a depth camera beside a colour camera, to bring its depth into the pixels of the colour image.

    Parameters
    ----------
    depth_camera, colour_camera : PinholeCamera
        Both with their lenses.
    rotation : array_like, shape (3, 3)
    translation_m : array_like, shape (3,)
        ``p_colour = rotation @ p_depth + translation_m``, with the axes of both cameras x right, y down, z forward.
        Both are held as tuples.
    depth_unit_m : float
        Metres per count of an integer depth image, as in `Frame`. Floating-point depth is in metres.

    Raises
    ------
    InputError
        If a value is of a wrong type or shape, or the rotation is none.
    """

    depth_camera: PinholeCamera
    colour_camera: PinholeCamera
    rotation: npt.ArrayLike
    translation_m: npt.ArrayLike
    depth_unit_m: float = MILLIMETRE_M

    def __post_init__(self) -> None:
        for name in ("depth_camera", "colour_camera"):
            if not isinstance(getattr(self, name), PinholeCamera):
                raise InputError(f"{name} must be a PinholeCamera, got {getattr(self, name)!r}")
        rotation = as_array("rotation", self.rotation)
        if rotation.shape != (3, 3):
            raise InputError(f"rotation must have shape (3, 3), got {rotation.shape}")
        r = as_vector("rotation", rotation.ravel(), 9).reshape(3, 3)
        if not is_rotation(r):
            raise InputError(f"rotation must be a rotation, R R^T = 1 and det R = 1, got {r.tolist()}")
        object.__setattr__(self, "depth_unit_m", check_number("depth_unit_m", self.depth_unit_m, *DEPTH_UNITS_M))
        object.__setattr__(self, "rotation", tuple(tuple(row) for row in r.tolist()))
        object.__setattr__(self, "translation_m", tuple(as_vector("translation_m", self.translation_m, 3).tolist()))

    def __repr__(self) -> str:
        cameras = f"depth_camera={self.depth_camera!r}, colour_camera={self.colour_camera!r}"
        return abridged(f"DepthRegistration(translation_m={self.translation_m!r}, {cameras})")

    @classmethod
    def from_file(cls, path: str | Path, depth_unit_m: float | None = None) -> DepthRegistration:
        """Read a registration from YAML or JSON.

        Either with the keys `depth_camera` and `colour_camera`, each a camera in any form that
        `PinholeCamera.from_file` takes, `rotation` (3, 3) and `translation_m` (3,); or Kalibr's camchain with the depth
        camera as cam0 and the colour camera as cam1. Both may have `depth_unit_m`, by default 0.001.

        Parameters
        ----------
        path : str or Path
        depth_unit_m : float, optional
            Metres per count of an integer depth image, in place of what the file says.

        Raises
        ------
        InputError
            If it is no path, or the unit is out of range.
        SourceError
            If the file cannot be read or says something else.
        """
        registration = read_registration(check_path("path", path), PinholeCamera._from_values, cls)
        return registration if depth_unit_m is None else replace(registration, depth_unit_m=depth_unit_m)

    def register(self, depth: npt.ArrayLike, size: tuple[int, int] | None = None) -> AnyArray:
        """Return depth as the colour camera sees it.

        Each depth pixel covers the footprint that it has in the colour image, where the nearest surface wins. What the
        depth camera did not see is 0, missing.

        Parameters
        ----------
        depth : array_like, shape (h, w) or (h, w, 1)
            Of the depth camera: metres where floating point, counts of `depth_unit_m` where integer; 0, negative
            values, NaN and infinity are missing.
        size : (int, int), optional
            ``(H, W)`` of the colour image; by default the one that the colour camera states.

        Returns
        -------
        numpy.ndarray, shape (H, W)
            Along z of the colour camera, in the type and the unit of `depth`.

        Raises
        ------
        InputError
            If the depth has a wrong shape or type or is not of the depth camera's size, or the size of the colour image
            is unknown or not that of the colour camera.
        """
        from dloftbs.camera.kernels.lens_projection import splat_depth

        counts = check_depth(depth)
        self.depth_camera.check_size(counts.shape)
        size = self.colour_camera.size if size is None else check_size("size", size)
        if size is None:
            raise InputError("the colour camera has no size: register(depth, size) needs the colour image's (H, W)")
        self.colour_camera.check_size(size)
        whole = np.issubdtype(counts.dtype, np.integer)
        unit_m = np.float32(self.depth_unit_m if whole else 1.0)
        with np.errstate(over="ignore"):  # what float32 cannot hold is infinity, missing
            metres = np.multiply(counts, unit_m, dtype=np.float32, order="C", casting="unsafe").ravel()
        colour = self.colour_camera
        lens = colour.lens
        intrinsics = np.array([colour.fx, colour.fy, colour.cx, colour.cy])
        seen = np.full(size, np.inf, dtype=np.float32)
        splat_depth(
            metres, _table(self, counts.shape), np.array(self.translation_m), intrinsics,
            lens.model, lens.coefficients, lens.tilt, lens.field, seen,
        )  # fmt: skip
        return _in_units(seen, counts.dtype, self.depth_unit_m)


def _in_units(metres: npt.NDArray[np.float32], dtype: np.dtype[Any], unit_m: float) -> AnyArray:
    """Return metres in another type and unit; infinity, and what the type cannot hold, become 0."""
    if not np.issubdtype(dtype, np.integer):
        metres[np.isinf(metres)] = 0.0
        return metres.astype(dtype, copy=False)
    metres *= np.float32(1.0 / unit_m)
    counts = np.rint(metres, out=metres)
    counts[counts >= np.iinfo(dtype).max + 1.0] = 0.0
    return counts.astype(dtype)


@lru_cache(maxsize=4)
def _table(registration: DepthRegistration, size: tuple[int, int]) -> npt.NDArray[np.float32]:
    """Return the rays and footprints of all depth pixels, as `splat_depth` takes them."""
    rows, columns = size
    rays = _turned_rays(registration, columns, rows, 0.0)
    corners = _turned_rays(registration, columns + 1, rows + 1, -0.5)
    at = _seen_far_off(registration.colour_camera, corners)
    around = np.stack((at[:-1, :-1], at[:-1, 1:], at[1:, :-1], at[1:, 1:]))
    # At the edge of a lens's field some corners are outside of it, which is NaN.
    half = np.nan_to_num(0.5 * (np.fmax.reduce(around) - np.fmin.reduce(around)))
    return np.ascontiguousarray(np.concatenate((rays, half), axis=-1).reshape(-1, 5), dtype=np.float32)


def _turned_rays(registration: DepthRegistration, columns: int, rows: int, first: float) -> FloatArray:
    """Return the rays (rows, columns, 3) through a grid of depth pixels, in the colour camera's directions."""
    pixels = np.stack(np.meshgrid(first + np.arange(columns), first + np.arange(rows)), axis=-1)
    rays = registration.depth_camera.deproject(pixels, np.ones(pixels.shape[:-1]))
    return rays @ np.array(registration.rotation).T


def _seen_far_off(camera: PinholeCamera, rays: FloatArray) -> FloatArray:
    """Return where the camera sees what lies far off on rays (..., 3); NaN where it does not."""
    ahead = rays[..., 2] > 0.0  # False for NaN too
    pixels = np.full((*rays.shape[:-1], 2), np.nan)
    pixels[ahead] = camera.project(rays[ahead])
    return pixels
