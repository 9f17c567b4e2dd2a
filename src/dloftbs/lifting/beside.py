"""Depth beside objects: the ground, its noise, and where edges of depth lie against those of the mask."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs.data.depth import ReadableDepth
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.lifting.kernels.profiles import add_edges, edges_of, lay_profiles, read_profiles, spread
from dloftbs.support.arrays import FloatArray

_MEMORY = 0.9
"""Share of what is known of the edges that a frame leaves to the next one.

Source: by hand; ten frames count, and a camera that slowly drifts is followed.
"""


_MIN_PX = 0.75
"""Least displacement and fattening that are allowed for, px.

Source: measured; a straight cable along the rows seems to be displaced by up to as much, by the grid of pixels alone.
"""

_EVERY = 5
"""Number of sections from profile to profile.

Source: bounds time; the ground beside an object changes little over two widths.
"""


class Beside(NamedTuple):
    """Depth beside an object.

    Parameters
    ----------
    ground_m : numpy.ndarray, shape (n,)
        Depth of the ground at each section; NaN where it is not known.
    noise_per_m : float
        Deviation of depth over the depth squared.
    tangents : numpy.ndarray, shape (k, 2)
        The way on at some of the sections.
    aside_px, wider_px : numpy.ndarray, shape (k,)
        How far the object lies beside the middle of the mask in the depth image, to its right, and how much farther
        out its borders lie there, at these; NaN where it does not stand out.
    """

    ground_m: FloatArray
    noise_per_m: float
    tangents: FloatArray
    aside_px: FloatArray
    wider_px: FloatArray


class DepthEdges:
    """Edges of a camera's depth image against those of its masks, from all frames so far, the latest ones most.

    Registration of depth to colour is off by a pixel or two with most cameras, and stereo shows what is near wider than
    it is: as much for all frames.
    """

    def __init__(self) -> None:
        self._sums = np.zeros(7)

    def add(self, beside: Sequence[Beside]) -> None:
        """Learn from the objects of a frame; those that do not stand out show nothing."""
        if len(beside) > 0:
            tangents, aside, wider = (np.concatenate(each) for each in zip(*(one[2:] for one in beside), strict=True))
            self._sums = add_edges(tangents, aside, wider, self._sums, _MEMORY)

    @property
    def displacement_px(self) -> tuple[float, float]:
        """Displacement of depth, ``(x, y)``: 0 without evidence or below three quarters of a pixel."""
        x, y, _ = edges_of(self._sums)
        return (x, y) if math.hypot(x, y) >= _MIN_PX else (0.0, 0.0)

    @property
    def fattening_px(self) -> float:
        """Distance by which borders lie farther out in depth, on each side: 0 as for the displacement."""
        fattened = edges_of(self._sums)[2]
        return fattened if fattened >= _MIN_PX else 0.0

    def reset(self) -> None:
        """Forget all frames, as with another camera."""
        self._sums = np.zeros(7)


def look_beside(
    sections: Sequence[tuple[FloatArray, FloatArray, FloatArray]], crop: MaskCrop, depth: ReadableDepth
) -> list[Beside]:
    """Return what depth shows beside objects, each given by its sections' points, tangents, and radius in px."""
    (h, w), (left, top) = crop.size, crop.origin
    mask = crop.pixels[1 : h + 1, 1 : w + 1]
    found = []
    for points, tangents, radius in sections:
        at, along, half = (array[::_EVERY] for array in (points, tangents, radius))
        metres, offsets, on = lay_profiles(at, along, half, mask, left, top, *depth)
        ground, noise, *edges = read_profiles(metres, offsets, on, half)
        found.append(Beside(spread(ground, len(points), _EVERY), noise, along, *edges))
    return found
