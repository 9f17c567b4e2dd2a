"""Depth as ``compressed_depth_image_transport`` packs it: a header of 12 bytes, then a PNG, or runs of RVL."""

from __future__ import annotations

import struct

import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError, SourceError
from dloftbs.sources.image_header import PNG
from dloftbs.sources.pixels import check_pixels, decode
from dloftbs.support.arrays import AnyArray
from dloftbs.support.values import shown

_HEADER = struct.Struct("<iff")
"""Kind of compression, and the two parameters of inverse depth."""
_RVL_SIZE = struct.Struct("<II")
_MAX_NIBBLES = 11
"""Nibbles of an RVL number: three bits in each hold 32."""


def decode_compressed_depth(form: str, data: bytes) -> AnyArray:
    """Return depth (H, W): counts, uint16, or metres, float32, where inverse depth was packed; NaN is missing.

    Parameters
    ----------
    form : str
        Field ``format`` of the message in lower case, as in ``"16uc1; compresseddepth png"``.
    data : bytes

    Raises
    ------
    InputError
        If the bytes are cut off or corrupt, or no such depth.
    """
    if len(data) <= _HEADER.size:
        raise InputError(f"compressed depth begins with a header of {_HEADER.size} bytes, got {len(data)} bytes")
    _, quant_a, quant_b = _HEADER.unpack_from(data)
    packed = data[_HEADER.size :]
    try:
        counts = decode(packed) if packed.startswith(PNG) else _decode_rvl_image(form, packed)
    except SourceError as error:
        raise InputError(f"compressed depth ({shown(form)}) {error}") from error
    if counts.ndim != 2 or counts.dtype != np.uint16:
        raise InputError(f"compressed depth must be (H, W) of 16 bits, got {counts.shape} of {counts.dtype}")
    if not form.lstrip().startswith("32fc1"):
        return counts
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        metres = np.float32(quant_a) / (counts.astype(np.float32) - np.float32(quant_b))
    metres[counts == 0] = np.nan
    return metres


def _decode_rvl_image(form: str, packed: bytes) -> npt.NDArray[np.uint16]:
    if "rvl" not in form:
        raise InputError(f"compressed depth must hold a PNG, or say that it is RVL, got {shown(form)}")
    if len(packed) < _RVL_SIZE.size:
        raise InputError(f"depth of RVL begins with its size in {_RVL_SIZE.size} bytes, got {len(packed)} bytes")
    columns, rows = _RVL_SIZE.unpack_from(packed)
    if not (rows and columns):
        raise InputError(f"an image must have pixels, got {columns} x {rows}")
    check_pixels(rows, columns)
    return decode_rvl(packed[_RVL_SIZE.size :], rows * columns).reshape(rows, columns)


def decode_rvl(data: bytes, count: int) -> npt.NDArray[np.uint16]:
    """Return depth (count,) from its RVL code: runs of zeros and of differences, in numbers of three bits a nibble.

    The code is that of Wilson, "Fast lossless depth image compression" (ISS 2017).

    Parameters
    ----------
    data : bytes
        Little-endian words of 32 bits, whose nibbles are read from the highest on.
    count : int
        Number of pixels.

    Raises
    ------
    InputError
        If the code ends before all pixels are there, or has more.
    """
    values = _numbers(np.frombuffer(data, "<u4", len(data) // 4))
    coded = np.zeros(count, np.int64)
    filled = np.zeros(count, np.bool_)
    pixel = at = 0
    while pixel < count:
        if at + 2 > len(values):
            raise InputError(f"the RVL code ends after {pixel} of {count} pixels")
        begin = pixel + int(values[at])
        length = int(values[at + 1])
        at += 2
        if begin + length > count or at + length > len(values):
            raise InputError(f"the RVL code is corrupt after {pixel} of {count} pixels")
        coded[begin : begin + length] = values[at : at + length]
        filled[begin : begin + length] = True
        pixel, at = begin + length, at + length
    differences = coded[filled]
    depth = np.zeros(count, np.uint16)
    # Zigzag: 0, -1, 1, -2 are 0, 1, 2, 3. Depth wraps at 16 bits, as in the encoder.
    depth[filled] = (np.cumsum((differences >> 1) ^ -(differences & 1)) & 0xFFFF).astype(np.uint16)
    return depth


def _numbers(words: npt.NDArray[np.uint32]) -> npt.NDArray[np.int64]:
    """Return the numbers that words hold: a nibble has three bits, the lowest first, and says whether more follow."""
    nibbles = ((words[:, None] >> np.arange(28, -1, -4, dtype=np.uint32)) & 15).ravel()
    ends = np.flatnonzero(nibbles < 8)
    if not len(ends):
        return np.zeros(0, np.int64)
    starts = np.concatenate(([0], ends[:-1] + 1))
    lengths = ends - starts + 1
    if lengths.max() > _MAX_NIBBLES:
        raise InputError(f"the RVL code is corrupt: a number of {int(lengths.max())} nibbles")
    place = np.arange(ends[-1] + 1) - np.repeat(starts, lengths)
    return np.add.reduceat((nibbles[: ends[-1] + 1].astype(np.int64) & 7) << (3 * place), starts)
