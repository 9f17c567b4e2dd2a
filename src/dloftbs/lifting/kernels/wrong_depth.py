"""Depth along an object that is not the object's: something over it that the mask does not show, and the ground."""

from __future__ import annotations

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, Ints, helper, kernel, read, write
from dloftbs.kernels.shared.few import median
from dloftbs.kernels.shared.gaussian import MEDIAN_DEVIATION
from dloftbs.kernels.shared.selection import median_of
from dloftbs.lifting.kernels.columns import medians_of_columns

_AROUND = 4
"""Number of changes of depth to either side that show the usual one.

Source: by hand; over one and a half widths.
"""

_STEP_SIGMAS = 6.0
"""Change of depth, as a multiple of the noise's standard deviation, above which it is a step.

Source: by hand; noise exceeds it once in 500 million.
"""

_GROUND_SIGMAS = 3.0
"""Distance from the ground, as a multiple of the noise's deviation, within which depth may be the ground's.

Source: by hand; noise exceeds it once in 400.
"""

_STEEPEST = 3.0
"""Change of depth over the way beside it, above which it is a step, and no cable's slope.

Source: by hand; 72 degrees, where a cable is seen nearly from its end.
"""


@helper
def _list_known(surface_m: Floats) -> Ints:
    """Return the numbers of the sections whose depth is known, ascending."""
    own = np.empty(len(surface_m), dtype=np.int64)
    known = 0
    for i in range(len(surface_m)):
        if not np.isnan(surface_m[i]):
            own[known] = i
            known += 1
    return own[:known]


@helper
def _is_steep(surface_m: Floats, own: Ints, rates: Floats, spacing: float, k: int) -> bool:
    """Return whether the depth changes more from a known section to the next than along any cable."""
    return bool(abs(rates[k]) > _STEEPEST * spacing * min(surface_m[own[k]], surface_m[own[k + 1]]))


@helper
def _usual_before(rates: Floats) -> Floats:
    """Return the median of the changes before each place between changes, and of those after the one `_AROUND` before.

    Both are of up to `_AROUND` changes, beyond the ends of fewer; NaN of none.
    """
    n = len(rates)
    windows = np.full((_AROUND, n + _AROUND + 1), np.inf)
    for j in range(_AROUND):
        for k in range(n):
            windows[j, k + _AROUND - j] = rates[k]
    return medians_of_columns(windows)


@helper
def _beyond(change: float, before: float, after: float, gap: int) -> float:
    """Return by how much depth changes over a gap beyond what it does before and after it, per section."""
    if np.isnan(before):
        before = 0.0 if np.isnan(after) else after
    if np.isnan(after):
        after = before
    return change - min(max(change, min(before, after) * gap), max(before, after) * gap)


@helper
def _find_stretches(size: Floats, limit: Floats) -> Ints:
    """Return the first section of each stretch between steps, and at last the number of all."""
    first = np.empty(len(size) + 2, dtype=np.int64)
    first[0] = 0
    count = 1
    for k in range(len(size)):
        if abs(size[k]) > limit[k]:
            first[count] = k + 1
            count += 1
    first[count] = len(size) + 1
    return first[: count + 1]


