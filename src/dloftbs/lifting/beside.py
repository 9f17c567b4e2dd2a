"""Depth beside objects: the ground, its noise, and the displacement of the depth image against the mask."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.config import LiftingConfig
from dloftbs.depth import to_metres
from dloftbs.lifting.kernels.profiles import add_displacements, displacement_of, lay_profiles, read_profiles
from dloftbs.mask_crop import MaskCrop

_MEMORY = 0.9
"""Share of what is known of the displacement that a frame leaves to the next one.

Source: by hand; ten frames count, and a camera that slowly drifts is followed.
"""


_LEAST_PX = 0.75
"""Least displacement that is allowed for, px.

Source: measured; a straight cable along the rows seems to be displaced by up to as much, by the grid of pixels alone.
"""

_EVERY = 3
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
    aside_px : numpy.ndarray, shape (k,)
        How far the object lies beside the middle of the mask in the depth image, to its right, at these; NaN where it
        does not stand out.
    """

    ground_m: FloatArray
    noise_per_m: float
    tangents: FloatArray
    aside_px: FloatArray


class DepthDisplacement:
    """Displacement of a camera's depth image against its masks, from all frames so far, the latest ones most.

    Registration of depth to colour is off by a pixel or two with most cameras, and as much for all frames.
    """

    def __init__(self) -> None:
        self._sums = np.zeros(5)

    def add(self, beside: Sequence[Beside]) -> None:
        """Learn from the objects of a frame; those that do not stand out tell nothing."""
        if any(not np.isnan(one.aside_px).all() for one in beside):
            tangents, aside = (np.concatenate(arrays) for arrays in zip(*(one[2:] for one in beside), strict=True))
            self._sums = add_displacements(tangents, aside, _MEMORY * self._sums)

    @property
    def px(self) -> tuple[float, float]:
        """The displacement ``(x, y)``, 0 without evidence or below three quarters of a pixel."""
        x, y = displacement_of(self._sums)
        return (x, y) if math.hypot(x, y) >= _LEAST_PX else (0.0, 0.0)

    def reset(self) -> None:
        """Forget all frames, as with another camera."""
        self._sums = np.zeros(5)


def look_beside(
    sections: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
    crop: MaskCrop,
    depth: npt.NDArray[Any],
    config: LiftingConfig,
) -> list[Beside]:
    """Return what depth (H, W) shows beside objects, each given by its sections' points, tangents, and radius in px."""
    (h, w), (left, top) = crop.size, crop.origin
    mask = crop.pixels[1 : h + 1, 1 : w + 1]
    found = []
    for points, tangents, radius in sections:
        at, along, half = (np.ascontiguousarray(array[::_EVERY]) for array in (points, tangents, radius))
        offsets, rows, columns, on = lay_profiles(at, along, half, mask, left, top, *depth.shape)
        metres = to_metres(depth[rows, columns], config)
        metres[rows < 0] = np.nan
        ground, noise, aside = read_profiles(metres, offsets, on, half)
        nearest = np.minimum((np.arange(len(points)) + _EVERY // 2) // _EVERY, len(ground) - 1)
        found.append(Beside(ground[nearest], noise, along, aside))
    return found
