"""Masks as run lengths, as the files of COCO hold them.

The pixels are read down the columns, from left to right. The counts are the lengths of ground, cable, ground and so on;
the first is 0 where the first pixel is cable. Files hold them as a list or as text. In the text, each count from the
fourth on is the difference from the one two before it. A number is written in groups of 5 bits, the lowest first, as
few as hold it in two's complement. A group becomes the character 48 + group, with 32 added if another group follows.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError
from dloftbs.support.array_likes import as_array
from dloftbs.support.arrays import BoolArray, IntArray, check_mask
from dloftbs.support.values import check_size, shown

_BITS = 5
"""Bits of a group. Source: the format."""

_MORE = 1 << _BITS
"""Bit that says that another group follows. Source: the format."""

_SIGN = 1 << (_BITS - 1)
"""Bit of the last group that is set in a negative number. Source: the format."""

_FIRST_CHARACTER = 48
"""Character of the group 0. Source: the format."""

_LONGEST = 63 // _BITS
"""Groups of the longest number that an int64 holds."""


def encode(mask: npt.ArrayLike) -> dict[str, Any]:
    """Return the run lengths of a mask: ``{"size": [H, W], "counts": text}``, as JSON holds them.

    Parameters
    ----------
    mask : array_like, shape (H, W), bool or any integer type
        Any non-zero is cable.

    Raises
    ------
    InputError
        If it has another shape or type.
    """
    pixels = check_mask(mask)
    columns = np.ascontiguousarray((pixels if pixels.dtype == np.bool_ else pixels != 0).T).ravel()
    changes = np.flatnonzero(columns[1:] != columns[:-1]) + 1
    starts_with_cable = columns.size > 0 and bool(columns[0])
    counts = np.diff(changes, prepend=[0] * (1 + starts_with_cable), append=columns.size)
    return {"size": list(pixels.shape), "counts": _compressed(counts)}


def decode(rle: Mapping[str, Any]) -> BoolArray:
    """Return the mask (H, W) that run lengths stand for.

    It takes as many bytes as `size` has pixels: of a file that nobody vouches for, compare `size` with the picture's
    first.

    Parameters
    ----------
    rle : mapping
        ``size``: ``[H, W]``. ``counts``: text or bytes (compressed), or a list of integers (uncompressed).

    Raises
    ------
    InputError
        If a key is missing, a character is none of the format's, the last number is cut off, a count is negative or no
        integer, or the counts do not add up to ``H * W``.
    """
    if not isinstance(rle, Mapping) or not {"size", "counts"} <= rle.keys():
        raise InputError(f"run lengths must be a dictionary with the keys 'size' and 'counts', got {shown(rle)}")
    rows, columns = check_size("size", rle["size"], least=0)
    given = rle["counts"]
    counts = _decompressed(given) if isinstance(given, (str, bytes)) else _listed(given)
    wrong = counts[(counts < 0) | (counts > rows * columns)]
    total = int(counts.sum(dtype=np.float64))  # exact for every size; integers might wrap around
    if wrong.size or total != rows * columns:
        found = f"a count of {wrong[0]}" if wrong.size else f"{total}"
        raise InputError(f"the counts must add up to {rows} * {columns} = {rows * columns} pixels, got {found}")
    is_cable = np.arange(counts.size) % 2 == 1
    return np.ascontiguousarray(np.repeat(is_cable, counts).reshape(columns, rows).T)


def _compressed(counts: IntArray) -> str:
    """Return counts as text."""
    rest = counts.copy()
    rest[3:] -= counts[1:-2]
    groups, is_there = [], [np.ones(rest.size, dtype=bool)]
    while is_there[-1].any():
        group = rest & (_MORE - 1)
        rest >>= _BITS
        more = is_there[-1] & (rest != np.where(group & _SIGN, -1, 0))
        groups.append(group + _MORE * more + _FIRST_CHARACTER)
        is_there.append(more)
    characters = np.stack(groups, axis=1).astype(np.uint8)
    return characters[np.stack(is_there[:-1], axis=1)].tobytes().decode("ascii")


def _decompressed(text: str | bytes) -> IntArray:
    """Return the counts that text holds."""
    data = text if isinstance(text, bytes) else text.encode()
    characters = np.frombuffer(data, dtype=np.uint8).astype(np.int64) - _FIRST_CHARACTER
    wrong = np.flatnonzero((characters < 0) | (characters >= 2 * _MORE))
    if wrong.size:
        raise InputError(
            f"compressed counts must be of the characters {chr(_FIRST_CHARACTER)!r} to "
            f"{chr(_FIRST_CHARACTER + 2 * _MORE - 1)!r}, got {data[wrong[0] : wrong[0] + 1]!r} at {wrong[0]}"
        )
    if characters.size and characters[-1] & _MORE:
        raise InputError("compressed counts must end with a whole number; the last one is cut off")
    ends = np.flatnonzero(characters & _MORE == 0)
    starts = np.concatenate(([0], ends[:-1] + 1))[: ends.size]
    lengths = ends + 1 - starts
    if lengths.size and lengths.max() > _LONGEST:
        raise InputError(f"a compressed count must have at most {_LONGEST} characters, got {lengths.max()}")
    places = np.arange(characters.size) - np.repeat(starts, lengths)
    parts = (characters & (_MORE - 1)) << (_BITS * places)
    counts = np.add.reduceat(parts, starts) if starts.size else parts
    counts -= np.where(characters[ends] & _SIGN, 1 << (_BITS * lengths), 0)
    for first in (1, 2):
        counts[first::2] = np.cumsum(counts[first::2])
    return counts


def _listed(given: npt.ArrayLike) -> IntArray:
    """Return counts that are listed uncompressed."""
    counts = as_array("counts", given)
    if counts.ndim != 1 or (counts.dtype.kind not in "iu" and counts.size):
        raise InputError(f"counts must be text, bytes or a list of integers, got {shown(given)}")
    return counts.astype(np.int64)
