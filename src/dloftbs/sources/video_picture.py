"""One decoded picture of a video, converted when it is asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from dloftbs.errors import SourceError, source_errors
from dloftbs.support.arrays import AnyArray

COUNTS = ("gray16le", "gray16be")
"""Formats of one channel of 16 bits, which only lossless codecs have: depth, or the numbers of objects."""


_Matrix = tuple[tuple[float, float], tuple[float, float]]


class Converter:
    """Converts the pictures of a video to BGR, and turns them.

    A graph of filters does so into memory that it uses again. Memory of the system's for each picture costs half as
    much time again as the conversion, in page faults.
    """

    def __init__(self) -> None:
        self._graph: Any = None
        self._given: tuple[object, ...] = ()
        self._rotation: float | None = None
        self._matrix: _Matrix = (1.0, 0.0), (0.0, 1.0)

    def bgr(self, frame: Any) -> AnyArray:
        """Return the pixels (H, W, 3) of a frame of PyAV.

        Raises
        ------
        SourceError
            If its format cannot be converted.
        """
        import av

        given = frame.width, frame.height, frame.format.name, frame.colorspace, frame.color_range
        with source_errors(f"pictures of {frame.format.name} cannot be converted", (av.FFmpegError, ValueError)):
            if given != self._given:
                self._graph, self._given = _bgr_graph(frame), given
            self._graph.push(frame)
            pixels: AnyArray = self._graph.pull().to_ndarray()
        return self.turned(pixels, frame)

    def turned(self, pixels: AnyArray, frame: Any) -> AnyArray:
        """Return the pixels of a frame turned and mirrored as its display matrix says, to the nearest quarter turn."""
        if frame.rotation != self._rotation:  # data beside a frame keeps it in memory until garbage is collected
            self._rotation, self._matrix = frame.rotation, _display_matrix(frame)
        return _turned(pixels, *self._matrix)


@dataclass(frozen=True)
class VideoPicture:
    """A picture of a video as it is stored.

    Parameters
    ----------
    index : int
        Position in the video; pictures that cannot be decoded leave a hole.
    seconds : float or None
        Time at which it is shown, counted from the first picture; None where the file has no times.
    frame : av.VideoFrame
    converter : Converter
        Of the same reading.
    """

    index: int
    seconds: float | None
    frame: Any
    converter: Converter

    def bgr(self) -> AnyArray:
        """Return the picture as it is shown, shape (H, W, 3), BGR, 8 bits.

        Matrix and range of the colours are the stream's; where it states none, BT.601 and limited range.

        Raises
        ------
        SourceError
            If its format cannot be converted.
        """
        return self.converter.bgr(self.frame)

    def counts(self) -> AnyArray:
        """Return the numbers of a picture in `COUNTS` as it is shown, shape (H, W), uint16.

        Raises
        ------
        SourceError
            If it is in another format.
        """
        if self.frame.format.name not in COUNTS:
            raise SourceError(f"must have one channel of 16 bits, got a picture of {self.frame.format.name}")
        return self.converter.turned(self.frame.to_ndarray(), self.frame)


def _bgr_graph(frame: Any) -> Any:
    """Return a graph of filters that converts frames such as this one to BGR of 8 bits."""
    from av.filter import Graph

    graph = Graph()
    begin = graph.add_buffer(width=frame.width, height=frame.height, format=frame.format, time_base=Fraction(1, 1000))
    scale = graph.add("scale", "flags=bicubic:threads=1")  # the other cores decode meanwhile
    graph.link_nodes(begin, scale, graph.add("format", "bgr24"), graph.add("buffersink"))
    graph.configure()
    return graph


def _turned(pixels: AnyArray, right: tuple[float, float], down: tuple[float, float]) -> AnyArray:
    """Return pixels such that steps to the right, and down, lead where the vectors say."""
    import cv2

    (x_to_x, x_to_y), (y_to_x, y_to_y) = right, down
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


def _display_matrix(frame: Any) -> _Matrix:
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
