"""Ways from one end to another, and what an image shows there: ground, cable, or neither."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float64, int64, uint8

from dloftbs.evidence.kernels.colours import (
    BESIDE_WIDTHS,
    BLOCK_WIDTHS,
    CLEAR_PX,
    CLEAR_WIDTHS,
    FLOOR,
    LENIENT,
    MIN_REFERENCES,
    block_mean,
    colour_distance,
    distance_of_one_in,
    is_in_other_light,
    is_like,
    is_on_mask,
)
from dloftbs.kernels.compiler import helper, kernel, read, write
from dloftbs.kernels.shared.copying import copy_rows_to, copy_to
from dloftbs.kernels.shared.graph_ends import TANGENT_X, TANGENT_Y, X, Y
from dloftbs.kernels.shared.soft_masks import LEAST_PROBABLE, ridge_at

IS_GROUND, IS_CABLE, IS_NEITHER = 1, 2, 3
"""Codes of the places of a way; 0 is unknown.

Source: by definition.
"""

_STEP_WIDTHS = 0.5
"""Distance between two samples along a gap, widths.

Source: by hand; squares of `BLOCK_WIDTHS` barely leave a gap at this distance.
"""

_MAX_SAMPLES = 24
"""Largest number of samples of a gap.

Source: bounds time and memory.
"""


@helper
def _along(states: npt.NDArray[np.float64], i: int, j: int, t: float, place: npt.NDArray[np.float64]) -> None:
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
def _keep_ground(
    beside: npt.NDArray[np.float64],
    is_there: npt.NDArray[np.bool_],
    ground: npt.NDArray[np.float64],
    alike: float,
) -> None:
    """Keep of the samples beside a gap those that look like ground, or like kept ones before or behind them.

    So the ground may change on the way, if it does so gradually; where something lies on it, it does not.
    """
    count = len(beside)
    kept = np.zeros(count, dtype=np.bool_)
    for backwards in range(2):
        last = -1
        for n in range(count):
            k = count - 1 - n if backwards == 1 else n
            if not is_there[k]:
                continue
            kept[k] = kept[k] or is_like(beside[k], ground, alike)
            kept[k] = kept[k] or (last >= 0 and colour_distance(beside[k], beside[last]) <= alike)
            if kept[k]:
                last = k
    copy_to(is_there, kept)


@helper
def _together(one: npt.NDArray[np.float64], other: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the colours of both."""
    both = np.empty((len(one) + len(other), 3))
    copy_rows_to(both, one)
    copy_rows_to(both[len(one) :], other)
    return both


