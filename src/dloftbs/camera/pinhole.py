"""The pinhole camera with a lens: from pixels and depth to metres, and back."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from dloftbs.camera.calibration_files import camera_values, read_camera
from dloftbs.camera.lens_models import LENS_MODELS, LensModel
from dloftbs.errors import InputError
from dloftbs.support.array_likes import as_array, is_array_like
from dloftbs.support.arrays import AnyArray, FloatArray, as_float_array, as_numbers
from dloftbs.support.values import check_number, check_path, check_size, shown

if TYPE_CHECKING:
    from dloftbs.camera.lens import Lens

COEFFICIENT_COUNTS = {"polynomial": (0, 4, 5, 8, 12, 14), "fisheye": (4,)}
"""Numbers of coefficients that each model may have, by its name."""

_SHORTEST_FOCAL_PX, _FARTHEST_PX = 1e-3, 1e7  # from images in units of their own to the longest lenses
_LARGEST_SKEW = 1e-6
"""Largest skew that is taken for rounding, focal lengths.

Source: numerics; a matrix that is a product of others is exact to 1e-12, and of a file with seven digits to 1e-7; over
ten thousand rows, so much skew moves a pixel by a hundredth.
"""
_LARGEST_ROUNDING = 1e-9
"""Largest error of the last row of a camera matrix that is taken for rounding.

