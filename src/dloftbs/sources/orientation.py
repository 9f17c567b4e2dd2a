"""Orientation of a picture for viewers, as the EXIF data of cameras and phones state it: read, and applied."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np

from dloftbs.sources.image_header import JPEG, PNG, is_webp, jpeg_segments, png_chunks, webp_chunks
from dloftbs.sources.tiff_pages import ORIENTATION, first_page, is_tiff
from dloftbs.support.arrays import AnyArray

AS_STORED = 1
"""Orientation of a picture that is shown as it is stored."""
MEANINGS = {
    2: "mirrored from left to right",
    3: "turned by 180 degrees",
    4: "mirrored from top to bottom",
    5: "turned by 90 degrees and mirrored",
    6: "turned by 90 degrees clockwise",
    7: "turned by 90 degrees and mirrored",
    8: "turned by 90 degrees anticlockwise",
}
"""Change of the stored pixels that shows them upright, by its number in EXIF and TIFF."""

_TRANSPOSED = (5, 6, 7, 8)
_FLIPPED_X = (2, 3, 6, 7)
"""Orientations in which the columns are reversed, after the transposition if there is one."""
_FLIPPED_Y = (3, 4, 7, 8)
_EXIF = b"Exif\0\0"
"""Start of EXIF data in JPEG, and of some WebP."""
_APP1 = 0xE1
"""JPEG's marker of the segments that hold EXIF data."""


def read_orientation(data: bytes) -> int:
    """Return the orientation, 1 to 8, of the first picture in a file; 1 where it states none."""
    try:
        return next((_stated(block.removeprefix(_EXIF)) for block in _blocks(data)), AS_STORED)
    except (struct.error, IndexError):  # cut off, as its decoder will say
        return AS_STORED


def _blocks(data: bytes) -> Iterator[bytes]:
    """Yield what may hold EXIF data; a TIFF is laid out as such data itself."""
    if is_tiff(data):
        yield data
    elif data.startswith(JPEG):
        parts = (data[at:end] for marker, at, end in jpeg_segments(data) if marker == _APP1)
        yield from (part for part in parts if part.startswith(_EXIF))
    elif data.startswith(PNG):
        yield from (data[at + 8 : at + 8 + size] for kind, at, size in png_chunks(data) if kind == b"eXIf")
    elif is_webp(data):
        chunks = webp_chunks(data, 12, len(data))
        yield from (data[at + 8 : at + 8 + size] for kind, at, size in chunks if kind == b"EXIF")


def turned(pixels: AnyArray, orientation: int) -> AnyArray:
    """Return stored pixels (H, W) or (H, W, C) as viewers show them."""
    if orientation in _TRANSPOSED:
        pixels = pixels.swapaxes(0, 1)
    if orientation in _FLIPPED_X:
        pixels = pixels[:, ::-1]
    if orientation in _FLIPPED_Y:
        pixels = pixels[::-1]
    return np.ascontiguousarray(pixels)


def _stated(block: bytes) -> int:
    """Return the orientation in a block that is laid out as TIFF is."""
    page = first_page(block) if is_tiff(block) else None
    orientation = AS_STORED if page is None else page.tags.get(ORIENTATION, AS_STORED)
    return orientation if orientation in MEANINGS else AS_STORED
