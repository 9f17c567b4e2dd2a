"""Layout of video containers: bytes that a file should have and lacks, which demuxers pass over in silence."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import IO

_MP4_PARTS = (
    b"ftyp",
    b"moov",
    b"mdat",
    b"moof",
    b"mfra",
    b"free",
    b"skip",
    b"wide",
    b"uuid",
    b"styp",
    b"sidx",
    b"meta",
)
"""Boxes at the top of an MP4, MOV or AVIF file: ISO/IEC 14496-12, and QuickTime's `wide`."""
_EBML_HEADER, _SEGMENT, _CLUSTER = 0x1A45DFA3, 0x18538067, 0x1F43B675
"""Elements of Matroska whose content is read in turn, or that begin a file: RFC 9559."""
_LONGEST_HEAD = 16
"""Bytes of the longest head of a part: of an MP4 box with a size of 64 bits."""


def damage_in(file: IO[bytes]) -> str | None:
    """Return the fault in the layout of an MP4, AVI, Matroska or WebM file; None where there is none.

    Only the sizes of a container's parts are read, not their content.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    size = os.fstat(file.fileno()).st_size
    file.seek(0)
    head = file.read(12)
    check = next((check for belongs, check in _CHECKS if belongs(head)), None)
    return None if check is None else check(file, size)


def _check_mp4(file: IO[bytes], size: int) -> str | None:
    at = 0
    while at + 8 <= size:
        file.seek(at)
        head = file.read(_LONGEST_HEAD)
        length = int.from_bytes(head[:4], "big")
        if length == 1:
            length = int.from_bytes(head[8:16], "big")
        if head[4:8] not in _MP4_PARTS or length < 8:  # the last box may go on to the end; what follows it is no video
            return None
        at += length
    return _cut_off(at, size)


def _check_riff(file: IO[bytes], size: int) -> str | None:
    at = 0
    while at + 12 <= size:
        file.seek(at)
        head = file.read(8)
        length = int.from_bytes(head[4:], "little")
        if head[:4] != b"RIFF" or length == 0:  # 0 was never filled in, by a program that was killed
            return None
        at += 8 + length
    return _cut_off(at, size)


def _check_matroska(file: IO[bytes], size: int) -> str | None:
    at = 0
    end = size
    while at < min(end, size):
        file.seek(at)
        head = file.read(_LONGEST_HEAD)
        part = _ebml_number(head, 4, keep_marker=True)
        length = None if part is None else _ebml_number(head[part[1] :], 8, keep_marker=False)
        if part is None or length is None:
            return f"damaged at byte {at}" if at + _LONGEST_HEAD <= size else _cut_off(size + 1, size)
        at += part[1] + length[1]
        is_open = length[0] == (1 << 7 * length[1]) - 1  # the size of a live recording is unknown
        if part[0] == _SEGMENT and not is_open:
            end = at + length[0]
        if part[0] not in (_SEGMENT, _CLUSTER):
            if is_open:
                return f"damaged at byte {at}"
            at += length[0]
    return _cut_off(max(at, end), size)


def _ebml_number(data: bytes, longest: int, *, keep_marker: bool) -> tuple[int, int] | None:
    """Return a number of variable length and its bytes; None where there is none. Identifiers keep their marker."""
    if not data or data[0] == 0:
        return None
    count = 9 - data[0].bit_length()
    if count > longest or len(data) < count:
        return None
    number = int.from_bytes(data[:count], "big")
    return (number if keep_marker else number & ((1 << 7 * count) - 1)), count


def _cut_off(end: int, size: int) -> str | None:
    return f"cut off after {size} bytes" if end > size else None


_CHECKS: tuple[tuple[Callable[[bytes], bool], Callable[[IO[bytes], int], str | None]], ...] = (
    (lambda head: head[4:8] in _MP4_PARTS, _check_mp4),
    (lambda head: head[:4] == b"RIFF" and head[8:12] == b"AVI ", _check_riff),
    (lambda head: head[:4] == _EBML_HEADER.to_bytes(4, "big"), _check_matroska),
)
