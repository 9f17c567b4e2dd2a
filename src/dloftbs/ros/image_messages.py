"""Pixels of ``sensor_msgs/Image`` and ``sensor_msgs/CompressedImage``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dloftbs.errors import InputError, SourceError
from dloftbs.ros.compressed_depth import decode_compressed_depth
from dloftbs.ros.message_fields import bytes_in, count_in, text_in
from dloftbs.sources.image_header import is_lossy
from dloftbs.sources.pixels import check_pixels, decode
from dloftbs.support.arrays import AnyArray, ByteArray
from dloftbs.support.values import shown


@dataclass(frozen=True)
class _Layout:
    """Layout of the pixels in a message, and the name of OpenCV's conversion to BGR where there is one.

    `half_rows` is the number of rows of bytes for two rows of pixels: more than 2 where planes of chroma follow.
    """

    dtype: str
    channels: int = 1
    conversion: str | None = None
    even_width: bool = False
    half_rows: int = 2

    @property
    def is_colour(self) -> bool:
        """True if the pixels become BGR."""
        return self.channels > 1 or self.conversion is not None


_FULL_CHROMA = 6
"""Half rows of a plane of luma and one with the two chroma values of each pixel."""
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
    **dict.fromkeys(("bgr16", "16uc3"), _Layout("u2", 3)),
    "rgb16": _Layout("u2", 3, "COLOR_RGB2BGR"),
    **dict.fromkeys(("bgra16", "16uc4"), _Layout("u2", 4, "COLOR_BGRA2BGR")),
    "rgba16": _Layout("u2", 4, "COLOR_RGBA2BGR"),
    **{
        f"bayer_{ros}{8 * size}": _Layout(f"u{size}", 1, f"COLOR_Bayer{name}2BGR")
        for ros, name in _BAYER.items()
        for size in (1, 2)
    },
    **dict.fromkeys(("uyvy", "yuv422"), _Layout("u1", 2, "COLOR_YUV2BGR_UYVY", even_width=True)),
    **dict.fromkeys(("yuyv", "yuv422_yuy2"), _Layout("u1", 2, "COLOR_YUV2BGR_YUY2", even_width=True)),
    "nv12": _Layout("u1", 1, "COLOR_YUV2BGR_NV12", even_width=True, half_rows=3),
    "nv21": _Layout("u1", 1, "COLOR_YUV2BGR_NV21", even_width=True, half_rows=3),
    "nv24": _Layout("u1", 1, "COLOR_YUV2BGR_UYVY", half_rows=_FULL_CHROMA),
}
"""Layouts by the encoding's name in lower case."""

_MIN_BAYER = 3
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
        Colour is BGR; of colour with 16 bits a channel, the upper 8. Grey, masks and depth have one channel, in the
        type of their encoding. A view of the message where nothing had to be converted.

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
    pixels = _in_bgr(_rows_of(message, layout, encoding), layout)
    return np.ascontiguousarray(pixels[:, ::2]) if layout.half_rows == _FULL_CHROMA else pixels


def upper_bits(pixels: AnyArray) -> AnyArray:
    """Return pixels of 16 bits a channel by their upper 8, and others as they are."""
    return (pixels >> 8).astype(np.uint8) if pixels.dtype == np.uint16 else pixels


def is_from_lossy_codec(message: Any) -> bool:
    """Return True for a compressed image whose codec rings around edges: in masks, cable then begins at half.

    Raises
    ------
    InputError
        If the message has no data.
    """
    return hasattr(message, "format") and is_lossy(bytes_in(message).tobytes())


