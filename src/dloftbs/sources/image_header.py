"""The size of an image, read off the first bytes of its file: a decoder makes room for what they say.

All formats of `dloftbs.sources.image_files.IMAGE_EXTENSIONS` are known, and PFM.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable

FORMATS = "PNG, JPEG, BMP, TIFF, WebP, PBM, PGM, PPM or PFM"

_PNM = re.compile(rb"P[1-6Ff](?:\s|#[^\r\n]*[\r\n])+([0-9]{1,9})(?:\s|#[^\r\n]*[\r\n])+([0-9]{1,9})\s")
_NO_SIZE = {0xC4, 0xC8, 0xCC}
"""JPEG's markers among those of frames that begin something else: tables, an extension, conditions of coding."""
_ALONE = {0x01, *range(0xD0, 0xD9)}
"""JPEG's markers without a segment."""
_TIFF_TYPES = {1: "B", 3: "H", 4: "I", 6: "b", 8: "h", 9: "i", 16: "Q", 17: "q"}
_TIFF_SIDES = {256: 0, 322: 0, 257: 1, 323: 1}
"""Side, width or height, that each tag of TIFF gives: of the image, and of its tiles, all decoded whole."""


def read_size(data: bytes) -> tuple[int, int] | None:
    """Return ``(rows, columns)``; None where the file is of no known format, or cut off before it says.

    Of a TIFF with tiles larger than itself, the size of a tile.
    """
    for begins, read in _READERS.items():
        if data.startswith(begins):
            try:
                return read(data)
            except (struct.error, IndexError):  # cut off
                return None
    return None


def _png(data: bytes) -> tuple[int, int] | None:
    columns, rows = struct.unpack_from(">II", data, 16)
    return (rows, columns) if data[12:16] == b"IHDR" else None


def _jpeg(data: bytes) -> tuple[int, int] | None:
    at = 2
    while (at := data.find(b"\xff", at)) >= 0:  # what stands between segments is skipped, as decoders do
        marker = data[at + 1]
        if marker in (0x00, 0xFF) or marker in _ALONE:
            at += 1
        elif 0xC0 <= marker <= 0xCF and marker not in _NO_SIZE:
            rows, columns = struct.unpack_from(">HH", data, at + 5)
            return rows, columns
        elif marker in (0xD9, 0xDA):
            return None
        else:
            (length,) = struct.unpack_from(">H", data, at + 2)
            at += 2 + length
    return None


def _bmp(data: bytes) -> tuple[int, int] | None:
    (header,) = struct.unpack_from("<I", data, 14)
    columns, rows = struct.unpack_from("<HH" if header == 12 else "<ii", data, 18)
    return abs(rows), abs(columns)


def _tiff(data: bytes) -> tuple[int, int] | None:
    order = "<" if data.startswith(b"II") else ">"
    is_big = 0x2B in data[2:4]
    (at,) = struct.unpack_from(f"{order}Q" if is_big else f"{order}I", data, 8 if is_big else 4)
    (entries,) = struct.unpack_from(f"{order}Q" if is_big else f"{order}H", data, at)
    at += 8 if is_big else 2
    sides = [0, 0]
    for _ in range(min(entries, len(data))):
        tag, kind = struct.unpack_from(f"{order}HH", data, at)
        if tag in _TIFF_SIDES:
            if kind not in _TIFF_TYPES:
                return None
            (value,) = struct.unpack_from(order + _TIFF_TYPES[kind], data, at + (12 if is_big else 8))
            sides[_TIFF_SIDES[tag]] = max(sides[_TIFF_SIDES[tag]], value)
        at += 20 if is_big else 12
    return (sides[1], sides[0]) if min(sides) > 0 else None


def _webp(data: bytes) -> tuple[int, int] | None:
    kind = data[12:16]
    if data[8:12] != b"WEBP" or kind not in (b"VP8 ", b"VP8L", b"VP8X"):
        return None
    if kind == b"VP8 ":
        columns, rows = struct.unpack_from("<HH", data, 26)
        return rows & 0x3FFF, columns & 0x3FFF
    if kind == b"VP8L":
        (bits,) = struct.unpack_from("<I", data, 21)
        return (bits >> 14 & 0x3FFF) + 1, (bits & 0x3FFF) + 1
    columns, rows = struct.unpack_from("<I", data, 24)[0] & 0xFFFFFF, struct.unpack_from("<I", data, 26)[0] >> 8
    return rows + 1, columns + 1


def _pnm(data: bytes) -> tuple[int, int] | None:
    found = _PNM.match(data)
    return None if found is None else (int(found[2]), int(found[1]))


_READERS: dict[bytes, Callable[[bytes], tuple[int, int] | None]] = {
    b"\x89PNG\r\n\x1a\n": _png,
    b"\xff\xd8\xff": _jpeg,
    b"BM": _bmp,
    **dict.fromkeys((b"II\x2a\x00", b"MM\x00\x2a", b"II\x2b\x00", b"MM\x00\x2b"), _tiff),
    b"RIFF": _webp,
    b"P": _pnm,
}
