"""Cameras from ``sensor_msgs/CameraInfo``."""

from __future__ import annotations

from typing import Any

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.errors import InputError
from dloftbs.ros.message_fields import count_in, field_of, text_in
from dloftbs.support.arrays import as_float_array
from dloftbs.support.values import check_flag


def camera_of(message: Any, *, rectified: bool = False) -> PinholeCamera | None:
    """Return the camera that a message describes; None where it says that there is no calibration, by zeros.

    Parameters
    ----------
    message : sensor_msgs/CameraInfo
        Of ROS 1 or ROS 2, in the classes of any library.
    rectified : bool
        The images are rectified: their intrinsics are those of the matrix P, and their lens does not distort.

    Raises
    ------
    InputError
        If fields are missing or wrong, or the camera is not supported (see `PinholeCamera.from_calibration`): an
        unknown distortion model, skew, binning, or a region of interest that is not the whole image.
    """
    check_flag("rectified", rectified)
    k = _numbers(message, 9, "k", "K")
    if not k.any():
        return None
    values: dict[str, Any] = {"width": count_in(message, "width"), "height": count_in(message, "height")}
    for name in ("binning_x", "binning_y"):
        values[name] = count_in(message, name)
    values["roi"] = _region(message, values["width"], values["height"])
    if rectified:
        values["k"] = _numbers(message, 12, "p", "P").reshape(3, 4)[:, :3].ravel().tolist()
    else:
        values["k"] = k.tolist()
        values["d"] = as_float_array("d of a CameraInfo", field_of(message, "d", "D")).ravel().tolist()
        values["distortion_model"] = text_in(message, "distortion_model")
    return PinholeCamera.from_calibration(values)


def intrinsics_of(message: Any) -> tuple[float, float, float, float] | None:
    """Return ``(fx, fy, cx, cy)`` of the matrix K of a camera; None where it says that there is no calibration.

    Raises
    ------
    InputError
        If there is no such matrix.
    """
    k = _numbers(message, 9, "k", "K")
    return (float(k[0]), float(k[4]), float(k[2]), float(k[5])) if k.any() else None


def _numbers(message: Any, count: int, *names: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    values = as_float_array(f"{names[0]} of a CameraInfo", field_of(message, *names)).ravel()
    if values.size != count:
        raise InputError(f"{names[0]} of a CameraInfo must have {count} numbers, got {values.size}")
    return values


def _region(message: Any, width: int, height: int) -> dict[str, int]:
    """Return the region of interest; that of the whole image is none."""
    roi = field_of(message, "roi")
    region = {name: count_in(roi, name) for name in ("x_offset", "y_offset", "width", "height")}
    return {} if region == {"x_offset": 0, "y_offset": 0, "width": width, "height": height} else region
