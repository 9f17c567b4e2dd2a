"""Counts of colours beneath strokes and in the rest of a picture, and the text that keeps them."""

from __future__ import annotations

import base64
import binascii
import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from dloftbs.config import Stroke
from dloftbs.data.frame_region import Region
from dloftbs.errors import ConfigError, InputError
from dloftbs.segmentation import log_colours
from dloftbs.support.arrays import BoolArray, ByteArray, FloatArray, IntArray
from dloftbs.support.values import shown

_STEPS = 4
"""Number of steps of a kept count in a doubling.

Source: bounds memory; a count is off by a tenth at most, and fits a byte.
"""
_MAX_BYTES = 1 << 22
"""Length of an unpacked sample that is read at most, bytes.

Source: bounds memory; three full histograms have half of it.
"""
SUBPIXEL_BITS = 4
"""Binary digits of a fraction of a pixel with which strokes are drawn.

Source: by definition, as OpenCV takes them.
"""


@dataclass(frozen=True)
class ColourSample:
    """Counts of the colours of one picture, rounded to what the text keeps.

    Parameters
    ----------
    cable, ground, rest : numpy.ndarray, shape (bins,), float64
        Pixels of each bin beneath strokes on cables, beneath strokes on what is none, and beneath none.
    """

    cable: FloatArray
    ground: FloatArray
    rest: FloatArray

    @classmethod
    def of(cls, image: ByteArray, strokes: Sequence[Stroke], region: Region | None = None) -> ColourSample:
        """Count the colours of a picture (H, W, 3); where there are no strokes, those of a region of it alone.

        Raises
        ------
        InputError
            If a stroke leaves the picture.
        """
        cells = log_colours.cells_of(image)
        cable = pixels_of(image.shape[:2], [stroke for stroke in strokes if stroke.cable])
        ground = pixels_of(image.shape[:2], [stroke for stroke in strokes if not stroke.cable])
        rest = ~(cable | ground)
        if region is not None:
            rest &= region.paste(np.ones(region.size, np.bool_))
        return cls(*(_rounded(log_colours.count(cells[where])) for where in (cable, ground, rest)))

    def to_text(self) -> str:
        """Return the counts as text that `from_text` reads."""
        packed = b"".join(_pack(counts) for counts in (self.cable, self.ground, self.rest))
        return base64.b64encode(zlib.compress(packed, 9)).decode()

    @classmethod
    def from_text(cls, text: str) -> ColourSample:
        """Read what `to_text` wrote.

        Raises
        ------
        ConfigError
            If it is something else.
        """
        try:
            unzip = zlib.decompressobj()
            packed = unzip.decompress(base64.b64decode(text, validate=True), _MAX_BYTES)
            parts = []
            for _ in range(3):
                counts, packed = _unpack(packed)
                parts.append(counts)
            if packed or not unzip.eof:
                raise ValueError("too long or too short")
        except (binascii.Error, ValueError, zlib.error, IndexError) as error:
            raise ConfigError(f"cannot read the sample of colours {shown(text)}: draw the strokes again") from error
        return cls(*parts)


def pixels_of(size: tuple[int, ...], strokes: Sequence[Stroke]) -> BoolArray:
    """Return the pixels beneath strokes, shape (H, W).

    Raises
    ------
    InputError
        If a stroke leaves the picture.
    """
    height, width = size
    mask = np.zeros((height, width), np.uint8)
    for stroke in strokes:
        for x, y in stroke.points:
            if not (-0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5):
                raise InputError(
                    f"a stroke must lie in the picture of {width} x {height} px, got the point {x:g},{y:g}"
                )
        scaled = np.rint(np.array(stroke.points) * (1 << SUBPIXEL_BITS)).astype(np.int32).reshape(-1, 1, 2)
        if len(scaled) > 1:
            thickness = max(1, round(2.0 * stroke.radius_px))
            cv2.polylines(mask, [scaled], False, 1, thickness, cv2.LINE_8, SUBPIXEL_BITS)
        else:
            x, y = (int(part) for part in scaled[0, 0])
            radius = round(stroke.radius_px * (1 << SUBPIXEL_BITS))
            cv2.circle(mask, (x, y), radius, 1, cv2.FILLED, cv2.LINE_8, SUBPIXEL_BITS)
    return mask > 0


def _rounded(counts: IntArray) -> FloatArray:
    """Return counts as the text keeps them: a quarter of a doubling apart."""
    return _from_steps(_to_steps(counts))


def _to_steps(counts: IntArray | FloatArray) -> ByteArray:
    steps = np.zeros(counts.shape, np.uint8)
    filled = counts > 0
    steps[filled] = np.minimum(1 + np.rint(_STEPS * np.log2(counts[filled])), 255)
    return steps


def _from_steps(steps: ByteArray) -> FloatArray:
    return np.where(steps > 0, np.exp2((steps.astype(np.float64) - 1.0) / _STEPS), 0.0)


def _pack(counts: FloatArray) -> bytes:
    """Return the filled bins: their number, the distance of each from the one before, and the steps of their counts."""
    filled = np.flatnonzero(counts)
    gaps = np.diff(filled, prepend=0).astype("<u4")
    return len(filled).to_bytes(4, "little") + gaps.tobytes() + _to_steps(counts[filled]).tobytes()


def _unpack(packed: bytes) -> tuple[FloatArray, bytes]:
    number = int.from_bytes(packed[:4], "little")
    rest = packed[4:]
    if len(packed) < 4 + 5 * number:
        raise ValueError("too short")
    filled = np.cumsum(np.frombuffer(rest[: 4 * number], "<u4"))
    steps = np.frombuffer(rest[4 * number : 5 * number], np.uint8)
    counts = np.zeros(math.prod(log_colours.shape()))
    counts[filled] = _from_steps(steps)
    return counts, rest[5 * number :]