def _rows_of(message: Any, layout: _Layout, encoding: str) -> AnyArray:
    """Return the pixels of a raw image in this machine's byte order, without padding.

    They are (H, W) or (H, W, channels); where planes of chroma follow, they are below: (half_rows * H / 2, W), or for
    chroma of each pixel, U Y V Y (H, 2 W, 2).
    """
    height, width, step = (count_in(message, name) for name in ("height", "width", "step"))
    data = bytes_in(message)
    dtype = np.dtype(layout.dtype)
    row = width * layout.channels * dtype.itemsize
    if not (height and width):
        raise InputError(f"an image must have pixels, got {width} x {height}")
    _check_size(height, width)
    _check_shape(layout, encoding, height, width)
    rows = height * layout.half_rows // 2
    if layout.half_rows > 2 and data.size == row * rows:
        step = row  # drivers count chroma in the step, too, or not
    if step < row or data.size != step * rows:
        raise InputError(
            f"{width} x {height} pixels of {encoding} need a step of at least {row} bytes and step x {rows} of data, "
            f"got step {step} and {data.size} bytes"
        )
    if layout.half_rows == _FULL_CHROMA:
        return _with_chroma(data, height, width, step)
    packed = data.reshape(rows, step)[:, :row]
    if dtype.itemsize > 1:
        own = dtype.newbyteorder(">") if count_in(message, "is_bigendian") else dtype.newbyteorder("<")
        packed = np.ascontiguousarray(packed).view(own).astype(dtype, copy=False)
    return np.ascontiguousarray(packed.reshape(height, width, layout.channels) if layout.channels > 1 else packed)


def _check_shape(layout: _Layout, encoding: str, height: int, width: int) -> None:
    """Refuse a size that the subsampled chroma or the pattern of an encoding does not allow."""
    if layout.even_width and width % 2:
        raise InputError(f"pixels of {encoding} come in pairs, got a width of {width}")
    if height * layout.half_rows % 2:
        raise InputError(f"rows of {encoding} come in pairs, got a height of {height}")
    if layout.conversion and "Bayer" in layout.conversion and min(height, width) < _MIN_BAYER:
        raise InputError(f"{encoding} needs at least {_MIN_BAYER} x {_MIN_BAYER} pixels, got {width} x {height}")


def _with_chroma(data: ByteArray, height: int, width: int, step: int) -> AnyArray:
    """Return U Y V Y (H, 2 W, 2) of a plane of luma and one of the chroma of each pixel: each pixel twice."""
    split = height * step
    chroma = data[split:].reshape(height, 2 * step)[:, : 2 * width].reshape(height, width, 2)
    pairs = np.empty((height, width, 2, 2), np.uint8)
    pairs[..., 0] = chroma
    pairs[..., 1] = data[:split].reshape(height, step)[:, :width, None]
    return pairs.reshape(height, 2 * width, 2)


def _in_bgr(pixels: AnyArray, layout: _Layout) -> AnyArray:
    """Return the pixels of a layout of colour as BGR, and others as they are."""
    if layout.is_colour:
        pixels = upper_bits(pixels)
    if layout.conversion is None:
        return pixels
    import cv2

    return np.asarray(cv2.cvtColor(pixels, getattr(cv2, layout.conversion)))


def _decompressed(message: Any) -> AnyArray:
    form = text_in(message, "format").lower()
    data = bytes_in(message).tobytes()
    if "compresseddepth" in form:
        return decode_compressed_depth(form, data)
    try:
        pixels = decode(data)
    except SourceError as error:
        raise InputError(f"a compressed image ({shown(form)}) {error}") from error
    if pixels.ndim == 2:
        return _without_mosaic(pixels, form)
    # The transport says in which order it handed the channels to the codec, which takes them for BGR.
    return upper_bits(pixels[..., ::-1].copy() if "compressed rgb" in form else pixels)


def _without_mosaic(pixels: AnyArray, form: str) -> AnyArray:
    """Return the one channel of a codec, in BGR if the transport says that it is a mosaic that was packed as it is."""
    encoding, _, packing = (part.strip() for part in form.partition(";"))
    packed = packing.partition("compressed")[2].strip()  # empty in ROS 1 and in older ROS 2
    layout = ENCODINGS.get(encoding)
    if layout is None or not encoding.startswith("bayer_") or not (packed.startswith("bayer_") or not packed):
        return pixels
    _check_shape(layout, encoding, *pixels.shape)
    return _in_bgr(pixels, layout)


def _check_size(height: int, width: int) -> None:
    try:
        check_pixels(height, width)
    except SourceError as error:
        raise InputError(f"an image {error}") from error
