"""One decoded picture of a video, converted when it is asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from dloftbs._arrays import AnyArray
from dloftbs.errors import SourceError

COUNTS = ("gray16le", "gray16be")
"""Formats of one channel of 16 bits, which only lossless codecs have: depth, or the numbers of objects."""


@dataclass(frozen=True)
class Picture:
    """A picture of a video as it is stored.

    Parameters
    ----------
    index : int
        Position in the video; pictures that cannot be decoded leave a hole.
    seconds : float or None
        Time at which it is shown, counted from the first picture; None where the file has no times.
    frame : av.VideoFrame
    reformatter : av.video.reformatter.VideoReformatter
        Converts the pictures of one reading.
    """

    index: int
    seconds: float | None
    frame: Any
    reformatter: Any

    def bgr(self) -> AnyArray:
        """Return the picture as it is shown, shape (H, W, 3), BGR, 8 bits.

        Matrix and range of the colours are the stream's; where it states none, BT.601 and limited range.

        Raises
        ------
        SourceError
            If its format cannot be converted.
        """
        try:
            pixels = self.reformatter.reformat(
                self.frame,
                format="bgr24",
                interpolation="BICUBIC",
                src_colorspace=self.frame.colorspace,  # PyAV before 17 takes neither from the frame
                src_color_range=self.frame.color_range,
                dst_colorspace="ITU601",
                dst_color_range="JPEG",
            ).to_ndarray()
        except (OSError, ValueError) as error:
            raise SourceError(f"pictures of {self.frame.format.name} cannot be converted: {error}") from error
        return _turned(pixels, self.frame)

    def counts(self) -> AnyArray:
        """Return the numbers of a picture in `COUNTS` as it is shown, shape (H, W), uint16.

        Raises
        ------
        SourceError
            If it is in another format.
        """
        if self.frame.format.name not in COUNTS:
            raise SourceError(f"must have one channel of 16 bits, got a picture of {self.frame.format.name}")
        return _turned(self.frame.to_ndarray(), self.frame)


def _turned(pixels: AnyArray, frame: Any) -> AnyArray:
    """Return pixels turned and mirrored as the display matrix of their frame says, to the nearest quarter turn."""
    import cv2

    (x_to_x, x_to_y), (y_to_x, y_to_y) = _display_matrix(frame)
    if abs(x_to_y) + abs(y_to_x) > abs(x_to_x) + abs(y_to_y):
        pixels = cv2.transpose(pixels)
        mirrored = y_to_x < 0, x_to_y < 0
    else:
        mirrored = x_to_x < 0, y_to_y < 0
    match mirrored:
        case True, True:
            pixels = cv2.flip(pixels, -1)
        case True, False:
            pixels = cv2.flip(pixels, 1)
        case False, True:
            pixels = cv2.flip(pixels, 0)
    return np.ascontiguousarray(pixels)


def _display_matrix(frame: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return where a step to the right, and one down, lead in the picture that is shown."""
    try:
        matrix = frame.side_data.get("DISPLAYMATRIX")
    except ValueError:  # the frame has data of a kind that is newer than PyAV
        angle = math.radians(frame.rotation)
        return (math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))
    if matrix is None:
        return (1.0, 0.0), (0.0, 1.0)
    a, b, _, c, d, *_ = np.frombuffer(bytes(matrix), np.int32).tolist()
    return (a, b), (c, d)