@kernel(write(float64, 1), read(float64, 1), float64, int64, int64)
def strike_steps(surface_m: Floats, slenderness: Floats, spacing: float, most: int, most_at_end: int) -> int:
    """Strike off short stretches beyond steps of depth: something else is seen there.

    A step is where the depth changes by more than a radius beyond what it does before and after, and by more than
    noise does. Where a cable bends towards the camera, the change lies between those before and after.

    Steps divide the sections into stretches. Those that continue each other, with at most so many sections between them
    that do not, are an object's. It is the chain with the most sections, minus half of `most` for each step
    inside it. A chain may start or end at a step only if the step is steeper than any cable can be.

    Parameters
    ----------
    surface_m : (n,) float64
        Depth in each section, NaN where it is not known; is set to NaN there.
    slenderness : (n,) float64
        Radius over focal length, both px: times the depth, it is the radius in metres.
    spacing : float
        From section to section, as a multiple of the focal length, px.
    most : int
        Sections that a stretch has at most.
    most_at_end : int
        Sections at an end without any left, at most.

    Returns
    -------
    int
        Number of sections whose depth is left.
    """
    own = _list_known(surface_m)
    known = len(own)
    if known < 2 * _AROUND + 2:
        return known
    rates, unusual, size, limit = np.empty(known - 1), np.empty(known - 1), np.empty(known - 1), np.empty(known - 1)
    for k in range(known - 1):
        rates[k] = (surface_m[own[k + 1]] - surface_m[own[k]]) / (own[k + 1] - own[k])
    usual_before = _usual_before(rates)
    for k in range(known - 1):
        before, after = usual_before[k], usual_before[k + 1 + _AROUND]
        gap = own[k + 1] - own[k]
        size[k] = _beyond(rates[k] * gap, before, after, gap)
        usual = before if np.isnan(after) else (after if np.isnan(before) else 0.5 * (before + after))
        unusual[k] = abs(rates[k] - usual) * gap
    noise = median_of(unusual) / MEDIAN_DEVIATION
    for k in range(known - 1):
        radius = slenderness[own[k]] * min(surface_m[own[k]], surface_m[own[k + 1]])
        limit[k] = max(radius, _STEP_SIGMAS * noise)
    first = _find_stretches(size, limit)
    stretches = len(first) - 1
    if stretches == 1:
        return known
    few = np.empty(_AROUND)
    worth, came = np.empty(stretches), np.empty(stretches, dtype=np.int64)
    for j in range(stretches):
        step = first[j] - 1  # from the one before
        worth[j], came[j] = -np.inf, -1
        if j == 0 or (own[first[j]] <= most_at_end and _is_steep(surface_m, own, rates, spacing, step)):
            worth[j] = 0.0
        if j > 0 and worth[j - 1] - 0.5 * most >= worth[j]:
            worth[j], came[j] = worth[j - 1] - 0.5 * most, j - 1
        after = median(rates[first[j] : min(first[j] + _AROUND, first[j + 1] - 1)], few)
        i = j - 2
        while i >= 0 and step - first[i + 1] < most:
            last = first[i + 1] - 1
            gap = own[first[j]] - own[last]
            before = median(rates[max(last - _AROUND, first[i]) : last], few)
            off = abs(_beyond(surface_m[own[first[j]]] - surface_m[own[last]], before, after, gap))
            back = 0.5 * min(abs(size[last]), abs(size[step]))
            if off <= max(limit[step], back) and worth[i] >= worth[j]:
                worth[j], came[j] = worth[i], i
            i -= 1
        worth[j] += first[j + 1] - first[j]
    best = stretches - 1
    for j in range(stretches - 1):
        last = first[j + 1] - 1
        beyond = len(surface_m) - 1 - own[last]
        if worth[j] > worth[best] and beyond <= most_at_end and _is_steep(surface_m, own, rates, spacing, last):
            best = j
    stop = stretches
    while True:
        for k in range(first[best + 1], first[stop]):
            surface_m[own[k]] = np.nan
            known -= 1
        if best < 0:
            return known
        stop, best = best, came[best]


@kernel(write(float64, 1), read(float64, 1), read(float64, 1), float64, float64)
def strike_ground(surface_m: Floats, ground_m: Floats, slenderness: Floats, noise: float, spacing: float) -> None:
    """Strike off sections in which the ground is seen, beside the object or through it.

    The crest of a round object on the ground is its width above it, and that of a flat one is not. So depth within half
    a width above the ground, or behind it, may be either's. It is the ground's if a step leads from there to depth that
    stands out: an object that comes down to the ground does so bit by bit. What nowhere stands out lies on the ground.

    Parameters
    ----------
    surface_m : (n,) float64
        Depth in each section, NaN where it is not known; is set to NaN there.
    ground_m : (n,) float64
        Depth of the ground beside it; NaN where it is not known.
    slenderness : (n,) float64
        Radius over focal length, both px.
    noise : float
        Of depth, 1 / m: the deviation over the depth squared.
    spacing : float
        From section to section, as a multiple of the focal length, px.
    """
    own = _list_known(surface_m)
    known = len(own)
    like = np.zeros(known, dtype=np.bool_)
    wrong = np.zeros(known, dtype=np.bool_)
    for k in range(known):
        i = own[k]
        z = surface_m[i]
        # Of single pixels: the mean of several is no better where depth comes in steps.
        like[k] = ground_m[i] - z < max(slenderness[i] * z, _GROUND_SIGMAS * noise * z * z)  # not, where it is NaN
    for step in (1, -1):
        stepped = False
        for place in range(known):
            k = place if step == 1 else known - 1 - place
            before = k - step
            if not like[k]:
                stepped = False
                continue
            if 0 <= before < known and not like[before]:
                here, there = surface_m[own[k]], surface_m[own[before]]
                way = spacing * abs(own[k] - own[before]) * min(here, there)
                stepped = abs(here - there) > max(_STEEPEST * way, _STEP_SIGMAS * noise * here * here)
            wrong[k] = wrong[k] or stepped
    for k in range(known):
        if wrong[k]:
            surface_m[own[k]] = np.nan
