"""PNG files of indexed colour (a palette, mode "P"): each pixel's index, where OpenCV gives its colour."""

from __future__ import annotations

import struct
import zlib

import numpy as np

from dloftbs.sources.image_header import PNG, png_chunks
from dloftbs.support.arrays import AnyArray

MAX_LABELS = 32
"""Different indices in an image of labels, at most: VOC has 20 classes and a border. Tools that compress photographs to
a palette take 64 to 256 colours."""

_INDEXED, _GREY = 3, 0
"""Types of colour in the header of a PNG."""
_BIT_DEPTHS = (1, 2, 4, 8)
"""Bits of an index, as the format allows."""
_PIXELS = (b"IDAT", b"IEND")
"""Chunks that hold the pixels, and the last one."""


def is_indexed(data: bytes) -> bool:
    """Return whether the header of a file says that it is a PNG of indexed colour."""
    return data.startswith(PNG) and len(data) >= 33 and data[24] in _BIT_DEPTHS and data[25] == _INDEXED


def as_grey(data: bytes) -> bytes:
    """Return an indexed file as one whose colours are its indices; `indices_of` makes indices of its pixels.

    Grey PNG files store pixels alike, so that only the header differs. The checksums of the pixels stay, so that a
    damaged file is still refused.
    """
    kind, content, checksum = data[12:16], data[16:29], data[29:33]
    grey = content[:9] + bytes((_GREY,)) + content[10:]
    if checksum == _checksum(kind + content):
        checksum = _checksum(kind + grey)
    kept = (data[at : at + 12 + size] for name, at, size in png_chunks(data) if name in _PIXELS)
    return b"".join([data[:16], grey, checksum, *kept])


def indices_of(data: bytes, grey: AnyArray) -> AnyArray:
    """Return the indices (H, W) of an indexed file, given the pixels of its `as_grey`."""
    return grey // (255 // (2 ** data[24] - 1))  # decoders stretch grey of fewer than 8 bits to 0..255


def holds_labels(data: bytes, indices: AnyArray) -> bool:
    """Return whether an indexed file looks like labels rather than like a picture.

    Labels are few, index 0 is black and the most frequent: ground.
    """
    import cv2

    counts = cv2.calcHist([indices], [0], None, [256], [0, 256])  # numpy would copy every index to 8 bytes
    return _first_is_black(data) and int(np.count_nonzero(counts)) <= MAX_LABELS and int(counts.argmax()) == 0


def _first_is_black(data: bytes) -> bool:
    return any(data[at + 8 : at + 11] == bytes(3) for kind, at, _ in png_chunks(data) if kind == b"PLTE")


def _checksum(data: bytes) -> bytes:
    return struct.pack(">I", zlib.crc32(data))
