"""Ways from one end to another, and what is seen there."""

from __future__ import annotations

import math

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
from dloftbs.kernels.compiler import Bytes, Floats, Ints, helper, kernel, read, write
from dloftbs.kernels.shared.graph_ends import TANGENT_X, TANGENT_Y, X, Y
from dloftbs.kernels.shared.soft_masks import LEAST_PROBABLE, ridge_at

_STEP_WIDTHS = 0.5
"""Distance between two samples along a gap, widths.

Source: by hand; squares of `BLOCK_WIDTHS` barely leave a gap at this distance.
"""

_NOISE = 4.0
"""Standard deviation of a colour that is seen twice, grey levels.

Source: by hand; the noise of a camera's 8-bit image.
"""

_SPREADS = 2.0
"""Standard deviation of a colour around its samples, as a multiple of the ground's spread, besides `_NOISE`.

Source: measured; of once and twice, twice separates hidden gaps from ground better, .984 and .982 of the area under
the curve on the average of sources left out.
"""

_FAR = 6.0
"""Number of standard deviations from which on a colour is not like a sample.

Source: geometry; of what is farther, ten thousand samples count less than a thousandth of one.
"""

_MAX_SAMPLES = 24
"""Largest number of samples of a gap.

Source: bounds time and memory.
"""


@helper
def _along(states: Floats, i: int, j: int, t: float, place: Floats) -> None:
    """Write where a cubic from one end into another is, and its direction."""
    cx, cy = states[j, X] - states[i, X], states[j, Y] - states[i, Y]
    length = np.sqrt(cx * cx + cy * cy)
    at_j, of_i, of_j = 3.0 * t * t - 2.0 * t**3, (t - 2.0 * t * t + t**3) * length, (t * t - t**3) * length
    to_j, along_i, along_j = 6.0 * (t - t * t), (1.0 - 4.0 * t + 3.0 * t * t) * length, (2.0 * t - 3.0 * t * t) * length
    place[0] = states[i, X] + at_j * cx + of_i * states[i, TANGENT_X] + of_j * states[j, TANGENT_X]
    place[1] = states[i, Y] + at_j * cy + of_i * states[i, TANGENT_Y] + of_j * states[j, TANGENT_Y]
    dx = to_j * cx + along_i * states[i, TANGENT_X] + along_j * states[j, TANGENT_X]
    dy = to_j * cy + along_i * states[i, TANGENT_Y] + along_j * states[j, TANGENT_Y]
    norm = max(np.sqrt(dx * dx + dy * dy), 1e-9)
    place[2], place[3] = dx / norm, dy / norm


@helper
def _count_alike(colour: Floats, samples: Floats, deviation: float) -> float:
    """Return how many of some samples a colour is like, each by a normal density over its peak."""
    alike = 0.0
    for k in range(len(samples)):
        away = colour_distance(colour, samples[k]) / deviation
        if away < _FAR:
            alike += math.exp(-0.5 * away * away)
    return alike


@kernel(read(float64, 2), read(int64, 2), float64)
def lay_ways(states: Floats, pairs: Ints, width: float) -> tuple[Floats, Ints]:
    """Lay a way from one end into another for each pair, with places every half a width.

    Parameters
    ----------
    states : (e, 4) float64
        Place and outward direction of each end.
    pairs : (k, 2) int64
        Of them.
    width : float
        px.

    Returns
    -------
    ways : (k, s, 4) float64
        Places and directions, both ends among them.
    steps : (k,) int64
        Number of steps between the places of each way, less than `s`.
    """
    ways = np.zeros((len(pairs), _MAX_SAMPLES + 1, 4))
    steps = np.empty(len(pairs), dtype=np.int64)
    for p in range(len(pairs)):
        i, j = pairs[p]
        cx, cy = states[j, X] - states[i, X], states[j, Y] - states[i, Y]
        length = np.sqrt(cx * cx + cy * cy)
        steps[p] = min(max(int(length / max(_STEP_WIDTHS * width, 1.0)), 2), _MAX_SAMPLES)
        for k in range(steps[p] + 1):
            _along(states, i, j, k / steps[p], ways[p, k])
    return ways, steps


@kernel(read(uint8, 2), read(int64, 2), int64, read(float64, 3), read(int64, 1), read(uint8, 2), float64)
def list_uncovered(
    mask: Bytes, pairs: Ints, count: int, ways: Floats, steps: Ints, covered: Bytes, width: float
) -> tuple[Ints, Ints, Ints]:
    """List the ways between ends with a place beside the mask that is not covered, and their ends.

    Parameters
    ----------
    mask : (h, w) uint8
    pairs : (k, 2) int64
        Ends of each way.
    count : int
        Number of ends.
    ways, steps
        As `lay_ways` makes them.
    covered : (k, s) uint8
        Their places that are 0 are looked at.
    width : float
        px.

    Returns
    -------
    asked : (n,) int64
        Those ways.
    ends : (e,) int64
        Their ends, ascending.
    numbers : (n, 2) int64
        Places in `ends` of the ends of each of these ways.
    """
    clear = CLEAR_WIDTHS * width + CLEAR_PX
    uncovered = np.zeros(len(ways), dtype=np.bool_)
    for p in range(len(ways)):
        k = 1
        while k < steps[p] and not uncovered[p]:
            uncovered[p] = covered[p, k] == 0 and not is_on_mask(mask, ways[p, k, 0], ways[p, k, 1], clear)
            k += 1
    asked = np.flatnonzero(uncovered)
    number = np.full(count, -1, dtype=np.int64)
    for n in range(len(asked)):
        number[pairs[asked[n], 0]] = number[pairs[asked[n], 1]] = 0
    ends = np.flatnonzero(number == 0)
    for e in range(len(ends)):
        number[ends[e]] = e
    numbers = np.empty((len(asked), 2), dtype=np.int64)
    for n in range(len(asked)):
        numbers[n, 0], numbers[n, 1] = number[pairs[asked[n], 0]], number[pairs[asked[n], 1]]
    return asked, ends, numbers


