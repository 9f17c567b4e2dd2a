"""Space of colours in which light moves all colours alike, and histograms over it.

The logarithms of red, green and blue, turned so that the first axis is lightness. A light twice as bright moves all
colours along that axis, light of another tint moves them across; an offset keeps what is nearly black, where
the sensor's noise makes the hue, close to grey.
"""

from __future__ import annotations

import functools
import math

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from dloftbs.support.arrays import FloatArray

OFFSET = 16.0
"""Counts added to each channel before the logarithm: some five times a camera's noise.

Source: by hand; a count of noise moves a black pixel by no more than the finest smoothing.
"""
BINS = np.array([0.14, 0.06, 0.06])
"""Sides of a histogram's cell along lightness and the two axes of tint, in units of the logarithm.

Source: by hand; no wider than the finest smoothing.
"""
CELLS = 64
"""Levels of each channel that are distinguished where colours are counted: 4 counts each.

Source: bounds time; a table of as many colours is made in 20 ms.
"""

AXES = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, -1.0], [1.0, -2.0, 1.0]]) / np.sqrt([[3.0], [2.0], [6.0]])
"""Unit vectors of lightness and of the two axes of tint in red, green and blue.

Source: geometry.
"""


@functools.cache
def cell_places() -> npt.NDArray[np.float32]:
    """Return the place in the histogram of every cell of 4 counts, shape (3, 64 red, 64 green, 64 blue), in bins."""
    centres = np.log(np.arange(CELLS) * (256 / CELLS) + 0.5 * (256 / CELLS - 1) + OFFSET)
    rgb = np.stack(np.meshgrid(centres, centres, centres, indexing="ij")).reshape(3, -1)
    places = (AXES @ rgb) / BINS[:, None]
    places -= places.min(axis=1, keepdims=True)
    places.setflags(write=False)
    return places.reshape(3, CELLS, CELLS, CELLS).astype(np.float32)


@functools.cache
def shape() -> tuple[int, int, int]:
    """Return the number of bins along lightness and the two axes of tint."""
    top = cell_places().reshape(3, -1).max(axis=1)
    lightness, red_blue, green = (math.ceil(x) + 1 for x in top)
    return lightness, red_blue, green


@functools.cache
def cell_bins() -> npt.NDArray[np.int32]:
    """Return the flat number of the bin nearest to each cell of 4 counts, shape (64**3,)."""
    nearest = np.rint(cell_places().reshape(3, -1)).astype(np.int32)
    return np.ravel_multi_index(tuple(nearest), shape()).astype(np.int32)


def cells_of(image: npt.NDArray[np.uint8]) -> npt.NDArray[np.int32]:
    """Return the flat number of the cell of 4 counts of each pixel (..., 3) BGR."""
    parts = (image >> 2).astype(np.int32)
    return (parts[..., 2] << 12) | (parts[..., 1] << 6) | parts[..., 0]


def count(cells: npt.NDArray[np.int32]) -> npt.NDArray[np.int64]:
    """Return how many of the cells fall in each bin, flat."""
    per_cell = np.bincount(cells.ravel(), minlength=CELLS**3)
    filled = np.flatnonzero(per_cell)
    counts = np.bincount(cell_bins()[filled], weights=per_cell[filled], minlength=math.prod(shape()))
    return counts.astype(np.int64)


def smooth(histogram: FloatArray, scales: tuple[tuple[float, float, float], ...]) -> FloatArray:
    """Return a density: the histogram, summing to 1, under a mixture of kernels.

    Parameters
    ----------
    histogram : (bins,) float64
        Where all is zero, so is the density.
    scales : tuple of (share, lightness, tint)
        Share of each kernel, and its standard deviations in units of the logarithm.
    """
    given = (histogram.reshape(shape()) / max(histogram.sum(), 1e-12)).astype(np.float32)
    density = np.zeros(shape(), np.float32)
    box = _filled(given)
    for share, lightness, tint in scales:
        sigma = (lightness, tint, tint) / BINS
        reach = (3.0 * sigma + 0.5).astype(np.int64)
        near = tuple(slice(max(0, side.start - far), side.stop + far) for side, far in zip(box, reach, strict=True))
        density[near] += share * ndimage.gaussian_filter(given[near], sigma, mode="constant", truncate=3.0)
    return density.ravel().astype(np.float64)


def _filled(histogram: npt.NDArray[np.float32]) -> tuple[slice, ...]:
    """Return the box around all that is counted; pictures fill a small part of the space of colours."""
    found = []
    for axis in range(3):
        counted = np.flatnonzero(histogram.any(axis=tuple({0, 1, 2} - {axis})))
        found.append(slice(int(counted[0]), int(counted[-1]) + 1) if len(counted) else slice(0, 0))
    return tuple(found)


def at_cells(values: FloatArray) -> npt.NDArray[np.float32]:
    """Return values of the bins, interpolated at each cell of 4 counts, shape (64, 64, 64): red, green, blue."""
    volume = values.reshape(shape()).astype(np.float32)
    found = ndimage.map_coordinates(volume, cell_places().reshape(3, -1), order=1, mode="nearest")
    return np.asarray(found).reshape(CELLS, CELLS, CELLS)
