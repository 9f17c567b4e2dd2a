"""Colours of a cable and of the ground beside it, and places that look like either."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64, uint8

from dloftbs.evidence.kernels.colours import (
    AGREE,
    BLOCK_WIDTHS,
    CLEAR_PX,
    CLEAR_WIDTHS,
    FLOOR,
    LEAST_REFERENCES,
    LENIENT,
    block_mean,
    count_alike,
    distance_of_one_in,
    is_in_other_light,
    is_like,
    is_on_mask,
    spread_of,
)
from dloftbs.kernels.compiler import helper, kernel, read, write
from dloftbs.kernels.shared.copying import copy_to
from dloftbs.kernels.shared.selection import median_of, nth_least

_MOST_SAMPLES = 24
"""Largest number of places along a cable where it and its ground are sampled.

Source: bounds time and memory.
"""

_NEAREST = 12
"""Number of ground samples that a place is compared with, the nearest.

Source: by hand; those of six widths along a cable, as ground changes farther away.
"""

_ASIDE_WIDTHS = 2.0
"""Distance from the axis to the samples of the ground, widths.

Source: geometry; clear of the cable's own shadow, of a round cable about a width long.
"""


@kernel(read(uint8, 3), read(uint8, 2), read(float64, 2), read(boolean, 1), float64)
def sample_appearance(
    image: npt.NDArray[np.uint8],
    mask: npt.NDArray[np.uint8],
    points: npt.NDArray[np.float64],
    seen: npt.NDArray[np.bool_],
    width: float,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Sample the colours along a cable and beside it.

    Parameters
    ----------
    image : (h, w, 3) uint8
    mask : (h, w) uint8
        Not 0 where a cable is seen; (0, 0) if it is not known.
    points : (n, 2) float64
        Along the cable, ``(x, y)`` px; two or more.
    seen : (n,) bool
        False where it is hidden: nothing is sampled there.
    width : float
        px; NaN if it is unknown: the ground is not sampled.

    Returns
    -------
    cable : (k, 3) float64
    ground : (m, 5) float64
        ``x, y`` px, and the colour.
    colour : (3,) float64
        The median colour of the cable; NaN without samples.
    """
    known = width > 0.0
    half = int(BLOCK_WIDTHS * width) if known else 0
    clear, aside = CLEAR_WIDTHS * width + CLEAR_PX, _ASIDE_WIDTHS * width + CLEAR_PX
    cable, ground = np.empty((_MOST_SAMPLES, 3)), np.empty((2 * _MOST_SAMPLES, 5))
    cables, grounds, last = 0, 0, len(points) - 1
    step = max(last // _MOST_SAMPLES + 1, 1)
    for k in range(step // 2, last + 1, step):
        if not seen[k]:
            continue
        x, y = points[k, 0], points[k, 1]
        if cables < _MOST_SAMPLES and block_mean(image, x, y, half, cable[cables]):
            cables += 1
        i, j = max(k - 1, 0), min(k + 1, last)
        dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        norm = np.sqrt(dx * dx + dy * dy)
        if not known or norm == 0.0:
            continue
        for side in (-1.0, 1.0):
            gx, gy = x - side * aside * dy / norm, y + side * aside * dx / norm
            if grounds < 2 * _MOST_SAMPLES and not is_on_mask(mask, gx, gy, clear):
                ground[grounds, 0], ground[grounds, 1] = gx, gy
                if block_mean(image, gx, gy, half, ground[grounds, 2:]):
                    grounds += 1
    colour = np.full(3, np.nan)
    if cables > 0:
        for c in range(3):
            colour[c] = median_of(cable[:cables, c])
    return cable[:cables].copy(), ground[:grounds].copy(), colour


@helper
def _nearest_ground(x: float, y: float, ground: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the colours of the `_NEAREST` samples of the ground, as (k, 3), in the order of the samples."""
    squared = (ground[:, 0] - x) ** 2 + (ground[:, 1] - y) ** 2
    colours = np.empty((min(len(ground), _NEAREST), 3))
    farthest = nth_least(squared.copy(), len(colours) - 1)
    count = 0
    for k in range(len(ground)):
        if squared[k] <= farthest and count < len(colours):
            copy_to(colours[count], ground[k, 2:])
            count += 1
    return colours


@kernel(
    read(uint8, 3), read(uint8, 2), read(float64, 2), read(float64, 2), read(float64, 2), float64, int64, int64,
    write(int64, 1),
)  # fmt: skip
def compare_with_ground(
    image: npt.NDArray[np.uint8],
    mask: npt.NDArray[np.uint8],
    points: npt.NDArray[np.float64],
    cable: npt.NDArray[np.float64],
    ground: npt.NDArray[np.float64],
    width: float,
    hidden: int,
    in_sight: int,
    told: npt.NDArray[np.int64],
) -> None:
    """Tell by the colours of places what hides them: nothing does if they look like most of the ground near by.

    What looks like no ground near by, in whatever light, and not like the cable, hides it. Places beside a seen cable,
    and those that look like the cable or like both, tell nothing.

    Parameters
    ----------
    image : (h, w, 3) uint8
    mask : (h, w) uint8
        Not 0 where a cable is seen; (0, 0) if it is not known.
    points : (n, 2) float64
        ``(x, y)`` px.
    cable, ground
        As `sample_appearance` makes them.
    width : float
        Of the cable, px; NaN if it is unknown: nothing is told.
    hidden, in_sight : int
        Codes of places that something hides, and that are in plain sight and empty; 0 is unknown.
    told : (n,) int64
        What is known already; places with 0 are written.
    """
    if len(ground) < LEAST_REFERENCES or len(cable) == 0 or not width > 0.0:
        return
    half, clear = int(BLOCK_WIDTHS * width), CLEAR_WIDTHS * width + CLEAR_PX
    like_cable = max(FLOOR, LENIENT * spread_of(cable))
    colour = np.empty(3)
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        if told[n] != 0 or is_on_mask(mask, x, y, clear) or not block_mean(image, x, y, half, colour):
            continue
        own = _nearest_ground(x, y, ground)
        alike = count_alike(colour, own, max(FLOOR, LENIENT * spread_of(own)))
        is_cable = is_like(colour, cable, like_cable)
        if 2 * alike > len(own):  # of a few samples, some may show something that comes over the cable
            if not is_cable or distance_of_one_in(colour, own) < distance_of_one_in(colour, cable):
                told[n] = in_sight
        elif AGREE * alike <= len(own) and not is_cable and not is_in_other_light(colour, own):
            told[n] = hidden