@kernel(
    read(uint8, 3), read(uint8, 2), read(int64, 2), read(int64, 1), read(float64, 3), read(int64, 1),
    read(float64, 3), read(int64, 1), read(float64, 3), read(int64, 1), read(float64, 2), read(float64, 1), float64,
    read(uint8, 2),
)  # fmt: skip
def describe_pixels(
    image: Bytes,
    mask: Bytes,
    pairs: Ints,
    asked: Ints,
    ways: Floats,
    steps: Ints,
    ground: Floats,
    grounds: Ints,
    cable: Floats,
    cables: Ints,
    middle: Floats,
    spread: Floats,
    width: float,
    covered: Bytes,
) -> Floats:
    """Describe how much more the ways between ends look like the ground before these ends than like the cables.

    The place that looks most like the ground decides: what hides a cable may have any other colour, and ends in plain
    sight may have caps, but some of the way between is ground. Its light may change evenly from one end to the other:
    each sample of the ground counts half as it is, and half as it would be lit there.

    Parameters
    ----------
    image : (h, w, 3) uint8
        The part of the image that `mask` covers.
    mask : (h, w) uint8
    pairs : (n, 2) int64
        Ends of the ways that are asked, as the grounds are numbered.
    asked : (n,) int64
        Those ways.
    ways, steps
        As `lay_ways` makes them.
    ground, grounds, cable, cables, middle, spread
        As `sample_references` makes them.
    width : float
        px.
    covered : (k, s) uint8
        Where it is not 0, a place is not looked at.

    Returns
    -------
    (n, 3) float64
        Three columns, each times the share of the way's places beside the mask that are looked at: 1; the greatest
        logarithm of how many times more probable the ground is than the cables; and its square if it is positive.
        Both have the density of their samples (Rosenblatt 1956), and of one more that is like anything; the ground's
        spread is that of both. All are 0 where nothing is seen.
    """
    half = int(BLOCK_WIDTHS * width)
    clear = CLEAR_WIDTHS * width + CLEAR_PX
    columns, colour, lit = np.zeros((len(asked), 3)), np.empty(3), np.empty(3)
    for n in range(len(asked)):
        p, i, j = asked[n], pairs[n, 0], pairs[n, 1]
        ours, theirs = grounds[i] + grounds[j], cables[i] + cables[j]
        if ours == 0 or theirs == 0:
            continue
        light = middle[j] - middle[i] if grounds[i] > 0 and grounds[j] > 0 else np.zeros(3)
        deviation = _NOISE + _SPREADS * (grounds[i] * spread[i] + grounds[j] * spread[j]) / ours
        looked, places, most = 0, 0, -np.inf
        for k in range(1, steps[p]):
            x, y = ways[p, k, X], ways[p, k, Y]
            if is_on_mask(mask, x, y, clear):
                continue
            places += 1
            if covered[p, k] != 0 or not block_mean(image, x, y, half, colour):
                continue
            looked += 1
            as_ground = as_cable = 1.0
            for e, back in ((i, k / steps[p]), (j, k / steps[p] - 1.0)):
                for c in range(3):
                    lit[c] = colour[c] - back * light[c]
                as_ground += 0.5 * _count_alike(colour, ground[e, : grounds[e]], deviation)
                as_ground += 0.5 * _count_alike(lit, ground[e, : grounds[e]], deviation)
                as_cable += _count_alike(colour, cable[e, : cables[e]], deviation)
            most = max(most, math.log(as_ground / (ours + 1.0)) - math.log(as_cable / (theirs + 1.0)))
        if looked > 0:
            columns[n, 0], columns[n, 1], columns[n, 2] = 1.0, most, max(most, 0.0) ** 2
            columns[n] *= looked / places
    return columns


@kernel(read(uint8, 2), read(float64, 3), read(int64, 1), write(uint8, 2))
def mark_covered(occluders: Bytes, ways: Floats, steps: Ints, covered: Bytes) -> None:
    """Mark the places of the ways between ends that occluders cover.

    Parameters
    ----------
    occluders : (h, w) uint8
    ways, steps
        As `lay_ways` makes them.
    covered : (k, s) uint8
        1 is written there.
    """
    for p in range(len(ways)):
        for k in range(1, steps[p]):
            row, column = int(np.rint(ways[p, k, 1])), int(np.rint(ways[p, k, 0]))
            inside = 0 <= row < occluders.shape[0] and 0 <= column < occluders.shape[1]
            if inside and occluders[row, column] != 0:
                covered[p, k] = 1


@kernel(read(uint8, 2), read(uint8, 2), read(float64, 3), read(int64, 1), float64, write(uint8, 2))
def mark_probable(soft: Bytes, mask: Bytes, ways: Floats, steps: Ints, width: float, covered: Bytes) -> None:
    """Mark the places of the ways between ends, beside the mask, where there is a ridge of what is somewhat probable.

    Parameters
    ----------
    soft : (h, w) uint8
        Probability, of 256.
    mask : (h, w) uint8
    ways, steps
        As `lay_ways` makes them.
    width : float
        px.
    covered : (k, s) uint8
        1 is written there: a cable is seen.
    """
    for p in range(len(ways)):
        for k in range(1, steps[p]):
            x, y, dx, dy = ways[p, k]
            if covered[p, k] != 0 or is_on_mask(mask, x, y, CLEAR_PX):
                continue
            if ridge_at(soft, x, y, dx, dy, width) >= LEAST_PROBABLE:
                covered[p, k] = 1
