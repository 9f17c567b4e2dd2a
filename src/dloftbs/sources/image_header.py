"""Headers of image files: the size, for which a decoder makes room, and the kind of compression.

All formats of `dloftbs.sources.image_files.IMAGE_EXTENSIONS` are known, and PFM.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterator

from dloftbs.sources.tiff_pages import COMPRESSION, JPEG_COMPRESSIONS, first_page, is_tiff

PNG = b"\x89PNG\r\n\x1a\n"
"""Start of every PNG file."""
JPEG = b"\xff\xd8\xff"
"""Start of every JPEG file."""
FORMATS = "PNG, JPEG, BMP, TIFF, WebP, PBM, PGM, PPM or PFM"

_PNM_BEGIN = re.compile(rb"P[1-6Ff](?:\s|#)")
_PNM = re.compile(rb"P[1-6Ff](?:\s|#[^\r\n]*[\r\n])+([0-9]{1,9})(?:\s|#[^\r\n]*[\r\n])+([0-9]{1,9})\s")
_JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""JPEG's markers of frames; the others in between begin tables, an extension and conditions of coding."""
_ALONE = {0x01, *range(0xD0, 0xD9)}
"""JPEG's markers without a segment."""
_ANIMATED_HEAD = 1024
"""Bytes in which an animation says that it is one; only a profile of colours stands before."""


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


def is_image(begin: bytes) -> bool:
    """Return whether the first 32 bytes of a file are those of a format that `read_size` knows."""
    if begin.startswith(b"RIFF"):
        return is_webp(begin)
    return any(begin.startswith(known) for known in _READERS if known != b"P") or _PNM_BEGIN.match(begin) is not None


def is_lossy(data: bytes) -> bool:
    """Return whether the pixels went through a codec that rings around edges.

    That is JPEG, also within a TIFF, and WebP that is not lossless.
    """
    if data.startswith(JPEG):
        return True
    if is_tiff(data):
        page = first_page(data)
        return page is not None and page.tags.get(COMPRESSION) in JPEG_COMPRESSIONS
    if not is_webp(data):
        return False
    return any(kind == b"VP8 " for kind, _, _ in webp_chunks(data, 12, len(data)))


def is_animated(data: bytes) -> bool:
    """Return whether a file is an animated PNG or WebP."""
    begin = data[:_ANIMATED_HEAD]
    return (begin.startswith(PNG) and b"acTL" in begin) or (is_webp(begin) and b"ANIM" in begin)


def png_chunks(data: bytes) -> Iterator[tuple[bytes, int, int]]:
    """Yield kind, position and number of bytes of content of each whole chunk of a PNG file."""
    at = len(PNG)
    while at + 12 <= len(data):
        size = int.from_bytes(data[at : at + 4], "big")
        if at + 12 + size > len(data):
            return
        yield data[at + 4 : at + 8], at, size
        at += 12 + size


def png_is_cut(data: bytes) -> bool:
    """Return whether a chunk of a PNG says that it goes on behind the end of the file."""
    at = len(PNG)
    while at + 8 <= len(data) and data[at + 4 : at + 8] != b"IEND":
        at += 12 + int.from_bytes(data[at : at + 4], "big")
    return at > len(data)


def webp_chunks(data: bytes, at: int, end: int) -> Iterator[tuple[bytes, int, int]]:
    """Yield kind, position and number of bytes of content of the chunks of a WebP file, as far as they are whole."""
    while at + 8 <= end:
        size = int.from_bytes(data[at + 4 : at + 8], "little")
        if at + 8 + size > end:
            return
        yield data[at : at + 4], at, size
        at += 8 + size + size % 2


def is_webp(data: bytes) -> bool:
    """Return whether a file begins as a WebP."""
    return data.startswith(b"RIFF") and data[8:12] == b"WEBP"


def _png(data: bytes) -> tuple[int, int] | None:
    columns, rows = struct.unpack_from(">II", data, 16)
    return (rows, columns) if data[12:16] == b"IHDR" else None


def _jpeg(data: bytes) -> tuple[int, int] | None:
    frames = (at for marker, at, _ in jpeg_segments(data) if marker in _JPEG_FRAMES)
    return next((struct.unpack_from(">HH", data, at + 1) for at in frames), None)


def jpeg_segments(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield marker, begin and end of the content of each segment of a JPEG before its pixels.

    Raises
    ------
    struct.error, IndexError
        If the file is cut off.
    """
    at = 2
    while (at := data.find(b"\xff", at)) >= 0:  # what stands between segments is skipped, as decoders do
        marker = data[at + 1]
        if marker in (0x00, 0xFF) or marker in _ALONE:
            at += 1
        elif marker in (0xD9, 0xDA):
            return
        else:
            (length,) = struct.unpack_from(">H", data, at + 2)
            yield marker, at + 4, at + 2 + length
            at += 2 + length


def _bmp(data: bytes) -> tuple[int, int] | None:
    (header,) = struct.unpack_from("<I", data, 14)
    columns, rows = struct.unpack_from("<HH" if header == 12 else "<ii", data, 18)
    return abs(rows), abs(columns)


def _tiff(data: bytes) -> tuple[int, int] | None:
    page = first_page(data)
    return None if page is None else page.size


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
    PNG: _png,
    JPEG: _jpeg,
    b"BM": _bmp,
    **dict.fromkeys((b"II\x2a\x00", b"MM\x00\x2a", b"II\x2b\x00", b"MM\x00\x2b"), _tiff),
    b"RIFF": _webp,
    b"P": _pnm,
}
