"""TIFF files: the pages that they hold, and the tags of each; no pixel is decoded."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import NamedTuple

from dloftbs.errors import SourceError

WIDTH, LENGTH, COMPRESSION, PHOTOMETRIC, ORIENTATION, SAMPLES = 256, 257, 259, 262, 274, 277
PLANAR, TILE_WIDTH, TILE_LENGTH, SAMPLE_FORMAT, DNG_VERSION = 284, 322, 323, 339, 50706
NEW_SUBFILE_TYPE, BITS, COLOUR_MAP = 254, 258, 320
INDEXED = 3
"""Value of `PHOTOMETRIC` for indexed colour; 1 is grey."""
JPEG_COMPRESSIONS = (6, 7)
"""Values of `COMPRESSION` for JPEG, in the old way and the new one."""

MAX_PAGES = 100_000
"""Frames of an hour at 27 frames per second: more offsets than that are a file that was made to do harm."""

_BEGINS = (b"II\x2a\x00", b"MM\x00\x2a", b"II\x2b\x00", b"MM\x00\x2b")
_VALUES = {1: "B", 3: "H", 4: "I", 6: "b", 8: "h", 9: "i", 16: "Q", 17: "q"}
"""Types of whole numbers, as `struct` names them."""
_SIDES = {WIDTH: 1, TILE_WIDTH: 1, LENGTH: 0, TILE_LENGTH: 0}
"""Axis of the size that a tag gives, of the image and of its tiles, which are all decoded whole."""
_COLOURS = {0: 1, 1: 1, 2: 3, INDEXED: 1, 6: 3}
"""Channels of colour by `PHOTOMETRIC`: grey, RGB, indices, YCbCr."""
_NO_FRAME = 0b101
"""Bits of `NEW_SUBFILE_TYPE` for a smaller copy of another page, and for the transparency of one."""
_MAX_ENTRIES = 0xFFFF
"""Tags of a page, as classic TIFF counts them."""

ReadAt = Callable[[int, int], bytes]
"""Returns a number of bytes from a position on; fewer where the file ends."""


class Page(NamedTuple):
    """Tags of one page: the first number of each, and where in the file that stands."""

    at: int
    tags: dict[int, int]
    places: dict[int, tuple[str, int]]
    following: int

    @property
    def size(self) -> tuple[int, int] | None:
        """``(rows, columns)``, of a tile where that is larger; None where the tags do not say."""
        sides = [0, 0]
        for tag, axis in _SIDES.items():
            sides[axis] = max(sides[axis], self.tags.get(tag, 0))
        return (sides[0], sides[1]) if min(sides) > 0 else None

    @property
    def is_frame(self) -> bool:
        """True for a picture of its own."""
        return not self.tags.get(NEW_SUBFILE_TYPE, 0) & _NO_FRAME

    @property
    def has_alpha(self) -> bool:
        """True where there is one channel more than colours."""
        colours = _COLOURS.get(self.tags.get(PHOTOMETRIC, 1))
        return colours is not None and self.tags.get(SAMPLES, 1) == colours + 1


def is_tiff(data: bytes) -> bool:
    """Return whether a file begins as a TIFF or a BigTIFF."""
    return data[:4] in _BEGINS


def first_page(data: bytes) -> Page | None:
    """Return the first page of a TIFF file; None where it is cut off before its end."""
    return _page(_slices(data), *_first(data[:16]))


class Pages(NamedTuple):
    """Pages of a file that are pictures of their own, and whether others are lost: the file is cut off or damaged."""

    frames: list[Page]
    cut: bool


def read_pages(read: ReadAt) -> Pages:
    """Return the pages of a TIFF file, as far as they can be read.

    Raises
    ------
    SourceError
        If there are more than `MAX_PAGES`.
    """
    order, is_big, at = _first(read(0, 16))
    frames: list[Page] = []
    seen: set[int] = set()
    while at:
        page = None if at in seen else _page(read, order, is_big, at)
        if page is None:
            return Pages(frames, cut=True)
        seen.add(at)
        if len(seen) > MAX_PAGES:
            raise SourceError(f"a TIFF must have at most {MAX_PAGES} pages")
        if page.is_frame:
            frames.append(page)
        at = page.following
    return Pages(frames, cut=False)


def pages_of(data: bytes) -> Pages:
    """Return the pages of a whole TIFF file as `read_pages` does; none of any other file."""
    return read_pages(_slices(data)) if is_tiff(data) else Pages([], cut=False)


def select_page(data: bytearray, page: Page) -> None:
    """Make a page the first one of a file, which is the one that decoders read."""
    order, is_big, _ = _first(bytes(data[:16]))
    struct.pack_into(f"{order}Q" if is_big else f"{order}I", data, 8 if is_big else 4, page.at)


def as_stored(data: bytes) -> bytes:
    """Return the file without the orientation of its first page, which OpenCV applies whatever its flags say."""
    page = first_page(data)
    if page is None or page.tags.get(ORIENTATION, 1) == 1:
        return data
    form, at = page.places[ORIENTATION]
    return b"".join([data[:at], struct.pack(form, 1), data[at + struct.calcsize(form) :]])


def _first(begin: bytes) -> tuple[str, bool, int]:
    """Return the byte order as `struct` has it, whether this is a BigTIFF, and where the first page is, 0 for none."""
    order = "<" if begin[:2] == b"II" else ">"
    is_big = 0x2B in begin[2:4]
    form, start = (f"{order}Q", 8) if is_big else (f"{order}I", 4)
    at = struct.unpack_from(form, begin, start)[0] if len(begin) >= start + struct.calcsize(form) else 0
    return order, is_big, at


def _page(read: ReadAt, order: str, is_big: bool, at: int) -> Page | None:
    """Return the page at a position, None where the file ends before its tags do."""
    count_form, entry, inline, offset = ("Q", 20, 8, "Q") if is_big else ("H", 12, 4, "I")
    head = struct.calcsize(order + count_form)
    tags: dict[int, int] = {}
    places: dict[int, tuple[str, int]] = {}
    try:
        (count,) = struct.unpack(order + count_form, read(at, head))
        if count > _MAX_ENTRIES:
            return None
        block = read(at + head, count * entry)
        for start in range(0, count * entry, entry):
            tag, kind, number = struct.unpack_from(f"{order}HH{offset}", block, start)
            if kind not in _VALUES or number == 0:
                continue
            form = order + _VALUES[kind]
            place = at + head + start + entry - inline
            if number * struct.calcsize(form) > inline:
                (place,) = struct.unpack_from(order + offset, block, start + entry - inline)
            elif len(block) < start + entry:
                return None
            (tags[tag],) = struct.unpack(form, read(place, struct.calcsize(form)))
            places[tag] = (form, place)
    except struct.error:
        return None
    link = read(at + head + count * entry, struct.calcsize(offset))
    following = struct.unpack(order + offset, link)[0] if len(link) == struct.calcsize(offset) else 0
    return Page(at, tags, places, following)


def _slices(data: bytes) -> ReadAt:
    return lambda at, size: bytes(data[at : at + size])