Source: numerics; as above, and it is 0, 0, 1 in files.
"""
_LARGEST_COEFFICIENT = 1e6  # calibrations of long lenses have some thousands
_MAX_TILT = 1.5  # rad; at a right angle, a tilted sensor sees nothing

_KEYS = ("fx", "fy", "cx", "cy")


@dataclass(frozen=True)
class PinholeCamera:
    """Intrinsics of a camera; x to the right, y down, z forward. Skew is not supported.

    Parameters
    ----------
    fx, fy : float
        Focal lengths, px.
    cx, cy : float
        Principal point, px; the centre of the top left pixel is (0, 0).
    distortion : sequence of float
        Coefficients of the lens in OpenCV's order. Images that were undistorted already need none. All zeros of the
        polynomial are no distortion, and are kept as none.
    model : {"polynomial", "fisheye"}
        "polynomial" is that of `cv2.calibrateCamera` with 4, 5, 8, 12 or 14 coefficients ``k1 k2 p1 p2 [k3 [k4 k5 k6
        [s1 s2 s3 s4 [tx ty]]]]`` (ROS: plumb_bob and rational_polynomial; Kalibr: radtan); "fisheye" is that of
        `cv2.fisheye` with 4 (equidistant, Kannala and Brandt).
    size : (int, int), optional
        ``(H, W)`` of the images that the intrinsics hold for; frames of another size are then refused.

    Raises
    ------
    InputError
        If a value is no number or none that a camera has (focal lengths of 0.001 to 1e7 px, principal points up to as
        far, coefficients up to 1e6), the model is unknown or the coefficients are not as many as it has.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    model: LensModel = "polynomial"
    size: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        for name in _KEYS:
            object.__setattr__(self, name, check_number(name, getattr(self, name), -_FARTHEST_PX, _FARTHEST_PX))
        if min(self.fx, self.fy) < _SHORTEST_FOCAL_PX:
            raise InputError(
                f"focal lengths must be positive, got fx={self.fx}, fy={self.fy}; {_SHORTEST_FOCAL_PX} px at least"
            )
        if not isinstance(self.model, str) or self.model not in LENS_MODELS:
            raise InputError(f"model must be one of {', '.join(LENS_MODELS)}, got {shown(self.model)}")
        object.__setattr__(self, "distortion", _coefficients(self.distortion, self.model))
        if self.size is not None:
            object.__setattr__(self, "size", check_size("size", self.size))

    @classmethod
    def from_matrix(
        cls,
        matrix: npt.ArrayLike,
        distortion: Iterable[float] = (),
        model: LensModel = "polynomial",
        size: tuple[int, int] | None = None,
    ) -> PinholeCamera:
        """Build a camera from its matrix K, shape (3, 3), as OpenCV's calibration returns it.

        Raises
        ------
        InputError
            If the matrix has another shape or form, or skew, by more than rounding; and as the constructor.
        """
        k = as_float_array("a camera matrix", matrix)
        if k.shape != (3, 3):
            raise InputError(f"a camera matrix must have shape (3, 3), got {k.shape}")
        largest_skew = _LARGEST_SKEW * abs(k[0, 0])
        if abs(k[0, 1]) > largest_skew:
            raise InputError(f"a camera with skew is not supported: K[0, 1] must be 0, got {k[0, 1]}")
        if abs(k[1, 0]) > largest_skew or (np.abs(k[2] - (0.0, 0.0, 1.0)) > _LARGEST_ROUNDING).any():
            raise InputError(f"a camera matrix must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], got {k.tolist()}")
        return cls(k[0, 0], k[1, 1], k[0, 2], k[1, 2], distortion, model, size)  # type: ignore[arg-type]  # any sequence

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> PinholeCamera:
        """Build a camera from what `to_dict` returns; `distortion`, `model` and `size` may be left out.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or unknown; and as the constructor.
        """
        if not isinstance(data, Mapping):
            raise InputError(f"a camera needs a dictionary as of to_dict, got {shown(data)}")
        missing = [key for key in _KEYS if key not in data]
        if missing:
            raise InputError(f"a camera needs fx, fy, cx and cy; missing: {', '.join(missing)}")
        unknown = [str(key) for key in data if key not in (*_KEYS, "distortion", "model", "size")]
        if unknown:
            raise InputError(f"a camera has fx, fy, cx, cy, distortion, model and size; unknown: {', '.join(unknown)}")
        return cls(**data)

    @classmethod
    def from_file(cls, path: str | Path) -> PinholeCamera:
        """Read a camera from YAML, JSON or XML as calibrators write it.

        Understood are ROS's camera_info (as camera_calibration saves it, and as a message dumped to YAML or JSON),
        OpenCV's FileStorage, Kalibr's camchain of one camera, Open3D's and RealSense's JSON, and the keys of `to_dict`.

        Raises
        ------
        InputError
            If it is no path.
        SourceError
            If the file cannot be read, is none of these, or describes a camera that is not supported.
        """
        return read_camera(check_path("path", path), cls._from_values)

    @classmethod
    def from_calibration(cls, keys: Mapping[str, Any]) -> PinholeCamera:
        """Build a camera from the keys and values that a file of `from_file` would hold, as of a ROS message.

        Raises
        ------
        InputError
            If it is no mapping, no such file would hold it, or it describes a camera that is not supported.
        """
        if not isinstance(keys, Mapping):
            raise InputError(f"a calibration needs a mapping of keys to values, got {shown(keys)}")
        return cls._from_values(camera_values(keys))

    @classmethod
    def _from_values(cls, values: dict[str, Any]) -> PinholeCamera:
        """Build a camera from the arguments of `from_matrix`, or from the keys of `to_dict`."""
        return cls.from_matrix(**values) if "matrix" in values else cls.from_dict(values)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON, which `from_dict` takes back."""
        values: dict[str, Any] = {name: getattr(self, name) for name in _KEYS}
        size = None if self.size is None else list(self.size)
        return {**values, "distortion": list(self.distortion), "model": self.model, "size": size}

    @property
    def matrix(self) -> FloatArray:
        """The camera matrix K, shape (3, 3)."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @cached_property
    def lens(self) -> Lens:
        """The distortion in the form that computations take."""
        from dloftbs.camera.lens import make_lens

        return make_lens(self.model, self.distortion)

    def scaled(self, size: tuple[int, int]) -> PinholeCamera:
        """Return the camera for its images after they are resized as a whole.

        Parameters
        ----------
        size : (int, int)
            ``(H, W)`` of the resized images.

        Raises
        ------
        InputError
            If the camera does not know the size that its images have, or `size` is no size.
        """
        if self.size is None:
            raise InputError("a camera can be scaled only if it has a size: PinholeCamera(..., size=(H, W))")
        rows, columns = check_size("size", size)
        y, x = rows / self.size[0], columns / self.size[1]
        # Pixel centres are at integers, so that the image begins half a pixel before 0.
        cx, cy = (self.cx + 0.5) * x - 0.5, (self.cy + 0.5) * y - 0.5
        return replace(self, fx=self.fx * x, fy=self.fy * y, cx=cx, cy=cy, size=(rows, columns))

    def check_size(self, size: tuple[int, int]) -> None:
        """Check that images of this size ``(H, W)`` are what the intrinsics hold for.

        Raises
        ------
        InputError
            If the camera has another size; one without a size takes all.
        """
        if self.size is not None and self.size != size:
            raise InputError(
                f"the camera is for images of size {self.size} (rows, columns), got one of {size}; "
                f"{_size_remedy(self.size, size)}"
            )

    def project(self, points_m: npt.ArrayLike) -> FloatArray:
        """Project points in the camera's frame to the image, distortion included.

        Parameters
        ----------
        points_m : array_like, shape (..., 3)
            In metres; z must be positive.

        Returns
        -------
        numpy.ndarray, shape (..., 2)
            ``(x, y)`` px; NaN for points outside of the field in which the lens's distortion can be inverted: beyond
            it, the formulas fold the image back.

        Raises
        ------
        InputError
            If the last axis is not 3 or a point is not in front of the camera.
        """
        points = as_numbers("points_m", points_m)
        if points.ndim < 1 or points.shape[-1] != 3:
            raise InputError(f"points_m must have shape (..., 3), got {points.shape}")
        if not (points[..., 2] > 0).all():
            raise InputError("points_m must lie in front of the camera (z > 0)")
        return self._project(points)

    def _project(self, points: FloatArray) -> FloatArray:
        """Return the same as `project` of points that are known to lie in front of the camera."""
        z = points[..., 2]
        if not self.distortion:
            pixels: FloatArray = np.empty((*z.shape, 2))
            pixels[..., 0] = self.fx * points[..., 0] / z + self.cx
            pixels[..., 1] = self.fy * points[..., 1] / z + self.cy
            return pixels
        return self.lens.distorted(points[..., :2] / z[..., None]) * (self.fx, self.fy) + (self.cx, self.cy)

    def deproject(self, points_px: npt.ArrayLike, depth_m: npt.ArrayLike) -> FloatArray:
        """Lift pixels with known depth to points in the camera's frame; distortion is undone.

        Parameters
        ----------
        points_px : array_like, shape (..., 2)
            ``(x, y)`` px.
        depth_m : array_like, shape (...)
            Depth along z, metres.

        Returns
        -------
        numpy.ndarray, shape (..., 3)
            In metres; x and y are NaN for pixels outside of the field in which the lens's distortion can be inverted.

        Raises
        ------
        InputError
            If the shapes disagree.
        """
        points = as_numbers("points_px", points_px)
        depth = as_numbers("depth_m", depth_m)
        if points.ndim < 1 or points.shape[-1] != 2:
            raise InputError(f"points_px must have shape (..., 2), got {points.shape}")
        if depth.shape != points.shape[:-1]:
            raise InputError(f"depth_m must have shape {points.shape[:-1]}, got {depth.shape}")
        x = (points[..., 0] - self.cx) / self.fx
        y = (points[..., 1] - self.cy) / self.fy
        if self.distortion:
            rays = self.lens.undistorted(np.stack((x, y), axis=-1))
            x, y = rays[..., 0], rays[..., 1]
        return np.stack((x * depth, y * depth, depth), axis=-1)


