"""Colours of cables, and of the ground beside them, before their ends: references for what lies beyond."""

from __future__ import annotations

import numpy as np
from numba import float64, int64, uint8

from dloftbs.evidence.kernels.colours import (
    BLOCK_WIDTHS,
    CLEAR_PX,
    CLEAR_WIDTHS,
    block_mean,
    colour_distance,
    is_on_mask,
)
from dloftbs.kernels.compiler import Bytes, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.graph_ends import branch_of, inward
from dloftbs.kernels.shared.selection import median_of

_ASIDE_WIDTHS = (-1.0, 1.0, -2.0, 2.0)
"""Distances across from a cable's axis to the samples of the ground, widths; `CLEAR_PX` is added.

Source: geometry; half a width beyond the edge, and beyond the cable's shadow.
"""

BACK_WIDTHS = 2.0
"""Distance before a cable's end at which its reference samples start, widths.

Source: by hand; the last widths before an occluder may lie in its shadow.
"""

REACH_WIDTHS = 8.0
"""Distance before a cable's end at which its reference samples stop, widths.

Source: by hand; farther away light and ground may differ.
"""

_APART_WIDTHS = 1.0
"""Distance between two reference samples, widths.

Source: by hand; squares of `BLOCK_WIDTHS` do not overlap at this distance.
"""

_SHORT_SHARE = 0.25
"""Share of a short run after which the samples of its colour start, where that is nearer than `BACK_WIDTHS`.

Source: by definition; the half in its middle lies behind both of its ends.
"""

_MAX_SAMPLES = 24
"""Largest number of samples of a reference.

Source: bounds time and memory.
"""

_MIN_SAMPLES = 3
"""Least number of samples before an end that show a cable's colour.

Source: geometry; the fewest of which a median leaves out one that is off.
"""


@helper
def place_before(
    points: Floats, spans: Ints, end: int, first: float, k: int, width: float
) -> tuple[int, float, float, float, float]:
    """Return the k-th place of a run before one of its ends, up to `REACH_WIDTHS`, and the direction away from the end.

    Parameters
    ----------
    points : (m, 2) float64
    spans : (n, 2) int64
        The points of each run.
    end : int
    first : float
        Distance of the first place from the end, px.
    k : int
    width : float
        px.

    Returns
    -------
    at : int
        Number of points from the end; -1 where the run has no such place.
    x, y, dx, dy : float
        The place, and the unit direction over a width; 0 where there is none.
    """
    start, stop = spans[branch_of(end)]
    back = inward(end)
    tip = start if back == 1 else stop - 1
    last = int(min(REACH_WIDTHS * width, stop - start - 1))
    i = int(first + k * max(_APART_WIDTHS * width, 1.0))
    if i >= last:
        return -1, 0.0, 0.0, 0.0, 0.0
    here, there = tip + back * i, tip + back * min(i + max(int(width), 2), last)
    dx, dy = points[there, 0] - points[here, 0], points[there, 1] - points[here, 1]
    norm = np.sqrt(dx * dx + dy * dy)
    if norm > 0.0:
        dx, dy = dx / norm, dy / norm
    return i, points[here, 0], points[here, 1], dx, dy


@kernel(read(uint8, 3), read(float64, 2), read(int64, 2), read(int64, 1), float64)
def sample_cables(image: Bytes, points: Floats, spans: Ints, ends: Ints, width: float) -> tuple[Floats, Floats, Ints]:
    """Sample the colours of cables before their ends: from `BACK_WIDTHS` on, or nearer on short runs.

    Parameters
    ----------
    image : (h, w, 3) uint8
    points : (m, 2) float64
        ``(x, y)`` in the image.
    spans : (n, 2) int64
        The points of each run.
    ends : (e,) int64
    width : float
        px.

    Returns
    -------
    colours : (e, 3) float64
        The median before each end; NaN with fewer than `_MIN_SAMPLES` samples.
    samples : (k, 3) float64
        End after end.
    offsets : (e + 1,) int64
        First sample of each end, and the last end's last one.
    """
    half, count = int(BLOCK_WIDTHS * width), 0
    colours, samples = np.full((len(ends), 3), np.nan), np.empty((len(ends) * _MAX_SAMPLES, 3))
    offsets = np.zeros(len(ends) + 1, dtype=np.int64)
    for e in range(len(ends)):
        start, stop = spans[branch_of(ends[e])]
        first = min(BACK_WIDTHS * width, _SHORT_SHARE * (stop - start))
        for k in range(_MAX_SAMPLES):
            at, x, y, _, _ = place_before(points, spans, ends[e], first, k, width)
            if at < 0:
                break
            count += block_mean(image, x, y, half, samples[count])
        offsets[e + 1] = count
        if count - offsets[e] >= _MIN_SAMPLES:
            for c in range(3):
                colours[e, c] = median_of(samples[offsets[e] : count, c])
    return colours, samples[:count].copy(), offsets


@kernel(read(uint8, 3), read(uint8, 2), read(float64, 2), read(int64, 2), read(int64, 1), float64)
def sample_references(
    image: Bytes, mask: Bytes, points: Floats, spans: Ints, ends: Ints, width: float
) -> tuple[Floats, Ints, Floats, Ints, Floats, Floats]:
    """Sample what cables, and the ground on both sides of them, look like before their ends.

    Parameters
    ----------
    image : (h, w, 3) uint8
        The part of the image that `mask` covers.
    mask : (h, w) uint8
    points : (m, 2) float64
        ``(x, y)`` in the mask.
    spans : (n, 2) int64
        The points of each run.
    ends : (e,) int64
    width : float
        px.

    Returns
    -------
    ground : (e, k, 3) float64
    grounds : (e,) int64
        Number of samples of each.
    cable : (e, l, 3) float64
    cables : (e,) int64
    middle : (e, 3) float64
        Median of each channel of the ground; 0 without samples.
    spread : (e,) float64
        Median distance of a sample of the ground from the nearest other, grey levels; 0 without two.
    """
    half = int(BLOCK_WIDTHS * width)
    clear = CLEAR_WIDTHS * width + CLEAR_PX
    ground = np.empty((len(ends), len(_ASIDE_WIDTHS) * _MAX_SAMPLES, 3))
    cable = np.empty((len(ends), _MAX_SAMPLES, 3))
    grounds, cables = np.zeros(len(ends), dtype=np.int64), np.zeros(len(ends), dtype=np.int64)
    middle, spread = np.zeros((len(ends), 3)), np.zeros(len(ends))
    for e in range(len(ends)):
        for k in range(_MAX_SAMPLES):
            at, x, y, dx, dy = place_before(points, spans, ends[e], BACK_WIDTHS * width, k, width)
            if at < 0:
                break
            cables[e] += block_mean(image, x, y, half, cable[e, cables[e]])
            if dx == 0.0 and dy == 0.0:
                continue
            for side in _ASIDE_WIDTHS:
                aside = side * width + np.sign(side) * CLEAR_PX
                gx, gy = x - aside * dy, y + aside * dx
                if not is_on_mask(mask, gx, gy, clear):
                    grounds[e] += block_mean(image, gx, gy, half, ground[e, grounds[e]])
        own = ground[e, : grounds[e]]
        if len(own) > 0:
            for c in range(3):
                middle[e, c] = median_of(own[:, c])
        if len(own) > 1:
            nearest = np.full(len(own), np.inf)
            for k in range(len(own)):
                for m in range(len(own)):
                    if m != k:
                        nearest[k] = min(nearest[k], colour_distance(own[k], own[m]))
            spread[e] = median_of(nearest)
    return ground, grounds, cable, cables, middle, spread
