"""PNG and TIFF files of indexed colour (a palette, mode "P"): each pixel's index, where OpenCV gives its colour."""

from __future__ import annotations

import struct
import zlib

import numpy as np

from dloftbs.sources.image_header import PNG, png_chunks
from dloftbs.sources.tiff_pages import BITS, COLOUR_MAP, INDEXED, PHOTOMETRIC, SAMPLES, Page, first_page, is_tiff
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
    """Return whether the header of a file says that it is a PNG or a TIFF of indexed colour."""
    if is_tiff(data):
        page = first_page(data)
        return page is not None and _has_map(page)
    return data.startswith(PNG) and len(data) >= 33 and data[24] in _BIT_DEPTHS and data[25] == _INDEXED


def _has_map(page: Page) -> bool:
    has_one = page.tags.get(PHOTOMETRIC) == INDEXED and page.tags.get(SAMPLES, 1) == 1 and COLOUR_MAP in page.tags
    return has_one and page.tags.get(BITS) in _BIT_DEPTHS


def as_grey(data: bytes) -> bytes:
    """Return an indexed file as one whose colours are its indices; `indices_of` makes indices of its pixels.

    Grey PNG files store pixels alike, so that only the header differs. The checksums of the pixels stay, so that a
    damaged file is still refused.
    """
    if is_tiff(data):
        return _with_grey_map(data)
    kind, content, checksum = data[12:16], data[16:29], data[29:33]
    grey = content[:9] + bytes((_GREY,)) + content[10:]
    if checksum == _checksum(kind + content):
        checksum = _checksum(kind + grey)
    kept = (data[at : at + 12 + size] for name, at, size in png_chunks(data) if name in _PIXELS)
    return b"".join([data[:16], grey, checksum, *kept])


def indices_of(data: bytes, grey: AnyArray) -> AnyArray:
    """Return the indices (H, W) of an indexed file, given the pixels of its `as_grey`."""
    if is_tiff(data):
        return grey if grey.ndim == 2 else np.ascontiguousarray(grey[..., 0])
    return grey // (255 // (2 ** data[24] - 1))  # decoders stretch grey of fewer than 8 bits to 0..255


def holds_labels(data: bytes, indices: AnyArray) -> bool:
    """Return whether an indexed file looks like labels rather than like a picture.

    Labels are few, index 0 is black and the most frequent: ground.
    """
    import cv2

    counts = cv2.calcHist([indices], [0], None, [256], [0, 256])  # numpy would copy every index to 8 bytes
    return _first_is_black(data) and int(np.count_nonzero(counts)) <= MAX_LABELS and int(counts.argmax()) == 0


def _first_is_black(data: bytes) -> bool:
    if not is_tiff(data):
        return any(data[at + 8 : at + 11] == bytes(3) for kind, at, _ in png_chunks(data) if kind == b"PLTE")
    at, colours, _ = _colour_map(data)
    return all(data[at + row : at + row + 2] == bytes(2) for row in range(0, 6 * colours, 2 * colours))


def _with_grey_map(data: bytes) -> bytes:
    at, colours, order = _colour_map(data)
    grey = (np.arange(colours) * 257).astype(f"{order}u2").tobytes()  # the index in the upper 8 bits, which count
    return b"".join([data[:at], grey * 3, data[at + 6 * colours :]])


def _colour_map(data: bytes) -> tuple[int, int, str]:
    """Return where the colours of a TIFF are, how many there are, and their byte order.

    There are 16 bits a number, all of red first, then green and blue.
    """
    page = first_page(data)
    assert page is not None  # is_indexed saw it
    form, at = page.places[COLOUR_MAP]
    return at, 2 ** page.tags[BITS], form[0]


def _checksum(data: bytes) -> bytes:
    return struct.pack(">I", zlib.crc32(data))
