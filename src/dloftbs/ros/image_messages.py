"""Pixels of ``sensor_msgs/Image`` and ``sensor_msgs/CompressedImage``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dloftbs._arrays import AnyArray
from dloftbs._values import shown
from dloftbs.errors import InputError, SourceError
from dloftbs.ros.compressed_depth import decode_compressed_depth
from dloftbs.ros.message_fields import bytes_in, count_in, text_in
from dloftbs.sources.image_header import is_lossy
from dloftbs.sources.pixels import check_pixels, decode


@dataclass(frozen=True)
class _Layout:
    """Layout of a pixel in a message, and the name of OpenCV's conversion to BGR where there is one."""

    dtype: str
    channels: int = 1
    conversion: str | None = None
    even_width: bool = False


_BAYER = {"rggb": "BG", "bggr": "RG", "gbrg": "GR", "grbg": "GB"}
"""OpenCV's name for each pattern: it names the second row's second and third pixel, ROS the first row's first two."""

ENCODINGS: dict[str, _Layout] = {
    **dict.fromkeys(("bgr8", "8uc3"), _Layout("u1", 3)),
    "rgb8": _Layout("u1", 3, "COLOR_RGB2BGR"),
    **dict.fromkeys(("bgra8", "8uc4"), _Layout("u1", 4, "COLOR_BGRA2BGR")),
    "rgba8": _Layout("u1", 4, "COLOR_RGBA2BGR"),
    **dict.fromkeys(("mono8", "8uc1"), _Layout("u1")),
    **dict.fromkeys(("mono16", "16uc1"), _Layout("u2")),
    "16sc1": _Layout("i2"),
    "32sc1": _Layout("i4"),
    "32fc1": _Layout("f4"),
    "64fc1": _Layout("f8"),
    **{f"bayer_{ros}8": _Layout("u1", 1, f"COLOR_Bayer{name}2BGR") for ros, name in _BAYER.items()},
    **dict.fromkeys(("uyvy", "yuv422"), _Layout("u1", 2, "COLOR_YUV2BGR_UYVY", even_width=True)),
    **dict.fromkeys(("yuyv", "yuv422_yuy2"), _Layout("u1", 2, "COLOR_YUV2BGR_YUY2", even_width=True)),
}
"""Layouts by the encoding's name in lower case."""

_LEAST_BAYER = 3
"""Pixels of a side from which on a pattern of colours can be interpolated."""


def pixels_of(message: Any) -> AnyArray:
    """Return the pixels of an image message, compressed or not.

    Parameters
    ----------
    message : sensor_msgs/Image or sensor_msgs/CompressedImage
        Of any library: rosbags, rclpy or whatever else has their fields.

    Returns
    -------
    numpy.ndarray, shape (H, W, 3), uint8, or (H, W)
        Colour is BGR. Grey, masks and depth have one channel, in the type of their encoding. A view of the message
        where nothing had to be converted.

    Raises
    ------
    InputError
        If fields are missing or disagree, the encoding is unknown, or compressed pixels cannot be decoded.
    """
    if hasattr(message, "format"):
        return _decompressed(message)
    encoding = text_in(message, "encoding")
    layout = ENCODINGS.get(encoding.lower())
    if layout is None:
        raise InputError(f"unknown encoding {shown(encoding)} of an image; known are {', '.join(ENCODINGS)}")
    pixels = _rows_of(message, layout, encoding)
    return pixels if layout.conversion is None else _converted(pixels, layout.conversion)


def is_from_lossy_codec(message: Any) -> bool:
    """Return True for a compressed image whose codec rings around edges: in masks, cable then begins at half.

    Raises
    ------
    InputError
        If the message has no data.
    """
    return hasattr(message, "format") and is_lossy(bytes_in(message).tobytes())


def _rows_of(message: Any, layout: _Layout, encoding: str) -> AnyArray:
    """Return the pixels (H, W) or (H, W, channels) of a raw image in this machine's byte order, without padding."""
    height, width, step = (count_in(message, name) for name in ("height", "width", "step"))
    data = bytes_in(message)
    dtype = np.dtype(layout.dtype)
    row = width * layout.channels * dtype.itemsize
    if not (height and width):
        raise InputError(f"an image must have pixels, got {width} x {height}")
    _check_size(height, width)
    if step < row or data.size != step * height:
        raise InputError(
            f"{width} x {height} pixels of {encoding} need a step of at least {row} bytes and step x height of data, "
            f"got step {step} and {data.size} bytes"
        )
    if layout.even_width and width % 2:
        raise InputError(f"pixels of {encoding} come in pairs, got a width of {width}")
    if layout.conversion and "Bayer" in layout.conversion and min(height, width) < _LEAST_BAYER:
        raise InputError(f"{encoding} needs at least {_LEAST_BAYER} x {_LEAST_BAYER} pixels, got {width} x {height}")
    rows = data.reshape(height, step)[:, :row]
    if dtype.itemsize > 1:
        own = dtype.newbyteorder(">") if count_in(message, "is_bigendian") else dtype.newbyteorder("<")
        rows = np.ascontiguousarray(rows).view(own).astype(dtype, copy=False)
    return np.ascontiguousarray(rows.reshape(height, width, layout.channels) if layout.channels > 1 else rows)


def _converted(pixels: AnyArray, conversion: str) -> AnyArray:
    import cv2

    return np.asarray(cv2.cvtColor(pixels, getattr(cv2, conversion)))


def _decompressed(message: Any) -> AnyArray:
    form = text_in(message, "format").lower()
    data = bytes_in(message).tobytes()
    if "compresseddepth" in form:
        return decode_compressed_depth(form, data)
    try:
        pixels = decode(data)
    except SourceError as error:
        raise InputError(f"a compressed image ({shown(form)}) {error}") from error
    # The transport says in which order it handed the channels to the codec, which takes them for BGR.
    return pixels[..., ::-1].copy() if pixels.ndim == 3 and "compressed rgb" in form else pixels


def _check_size(height: int, width: int) -> None:
    try:
        check_pixels(height, width)
    except SourceError as error:
        raise InputError(f"an image {error}") from error