@kernel(read(float64, 2), read(int64, 2), float64)
def lay_ways(
    states: npt.NDArray[np.float64], pairs: npt.NDArray[np.int64], width: float
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
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
def list_unknown(
    mask: npt.NDArray[np.uint8],
    pairs: npt.NDArray[np.int64],
    count: int,
    ways: npt.NDArray[np.float64],
    steps: npt.NDArray[np.int64],
    told: npt.NDArray[np.uint8],
    width: float,
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """List the ways between ends that have an unknown place beside the mask, and their ends: others need no image.

    Parameters
    ----------
    mask : (h, w) uint8
    pairs : (k, 2) int64
        Ends of each way.
    count : int
        Number of ends.
    ways, steps
        As `lay_ways` makes them.
    told : (k, s) uint8
        What is at their places; 0 is unknown.
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
    unknown = np.zeros(len(ways), dtype=np.bool_)
    for p in range(len(ways)):
        k = 1
        while k < steps[p] and not unknown[p]:
            unknown[p] = told[p, k] == 0 and not is_on_mask(mask, ways[p, k, 0], ways[p, k, 1], clear)
            k += 1
    asked = np.flatnonzero(unknown)
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
    read(float64, 3), read(int64, 1), read(float64, 3), read(int64, 1), read(float64, 2), float64, write(uint8, 2),
)  # fmt: skip
def look_across(
    image: npt.NDArray[np.uint8],
    mask: npt.NDArray[np.uint8],
    pairs: npt.NDArray[np.int64],
    asked: npt.NDArray[np.int64],
    ways: npt.NDArray[np.float64],
    steps: npt.NDArray[np.int64],
    ground: npt.NDArray[np.float64],
    grounds: npt.NDArray[np.int64],
    cable: npt.NDArray[np.float64],
    cables: npt.NDArray[np.int64],
    spread: npt.NDArray[np.float64],
    width: float,
    told: npt.NDArray[np.uint8],
) -> None:
    """Find which places of the ways between ends look like ground, like cable, and like neither.

    A sample looks like the ground, or the cables, where it is as near to one of their samples as these are to each
    other. Where both are near it shows nothing; what is like neither, nor like the ground in whatever light, hides the
    place.

    Parameters
    ----------
    image : (h, w, 3) uint8
        The part of the image that `mask` covers.
    mask : (h, w) uint8
    pairs : (n, 2) int64
        Ends of the ways that are asked, as the references are numbered.
    asked : (n,) int64
        Those ways.
    ways, steps
        As `lay_ways` makes them.
    ground, grounds, cable, cables, spread
        As `sample_references` makes them.
    width : float
        px.
    told : (k, s) uint8
        `IS_GROUND`, `IS_CABLE` or `IS_NEITHER` at each place of each way; only those that are 0, unknown, are asked.
    """
    half = int(BLOCK_WIDTHS * width)
    clear = CLEAR_WIDTHS * width + CLEAR_PX
    colour = np.empty(3)
    for n in range(len(asked)):
        p, i, j = asked[n], pairs[n, 0], pairs[n, 1]
        if grounds[i] + grounds[j] < MIN_REFERENCES or cables[i] == 0 or cables[j] == 0:
            continue
        own = _together(ground[i, : grounds[i]], ground[j, : grounds[j]])
        like_ground = max(FLOOR, LENIENT * max(spread[i, 0], spread[j, 0]))
        theirs = _together(cable[i, : cables[i]], cable[j, : cables[j]])
        like_cable = max(FLOOR, LENIENT * max(spread[i, 1], spread[j, 1]))
        beside = np.empty((2, steps[p] + 1, 3))
        is_there = np.zeros((2, steps[p] + 1), dtype=np.bool_)
        way = ways[p]
        for k in range(steps[p] + 1):
            for side in range(2):
                aside = (2 * side - 1) * (BESIDE_WIDTHS * width + CLEAR_PX)
                x, y = way[k, 0] - aside * way[k, 3], way[k, 1] + aside * way[k, 2]
                if not is_on_mask(mask, x, y, clear):
                    is_there[side, k] = block_mean(image, x, y, half, beside[side, k])
        for side in range(2):
            _keep_ground(beside[side], is_there[side], own, like_ground)
        for k in range(1, steps[p]):
            x, y = way[k, 0], way[k, 1]
            if told[p, k] != 0 or is_on_mask(mask, x, y, clear) or not block_mean(image, x, y, half, colour):
                continue
            to_ground = np.inf
            for side in range(2):
                if is_there[side, k]:
                    to_ground = min(to_ground, colour_distance(colour, beside[side, k]))
            is_ground = to_ground <= like_ground or is_like(colour, own, like_ground)
            is_cable = is_like(colour, theirs, like_cable)
            if is_ground and is_cable:
                to_ground = min(to_ground, distance_of_one_in(colour, own))
                to_cable = distance_of_one_in(colour, theirs)
                is_ground = to_ground < to_cable
                is_cable = to_cable < to_ground
                if not is_ground and not is_cable:
                    continue
            if is_ground or is_cable:
                told[p, k] = IS_GROUND if is_ground else IS_CABLE
            elif not is_in_other_light(colour, own):
                told[p, k] = IS_NEITHER


@kernel(read(uint8, 2), read(float64, 3), read(int64, 1), write(uint8, 2))
def mark_covered(
    occluders: npt.NDArray[np.uint8],
    ways: npt.NDArray[np.float64],
    steps: npt.NDArray[np.int64],
    told: npt.NDArray[np.uint8],
) -> None:
    """Mark the places of the ways between ends that occluders cover.

    Parameters
    ----------
    occluders : (h, w) uint8
    ways, steps
        As `lay_ways` makes them.
    told : (k, s) uint8
        `IS_NEITHER` is written there.
    """
    for p in range(len(ways)):
        for k in range(1, steps[p]):
            row, column = int(np.rint(ways[p, k, 1])), int(np.rint(ways[p, k, 0]))
            inside = 0 <= row < occluders.shape[0] and 0 <= column < occluders.shape[1]
            if inside and occluders[row, column] != 0:
                told[p, k] = IS_NEITHER


@kernel(read(uint8, 2), read(uint8, 2), read(float64, 3), read(int64, 1), float64, write(uint8, 2))
def mark_probable(
    soft: npt.NDArray[np.uint8],
    mask: npt.NDArray[np.uint8],
    ways: npt.NDArray[np.float64],
    steps: npt.NDArray[np.int64],
    width: float,
    told: npt.NDArray[np.uint8],
) -> None:
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
    told : (k, s) uint8
        `IS_CABLE` is written at such places where it is 0, unknown.
    """
    for p in range(len(ways)):
        for k in range(1, steps[p]):
            x, y, dx, dy = ways[p, k]
            if told[p, k] != 0 or is_on_mask(mask, x, y, CLEAR_PX):
                continue
            if ridge_at(soft, x, y, dx, dy, width) >= LEAST_PROBABLE:
                told[p, k] = IS_CABLE


@kernel(read(float64, 2), read(int64, 2), read(int64, 1), read(uint8, 2), float64)
def measure_ways(
    states: npt.NDArray[np.float64],
    pairs: npt.NDArray[np.int64],
    steps: npt.NDArray[np.int64],
    told: npt.NDArray[np.uint8],
    width: float,
) -> npt.NDArray[np.float64]:
    """Measure how much of the ways between ends is ground, cable and neither.

    Parameters
    ----------
    states : (e, 4) float64
        Place and outward direction of each end.
    pairs : (k, 2) int64
        Of them.
    steps : (k,) int64
        Of each way.
    told : (k, s) uint8
        What is at its places.
    width : float
        px.

    Returns
    -------
    (k, 3) float64
        Widths.
    """
    seen = np.zeros((len(pairs), 3))
    for p in range(len(pairs)):
        i, j = pairs[p]
        cx, cy = states[j, X] - states[i, X], states[j, Y] - states[i, Y]
        step = np.sqrt(cx * cx + cy * cy) / steps[p] / width
        for k in range(1, steps[p]):
            if told[p, k] != 0:
                seen[p, told[p, k] - 1] += step
    return seen
