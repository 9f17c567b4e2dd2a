"""From files to pixels, and from pixels to an image or a mask."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from dloftbs.errors import InputError, SourceError, source_errors
from dloftbs.sources.alpha_channel import LEFT_OUT, alpha_of_grey_tiff, is_one_colour, may_have_alpha, split, telling
from dloftbs.sources.avif import decode_avif
from dloftbs.sources.image_header import (
    JPEG,
    PNG,
    is_avif,
    is_avif_sequence,
    is_lossy,
    png_is_cut,
    read_durations,
    read_size,
)
from dloftbs.sources.indexed_colour import as_grey, holds_labels, indices_of, is_indexed
from dloftbs.sources.orientation import AS_STORED, read_orientation, turned
from dloftbs.sources.source import logger
from dloftbs.sources.tiff_pages import as_stored, is_tiff, pages_of
from dloftbs.sources.unreadable import is_refused, why_unreadable
from dloftbs.support.arrays import AnyArray, check_mask
from dloftbs.support.npy import BROKEN, File, open_mapped, opened
from dloftbs.support.values import shown

Kind = Literal["auto", "image", "mask", "auto_image"]
KINDS: tuple[str, ...] = get_args(Kind)

GREY_AS_IMAGE: Kind = "auto_image"
"""As "auto", but what has one channel is an image: for frames whose masks colour settings make."""

MAX_PIXELS = 1 << 27
"""Of a frame: a third more than medium-format cameras have, and 0.4 GB in colour."""
MAX_BYTES = 1 << 30
"""Size of the largest image file; `MAX_PIXELS` in colour of 16 bits take less, uncompressed."""
HALF = 128
"""Lossy codecs ring around edges, so that in their 8-bit masks cable begins at half, not at 1."""

LOSSY_LABELS = "a lossy codec changes numbers: save labels as PNG"
"""Message for numbers of objects in what went through such a codec."""

_MIN_GROUND = 0.25
"""Least share of the most frequent grey level in a mask.

Source: geometry; cables leave 0.4 of a mask that is read, and a codec keeps the half of it that lies off their edges.
"""
_GRID_PX = 4
"""Distance of the pixels that are counted for it, px.

