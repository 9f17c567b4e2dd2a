"""Headers of image files: the size, for which a decoder makes room; the kind of compression; the frames of animations.

All formats of `dloftbs.sources.image_files.IMAGE_EXTENSIONS` are known, and PFM.
"""

from __future__ import annotations

import io
import re
import struct
from collections.abc import Callable, Iterator
from typing import IO

from dloftbs.sources.tiff_pages import COMPRESSION, JPEG_COMPRESSIONS, first_page, is_tiff

PNG = b"\x89PNG\r\n\x1a\n"
"""Start of every PNG file."""
JPEG = b"\xff\xd8\xff"
"""Start of every JPEG file."""
FORMATS = "PNG, JPEG, BMP, TIFF, WebP, AVIF, PBM, PGM, PPM or PFM"

_PNM_BEGIN = re.compile(rb"P[1-6Ff](?:\s|#)")
_PNM = re.compile(rb"P[1-6Ff](?:\s|#[^\r\n]*[\r\n])+([0-9]{1,9})(?:\s|#[^\r\n]*[\r\n])+([0-9]{1,9})\s")
JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""JPEG's markers of frames; the others in between begin tables, an extension and conditions of coding."""
_ALONE = {0x01, *range(0xD0, 0xD9)}
"""JPEG's markers without a segment."""
AVIF_HEAD = 256
"""Bytes in which the brands of an AVIF file are looked for; libavif writes at most ten."""
_AVIF_SIZE = re.compile(rb"\0\0\0\x14ispe.{4}(.{8})", re.DOTALL)
"""Property that states a width and a height: a box of 20 bytes, ISO/IEC 23008-12."""
_WEBP_ANIMATED = 0x02
"""Flag of animations in WebP's extended header."""
_WEBP_FRAME_HEADER = 16
"""Bytes before the pixels' chunks in a frame of an animated WebP."""
_APNG_PARTS = 100
"""Parts of a second in which APNG counts where it states 0."""


def read_size(data: bytes) -> tuple[int, int] | None:
    """Return ``(rows, columns)``; None where the file is of no known format, or cut off before it says.

    Of a TIFF with tiles larger than itself, the size of a tile.
    """
    if is_avif(data):
        return _avif(data)
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

    That is JPEG, also within a TIFF, AVIF, and WebP that is not lossless.
    """
    if data.startswith(JPEG) or is_avif(data):
        return True
    if is_tiff(data):
        page = first_page(data)
        return page is not None and page.tags.get(COMPRESSION) in JPEG_COMPRESSIONS
    if not is_webp(data):
        return False
    for kind, at, size in webp_chunks(data, 12, len(data)):
        if kind == b"ANMF":  # the first frame speaks for all
            inner = webp_chunks(data, at + 8 + _WEBP_FRAME_HEADER, at + 8 + size)
            return any(name == b"VP8 " for name, _, _ in inner)
        if kind in (b"VP8 ", b"VP8L"):
            return kind == b"VP8 "
    return False


def is_avif(data: bytes) -> bool:
    """Return whether this is an AVIF file, of one image or of several."""
    return data[4:8] == b"ftyp" and any(brand in _brands(data) for brand in (b"avif", b"avis"))


def is_avif_sequence(data: bytes) -> bool:
    """Return whether this is an AVIF file of several images; its first bytes are enough."""
    return is_avif(data) and b"avis" in _brands(data)


def is_animated(file: IO[bytes]) -> bool:
    """Return whether an open file is an animated PNG or WebP, as its header says; its pixels are not read."""
    begin = file.read(21)
    if is_webp(begin):
        return begin[12:16] == b"VP8X" and len(begin) == 21 and bool(begin[20] & _WEBP_ANIMATED)
    if not begin.startswith(PNG):
        return False
    at = len(PNG)
    while True:
        file.seek(at)
        head = file.read(8)
        if len(head) < 8:
            return False
        if head[4:] in (b"acTL", b"IDAT"):
            return head[4:] == b"acTL"
        at += 12 + int.from_bytes(head[:4], "big")


def read_durations(data: bytes) -> tuple[float, ...]:
    """Return how long each frame of an animated PNG or WebP is shown, in seconds; nothing for any other file."""
    if data.startswith(PNG):
        return tuple(_apng_durations(data))
    if is_animated(io.BytesIO(data)):
        frames = (at for kind, at, size in webp_chunks(data, 12, len(data)) if kind == b"ANMF")
        return tuple(int.from_bytes(data[at + 20 : at + 23], "little") / 1000 for at in frames)
    return ()


def _apng_durations(data: bytes) -> Iterator[float]:
    animated = False
    for kind, at, size in png_chunks(data):
        if kind == b"acTL":
            animated = True
        elif kind == b"IDAT" and not animated:
            return  # a still image, which says so before its pixels
        elif kind == b"fcTL" and animated and size == 26:
            parts, per_second = struct.unpack_from(">HH", data, at + 28)
            yield parts / (per_second or _APNG_PARTS)


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
    frame = jpeg_frame(data)
    return None if frame is None else struct.unpack_from(">HH", data, frame[1] + 1)


def jpeg_frame(data: bytes) -> tuple[int, int] | None:
    """Return the marker of a JPEG's frame, which says the process of coding, and where its content begins."""
    return next(((marker, at) for marker, at, _ in jpeg_segments(data) if marker in JPEG_FRAMES), None)


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


def _brands(data: bytes) -> set[bytes]:
    """Return the brands of an ISO file, of which 16 bytes of its first box are not one: its head, and a version."""
    box = data[: int.from_bytes(data[:4], "big")]
    return {box[at : at + 4] for at in (8, *range(16, min(len(box), AVIF_HEAD), 4))}


def _avif(data: bytes) -> tuple[int, int] | None:
    """Return the largest size that a property of an image states: of the image, or of its thumbnails and tiles."""
    sizes = [struct.unpack(">II", found[1]) for found in _AVIF_SIZE.finditer(data)]
    columns, rows = max(sizes, key=lambda size: size[0] * size[1], default=(0, 0))
    return (rows, columns) if sizes else None


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