CameraLike = PinholeCamera | str | os.PathLike[str] | Mapping[str, Any] | npt.ArrayLike
"""Cameras as users have them: the path of a calibration, what `to_dict` returns, K (3, 3), or (fx, fy, cx, cy)."""


def as_camera(given: CameraLike) -> PinholeCamera:
    """Return a camera as it is, and make one of its matrix, of its four numbers, or of its file.

    Raises
    ------
    InputError
        If it is something else, or no camera has these values.
    SourceError
        If the file cannot be read, or holds no camera.
    """
    if isinstance(given, PinholeCamera):
        return given
    if isinstance(given, (str, os.PathLike)):
        return PinholeCamera.from_file(Path(os.path.expanduser(os.fsdecode(given))))
    if isinstance(given, Mapping):
        return PinholeCamera.from_dict(given)
    matrix = _numbers(given)
    if matrix is None:
        raise InputError(
            "camera must be a PinholeCamera, its matrix K (3, 3), (fx, fy, cx, cy) or the path of a calibration, got "
            f"{shown(given)}; with a lens it is PinholeCamera.from_matrix(K, distortion)"
        )
    return PinholeCamera(*matrix.tolist()) if matrix.size == 4 else PinholeCamera.from_matrix(matrix.reshape(3, 3))


def _numbers(given: object) -> AnyArray | None:
    """Return the four numbers or the nine of a matrix; None for all else, such as a matrix and a lens together."""
    if not is_array_like(given) and not isinstance(given, (list, tuple)):
        return None
    try:
        array = as_array("camera", given)
    except InputError:
        return None
    return array if array.dtype.kind in "fiu" and array.shape in ((4,), (9,), (3, 3)) else None


def _size_remedy(own: tuple[int, int], size: tuple[int, int]) -> str:
    """Say what makes a camera suit images of another size, by the sides' ratios."""
    if _alike(own, size):
        return f"if it was resized as a whole, use camera.scaled({size})"
    if _alike(own[::-1], size):
        return (
            "its sides are swapped: either it or the pictures of the calibration were turned by 90 degrees, as "
            "cv2.imread does where the EXIF orientation says so; read both as stored (cv2.IMREAD_IGNORE_ORIENTATION)"
        )
    return "if it was cropped, its camera has cx and cy less by what was cut off on the left and at the top"


def _alike(own: tuple[int, int], size: tuple[int, int]) -> bool:
    """Return whether a size is another one times a factor, up to a pixel of rounding."""
    return abs(own[0] * size[1] - own[1] * size[0]) <= max(own)


def _coefficients(values: Any, model: str) -> tuple[float, ...]:
    if isinstance(values, Iterable) and not isinstance(values, (np.ndarray, str, Mapping)):
        values = list(values)
    given = as_array("distortion", values).ravel().tolist()
    coefficients = tuple(
        check_number("distortion", value, -_LARGEST_COEFFICIENT, _LARGEST_COEFFICIENT) for value in given
    )
    counts = COEFFICIENT_COUNTS[model]
    if len(coefficients) not in counts:
        wanted = " or ".join(str(count) for count in counts)
        raise InputError(f"the {model} model has {wanted} distortion coefficients, got {len(coefficients)}")
    for angle in coefficients[12:]:
        check_number("the tilt of the sensor", angle, -_MAX_TILT, _MAX_TILT)
    return coefficients if model == "fisheye" or any(coefficients) else ()