Source: bounds time; 19,200 of 640 x 480 give the share to a percent.
"""
_NO_GROUND = (
    "read as a mask, but no grey level is frequent enough to be the ground: read a photograph with --kind image and a "
    "colour, and threshold scores first"
)


def check_kind(kind: object) -> None:
    """Raise an `InputError` if a value is no kind of frames."""
    if not isinstance(kind, str) or kind not in KINDS:
        raise InputError(f"kind must be one of {', '.join(KINDS)}, got {shown(kind)}")


def kind_for(kind: Kind, *, segmented: bool) -> Kind:
    """Return the kind of frames, of which masks may have to be made: then "auto" takes grey for an image."""
    return GREY_AS_IMAGE if kind == "auto" and segmented else kind


class Picture(NamedTuple):
    """Content of an image file: an image (H, W, 3) or a mask (H, W)."""

    image: AnyArray | None
    mask: AnyArray | None
    turned: int = AS_STORED
    """EXIF orientation that is still to be applied; `AS_STORED` where none is."""
    remarks: tuple[str, ...] = ()
    """Warnings, in the same words for all pictures that they hold for."""
    instances: AnyArray | None = None
    """Label image (H, W) of the objects."""


def read_image_or_mask(path: Path, kind: Kind, mask_is: str = "auto") -> tuple[AnyArray | None, AnyArray | None]:
    """Return the image and the mask of `read_picture`, as stored, and log the remarks.

    Raises
    ------
    SourceError
        If the file cannot be read or is not what `kind` asks for.
    """
    picture = read_picture(path, kind, mask_is)
    log_remarks(path, picture)
    return picture.image, picture.mask


def log_remarks(path: Path, picture: Picture) -> None:
    """Warn of what a reader of the picture in a file should know."""
    for remark in picture.remarks:
        logger.warning("%s: %s", path, remark)


def read_picture(path: Path, kind: Kind, mask_is: str = "auto", *, upright: bool = False) -> Picture:
    """Read an image file as `decode_picture` does; of an animation or several pages, the first.

    Raises
    ------
    SourceError
        If the file cannot be read or is not what `kind` asks for.
    """
    with source_errors(path):
        data = read_bytes(path)
        picture = decode_picture(data, kind, mask_is, upright=upright)
    return picture._replace(remarks=(*first_of_many(data), *picture.remarks))


def first_of_many(data: bytes) -> tuple[str, ...]:
    """Return a remark where a file holds more than the picture that is read."""
    if is_avif_sequence(data):
        return ("only the first of its frames is read; an animation is a stream by itself",)
    if (frames := len(read_durations(data))) > 1:
        return (f"only the first of its {frames} frames is read; an animation is a stream by itself",)
    if (pages := len(pages_of(data).frames)) > 1:
        return (f"only the first of its {pages} pages is read; a TIFF of several pages is a stream by itself",)
    return ()


def decode_picture(data: bytes, kind: Kind, mask_is: str = "auto", *, upright: bool = False) -> Picture:
    """Decode the bytes of an image file as `image_or_mask` says.

    In a PNG or TIFF of indexed colour that is a mask, the indices count; "auto" takes one for a mask if it holds labels
    (`holds_labels`), or colours that are all grey.

    Parameters
    ----------
    data : bytes
    kind : {"auto", "image", "mask", "auto_image"}
    mask_is : {"auto", "binary", "probability", "labels"}
        What the values of a mask are.
    upright : bool
        Turn the picture as its EXIF orientation says; otherwise it is as it was stored, as the sensor gave it.

    Raises
    ------
    SourceError
        If they cannot be decoded or are not what `kind` asks for.
    """
    image, mask, remarks = _decoded(data, kind, mask_is)
    orientation = read_orientation(data)
    if orientation == AS_STORED or not upright:
        return Picture(image, mask, orientation, remarks)
    image, mask = (None if array is None else turned(array, orientation) for array in (image, mask))
    return Picture(image, mask, AS_STORED, remarks)


def _decoded(data: bytes, kind: Kind, mask_is: str) -> tuple[AnyArray | None, AnyArray | None, tuple[str, ...]]:
    """Return the image or the mask, and remarks."""
    if kind == GREY_AS_IMAGE:
        kind = "image"
    if kind != "image" and is_indexed(data):
        indices = read_indices(data)
        if kind == "mask" or holds_labels(data, indices) or _is_grey(decode(data)):
            return None, indices, ()
        kind = "image"
    pixels, alpha = _with_alpha(data)
    image, mask = image_or_mask(pixels, kind, mask_is, lossy=is_lossy(data), alpha=alpha)
    if mask is not None:
        return None, mask, (_NO_GROUND,) if alpha is None and _lacks_ground(pixels) else ()
    return image, None, (LEFT_OUT,) if telling(pixels, alpha) is not None else ()


def _lacks_ground(pixels: AnyArray) -> bool:
    """Return True for pixels of 8 bits that are too varied for a mask: a photograph, or scores with noise."""
    if pixels.dtype != np.uint8:
        return False
    some = (pixels if pixels.ndim == 2 else pixels[..., 1])[::_GRID_PX, ::_GRID_PX]
    return bool(np.bincount(some.ravel()).max(initial=0) < _MIN_GROUND * some.size)


def load_npy(file: File) -> AnyArray:
    """Map a .npy file into memory, read-only; no pixel is read before it is looked at.

    Raises
    ------
    SourceError
        If the file cannot be read, is cut off, or holds Python objects.
    """
    try:
        if zipfile.is_zipfile(opened(file)):
            raise SourceError(f"{file}: is an archive of arrays; name it .npz")
        return open_mapped(file)
    except SourceError:
        raise
    except BROKEN as error:
        raise SourceError(f"{file}: cannot be read as a .npy file: {error}") from error


def read_pixels(path: Path) -> AnyArray:
    """Decode an image file as `decode` does.

    Raises
    ------
    SourceError
        If there is no such file, it is too large, or it cannot be decoded.
    """
    return decode(read_bytes(path))


def read_bytes(path: Path) -> bytes:
    """Return the content of an image file.

    Raises
    ------
    SourceError
        If there is no such file, or it is too large.
    """
    try:
        if os.path.exists(path) and not os.path.isfile(path):
            raise SourceError("cannot be read: it is no file")
        fits = path.stat().st_size <= MAX_BYTES
        data = path.read_bytes() if fits else b""  # cv2.imread does not take every path on Windows, and prints
    except SourceError:
        raise
    except OSError as error:
        raise SourceError(f"cannot be read: {error.strerror or error}") from error
    if not fits:
        raise SourceError(f"the file must have at most {MAX_BYTES} bytes")
    return data


def decode(data: bytes) -> AnyArray:
    """Decode the bytes of an image file without its alpha channel, at the depth of bits that it has, as it is stored.

    Raises
    ------
    SourceError
        If there are none, they are too large an image, of another format than `FORMATS`, corrupt or cut off.
    """
    import cv2

    return _decode(data, cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION)


def _with_alpha(data: bytes) -> tuple[AnyArray, AnyArray | None]:
    """Decode the bytes of an image file as `decode` does, and its alpha channel (H, W) if it has one."""
    import cv2

    check_header(data)
    if not may_have_alpha(data):
        return decode(data), None
    pixels, alpha = split(_decode(data, cv2.IMREAD_UNCHANGED))
    return pixels, alpha_of_grey_tiff(data) if alpha is None else alpha


def _decode(data: bytes, flags: int) -> AnyArray:
    import cv2

    check_header(data)
    if is_avif(data):
        return decode_avif(data, MAX_PIXELS)
    if data.startswith(PNG) and png_is_cut(data):  # OpenCV makes room for it, up to 2 GB, and fails then
        raise SourceError(f"cannot be decoded as an image: the PNG is cut off after {len(data)} bytes")
    if is_tiff(data):  # which OpenCV turns whatever the flags say
        data = as_stored(data)
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except cv2.error as error:
        raise SourceError(f"cannot be decoded as an image: {error.err}") from error
    if pixels is None:
        raise SourceError(f"cannot be decoded as an image: {why_unreadable(data)}")
    if data.startswith(JPEG) and _jpeg_is_cut(data):
        raise SourceError(f"cannot be decoded as an image: the JPEG is cut off after {len(data)} bytes")
    return pixels


def check_header(data: bytes) -> tuple[int, int]:
    """Return ``(rows, columns)`` of an image file of which nothing was decoded yet.

    Raises
    ------
    SourceError
        If there are no bytes, or they are too large an image, of another format than `FORMATS`, or cut off.
    """
    if not data:
        raise SourceError("the file is empty")
    size = read_size(data)
    if size is None or is_refused(data):
        raise SourceError(f"cannot be decoded as an image: {why_unreadable(data)}")
    check_pixels(*size)
    return size


def read_indices(data: bytes) -> AnyArray:
    """Return the indices (H, W) of an indexed PNG or TIFF."""
    return indices_of(data, decode(as_grey(data)))


def check_pixels(rows: int, columns: int) -> None:
    """Refuse an image that is too large, before memory is allocated for it.

    Raises
    ------
    SourceError
        If there are more than `MAX_PIXELS`.
    """
    if rows * columns > MAX_PIXELS:
        raise SourceError(f"must have at most {MAX_PIXELS} pixels, got {columns} x {rows}")


def image_or_mask(
    pixels: AnyArray, kind: Kind, mask_is: str = "auto", *, lossy: bool, alpha: AnyArray | None = None
) -> tuple[AnyArray | None, AnyArray | None]:
    """Return ``(image, None)`` or ``(None, mask)``.

    An alpha channel is the mask where all pixels have one colour (`is_one_colour`). An opaque one is ignored.

    Parameters
    ----------
    pixels : numpy.ndarray, shape (H, W) or (H, W, 3)
    kind : {"auto", "image", "mask"}
        "auto" takes one channel, or channels that are all equal, for a mask.
    mask_is : {"auto", "binary", "probability", "labels"}
        What the values of a mask are.
    lossy : bool
        In 8-bit masks, cable begins at half brightness rather than at 1, unless they are a probability.
    alpha : numpy.ndarray, shape (H, W), optional
        The alpha channel.

    Raises
    ------
    SourceError
        If the pixels do not suit the kind, the alpha channel of a mask is another mask, or 8-bit labels went through a
        lossy codec.
    """
    alpha = telling(pixels, alpha)
    if alpha is not None and kind != "image" and is_one_colour(pixels, alpha):
        return None, _to_mask(alpha, mask_is, lossy=lossy)
    if kind == "image" or (kind == "auto" and not _is_grey(pixels)):
        return _to_image(pixels), None
    mask = _to_mask(pixels, mask_is, lossy=lossy)
    if alpha is not None:
        _check_alike(mask, _to_mask(alpha, mask_is, lossy=lossy))
    return None, mask


def _check_alike(colour: AnyArray, alpha: AnyArray) -> None:
    """Refuse a mask in the colours and another one in the alpha channel."""
    if np.array_equal(colour != 0, alpha != 0):
        return
    raise SourceError(
        f"its colours and its alpha channel are two different masks, of {np.count_nonzero(colour)} and "
        f"{np.count_nonzero(alpha)} pixels; save the right one alone, as a grey image"
    )


def _to_mask(pixels: AnyArray, mask_is: str, *, lossy: bool) -> AnyArray:
    if pixels.dtype.kind == "f" and _is_grey(pixels):
        return as_mask(pixels if pixels.ndim == 2 else pixels[..., 0])
    if not is_countable(pixels.dtype):
        raise SourceError(f"a mask must be bool or integer, any non-zero being cable, got {pixels.dtype}")
    if pixels.ndim == 3:
        pixels = np.maximum(np.maximum(pixels[..., 0], pixels[..., 1]), pixels[..., 2])
    if not lossy or pixels.dtype != np.uint8 or mask_is == "probability":
        return pixels
    if mask_is == "labels":
        raise SourceError(LOSSY_LABELS)
    return pixels >= HALF


def as_mask(pixels: AnyArray) -> AnyArray:
    """Return pixels (H, W) as they are, if a frame takes them as a mask.

    Raises
    ------
    SourceError
        If it does not.
    """
    try:
        return check_mask(pixels, may_be_soft=True)
    except InputError as error:
        raise SourceError(str(error)) from error


def _to_image(pixels: AnyArray) -> AnyArray:
    if pixels.dtype != np.uint8:
        raise SourceError(
            f"an image must have 8 bits per channel, got {pixels.dtype}; convert it, as by cv2.imread(file), or use it "
            "as a mask: kind='mask' (--kind mask)"
        )
    return pixels if pixels.ndim == 3 else np.repeat(pixels[:, :, None], 3, axis=2)


def _is_grey(pixels: AnyArray) -> bool:
    if pixels.ndim == 2:
        return True
    # Nearly every colour image shows itself in a few pixels.
    return all(
        bool((part[..., 0] == part[..., 1]).all() and (part[..., 0] == part[..., 2]).all())
        for part in (pixels[::16, ::16], pixels)
    )


def is_countable(dtype: np.dtype[Any]) -> bool:
    """Return whether a type is bool or integers, as masks have it."""
    return bool(dtype == np.bool_ or np.issubdtype(dtype, np.integer))


def _jpeg_is_cut(data: bytes) -> bool:
    """Return whether the end marker is missing: OpenCV 4 fills the missing rest with grey and says nothing.

    The headers are stepped over, since a thumbnail in them has an end marker of its own.
    """
    at = 2
    while at + 4 <= len(data) and data[at] == 0xFF and data[at + 1] != 0xDA:
        at += 1 if data[at + 1] == 0xFF else 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return data.find(b"\xff\xd9", at) < 0
