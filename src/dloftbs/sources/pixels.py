"""From files to pixels, and from pixels to an image or a mask."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import plane_of
from dloftbs._npy import BROKEN, File, open_mapped, opened
from dloftbs._values import shown
from dloftbs.errors import InputError, SourceError
from dloftbs.sources.avif import decode_avif
from dloftbs.sources.image_header import FORMATS, JPEG, is_avif, is_avif_sequence, is_lossy, read_durations, read_size
from dloftbs.sources.palette_png import as_grey, holds_labels, indices_of, is_indexed
from dloftbs.sources.source import logger

AnyArray = npt.NDArray[Any]
Kind = Literal["auto", "image", "mask"]
KINDS: tuple[str, ...] = get_args(Kind)

MAX_PIXELS = 1 << 27
"""Of a frame: a third more than medium-format cameras have, and 0.4 GB in colour."""
MAX_BYTES = 1 << 30
"""Size of the largest image file; `MAX_PIXELS` in colour of 16 bits take less, uncompressed."""
HALF = 128
"""Lossy codecs ring around edges, so that in their 8-bit masks cable begins at half, not at 1."""


def check_kind(kind: object) -> None:
    """Raise an `InputError` if a value is no kind of frames."""
    if not isinstance(kind, str) or kind not in KINDS:
        raise InputError(f"kind must be one of {', '.join(KINDS)}, got {shown(kind)}")


def read_image_or_mask(path: Path, kind: Kind) -> tuple[AnyArray | None, AnyArray | None]:
    """Read an image file as `decode_image_or_mask` does.

    Raises
    ------
    SourceError
        If the file cannot be read or is not what `kind` asks for.
    """
    try:
        data = read_bytes(path)
        count = len(read_durations(data))
        if count > 1 or is_avif_sequence(data):
            number = f"{count} " if count else ""
            logger.warning(
                "%s: only the first of its %sframes is read; an animation is a stream by itself", path, number
            )
        return decode_image_or_mask(data, kind)
    except SourceError as error:
        raise SourceError(f"{path}: {error}") from error


def decode_image_or_mask(data: bytes, kind: Kind) -> tuple[AnyArray | None, AnyArray | None]:
    """Decode the bytes of an image file as `image_or_mask` says.

    In a mask from a lossy codec, cable begins at half brightness. In an indexed PNG that is a mask, the indices count;
    "auto" takes one for a mask if it holds labels (`holds_labels`), or colours that are all grey.

    Raises
    ------
    SourceError
        If they cannot be decoded or are not what `kind` asks for.
    """
    if kind != "image" and is_indexed(data):
        indices = _indices(data)
        if kind == "mask" or holds_labels(data, indices) or _is_grey(decode(data)):
            return None, indices
        kind = "image"
    return image_or_mask(decode(data), kind, lossy=is_lossy(data))


def read_labels(path: Path) -> AnyArray:
    """Read the numbers (H, W) of the objects: one channel of integers, or the indices of an indexed PNG.

    Raises
    ------
    SourceError
        If the file cannot be read or has several channels or other numbers.
    """
    try:
        data = read_bytes(path)
        labels = _indices(data) if is_indexed(data) else decode(data)
    except SourceError as error:
        raise SourceError(f"{path}: {error}") from error
    if labels.ndim != 2 or not np.issubdtype(labels.dtype, np.integer):
        raise SourceError(
            f"{path}: labels must have one channel of integers, or be a PNG of indexed colour, "
            f"got {labels.shape} of {labels.dtype}"
        )
    return labels


def read_mask(path: Path) -> AnyArray:
    """Read a mask (H, W) from an image file or a .npy file.

    Raises
    ------
    SourceError
        If the file cannot be read or is no mask.
    """
    if path.suffix.lower() != ".npy":
        _, mask = read_image_or_mask(path, "mask")
        assert mask is not None  # what was asked for
        return mask
    mask = plane_of(load_npy(path))
    if mask.ndim != 2 or not _is_countable(mask.dtype):
        raise SourceError(f"{path}: a mask must be (H, W) of bool or integers, got {mask.shape} of {mask.dtype}")
    return mask


def read_depth(path: Path) -> AnyArray:
    """Read a depth image (H, W) from a 16-bit or floating-point image file, or from a .npy file.

    Raises
    ------
    SourceError
        If the file cannot be read or is no depth.
    """
    if path.suffix.lower() == ".npy":
        depth = plane_of(load_npy(path))
        wanted = np.issubdtype(depth.dtype, np.number)
    else:
        try:
            depth = read_pixels(path)
        except SourceError as error:
            raise SourceError(f"{path}: {error}") from error
        wanted = depth.dtype != np.uint8  # 8 bits are a picture of depth, not depth
    if depth.ndim != 2 or not wanted:
        raise SourceError(
            f"{path}: depth must have one channel of 16 bits or floating point, got {depth.shape} of {depth.dtype}"
        )
    return depth


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
        fits = path.stat().st_size <= MAX_BYTES
        data = path.read_bytes() if fits else b""  # cv2.imread does not take every path on Windows, and prints
    except OSError as error:
        raise SourceError(f"cannot be read: {error.strerror or error}") from error
    if not fits:
        raise SourceError(f"the file must have at most {MAX_BYTES} bytes")
    return data


def decode(data: bytes) -> AnyArray:
    """Decode the bytes of an image file without its alpha channel, at the depth of bits that it has.

    Raises
    ------
    SourceError
        If there are none, they are too large an image, of another format than `FORMATS`, corrupt or cut off.
    """
    import cv2

    check_header(data)
    if is_avif(data):
        return decode_avif(data, MAX_PIXELS)
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH)
    except cv2.error as error:
        raise SourceError(f"cannot be decoded as an image: {error.err}") from error
    if pixels is None:
        raise SourceError(f"cannot be decoded as an image: its {len(data)} bytes are corrupt, cut off or no image")
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
    if size is None:
        raise SourceError(f"cannot be decoded as an image: its {len(data)} bytes are no {FORMATS}, or are cut off")
    check_pixels(*size)
    return size


def _indices(data: bytes) -> AnyArray:
    """Return the indices (H, W) of an indexed PNG."""
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


def image_or_mask(pixels: AnyArray, kind: Kind, *, lossy: bool) -> tuple[AnyArray | None, AnyArray | None]:
    """Return ``(image, None)`` or ``(None, mask)``.

    Parameters
    ----------
    pixels : numpy.ndarray, shape (H, W) or (H, W, 3)
    kind : {"auto", "image", "mask"}
        "auto" takes one channel, or channels that are all equal, for a mask.
    lossy : bool
        In 8-bit masks, cable begins at half brightness rather than at 1.

    Raises
    ------
    SourceError
        If the pixels do not suit the kind.
    """
    if kind == "mask" or (kind == "auto" and _is_grey(pixels)):
        return None, _to_mask(pixels, lossy=lossy)
    return _to_image(pixels), None


def _to_mask(pixels: AnyArray, *, lossy: bool) -> AnyArray:
    if not _is_countable(pixels.dtype):
        raise SourceError(f"a mask must be bool or integer, any non-zero being cable, got {pixels.dtype}")
    if pixels.ndim == 3:
        pixels = pixels[..., 0] | pixels[..., 1] | pixels[..., 2]
    return pixels >= HALF if lossy and pixels.dtype == np.uint8 else pixels


def _to_image(pixels: AnyArray) -> AnyArray:
    if pixels.dtype != np.uint8:
        raise SourceError(f"an image must have 8 bits per channel, got {pixels.dtype}; convert it, or use it as a mask")
    return pixels if pixels.ndim == 3 else np.repeat(pixels[:, :, None], 3, axis=2)


def _is_grey(pixels: AnyArray) -> bool:
    if pixels.ndim == 2:
        return True
    # Nearly every colour image shows itself in a few pixels.
    return all(
        bool((part[..., 0] == part[..., 1]).all() and (part[..., 0] == part[..., 2]).all())
        for part in (pixels[::16, ::16], pixels)
    )


def _is_countable(dtype: np.dtype[Any]) -> bool:
    return bool(dtype == np.bool_ or np.issubdtype(dtype, np.integer))


def _jpeg_is_cut(data: bytes) -> bool:
    """Return whether the end marker is missing: OpenCV 4 fills the missing rest with grey and says nothing.

    The headers are stepped over, since a thumbnail in them has an end marker of its own.
    """
    at = 2
    while at + 4 <= len(data) and data[at] == 0xFF and data[at + 1] != 0xDA:
        at += 1 if data[at + 1] == 0xFF else 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return data.find(b"\xff\xd9", at) < 0
