"""Depth along an object that is not the object's: something over it that the mask does not show, and the ground."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float64, int64

from dloftbs.kernels.compiler import helper, kernel, read, write
from dloftbs.kernels.shared.gaussian import MEDIAN_DEVIATION

_AROUND = 3
"""Number of changes of depth to either side that tell the usual one.

Source: by hand.
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

_Floats = npt.NDArray[np.float64]
_Ints = npt.NDArray[np.int64]


@helper
def _list_known(surface_m: _Floats) -> _Ints:
    """Return the numbers of the sections whose depth is known, ascending."""
    own = np.empty(len(surface_m), dtype=np.int64)
    known = 0
    for i in range(len(surface_m)):
        if not np.isnan(surface_m[i]):
            own[known] = i
            known += 1
    return own[:known]


@helper
def _median_of(values: _Floats, low: int, high: int) -> float:
    """Return the median of a few values from `low` to before `high`; NaN of none."""
    count = high - low
    if count <= 0:
        return np.nan
    few = np.empty(count)
    for i in range(count):
        value = values[low + i]
        k = i
        while k > 0 and few[k - 1] > value:
            few[k] = few[k - 1]
            k -= 1
        few[k] = value
    return 0.5 * (few[(count - 1) // 2] + few[count // 2])


@kernel(write(float64, 1), read(float64, 1), float64, int64)
def strike_steps(surface_m: _Floats, slenderness: _Floats, spacing: float, most: int) -> None:
    """Strike off short stretches between a step nearer and one back, or farther and back: something else is seen there.

    So it is for three sections beyond a step at an end, at the most, if that is steeper than any cable.

    A step is where the depth changes by more than a radius beyond what it does before and after, and by more than
    noise does. Where a cable bends towards the camera, the change lies between those before and after.

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
    """
    own = _list_known(surface_m)
    known = len(own)
    if known < 2 * _AROUND + 2:
        return
    rates, unusual = np.empty(known - 1), np.empty(known - 1)
    for k in range(known - 1):
        rates[k] = (surface_m[own[k + 1]] - surface_m[own[k]]) / (own[k + 1] - own[k])
    excess = np.zeros(known - 1)
    for k in range(known - 1):
        before = _median_of(rates, max(k - _AROUND, 0), k)
        after = _median_of(rates, k + 1, min(k + 1 + _AROUND, known - 1))
        if np.isnan(before):
            before = after
        if np.isnan(after):
            after = before
        gap = own[k + 1] - own[k]
        unusual[k] = abs(rates[k] - 0.5 * (before + after)) * gap
        excess[k] = (rates[k] - min(max(rates[k], min(before, after)), max(before, after))) * gap
    noise = np.median(unusual) / MEDIAN_DEVIATION
    came, sign = -1, 0.0
    single = np.zeros(known - 1, dtype=np.bool_)  # steps without one back
    for k in range(known - 1):
        nearer = min(surface_m[own[k]], surface_m[own[k + 1]])
        if abs(excess[k]) <= max(slenderness[own[k]] * nearer, _STEP_SIGMAS * noise):
            continue
        if came >= 0 and excess[k] * sign < 0.0 and k - came <= most:
            for other in range(came + 1, k + 1):
                surface_m[own[other]] = np.nan
            single[came] = False
            came = -1
        else:
            came, sign = k, excess[k]
            single[k] = abs(rates[k]) > _STEEPEST * spacing * nearer
    for k in range(_AROUND):
        if single[k]:
            for other in range(k + 1):
                surface_m[own[other]] = np.nan
        if single[known - 2 - k]:
            for other in range(known - 1 - k, known):
                surface_m[own[other]] = np.nan


@kernel(write(float64, 1), read(float64, 1), read(float64, 1), float64, float64)
def strike_ground(surface_m: _Floats, ground_m: _Floats, slenderness: _Floats, noise: float, spacing: float) -> None:
    """Strike off sections in which the ground is seen, beside the object or through it.

    The crest of a round object on the ground is its width above it, and that of a flat one is not. So depth within half
    a width from the ground may be either's. It is the ground's if a step leads from there to depth that stands out: an
    object that comes down to the ground does so bit by bit. What nowhere stands out lies on the ground.

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
        like[k] = abs(ground_m[i] - z) < max(slenderness[i] * z, _GROUND_SIGMAS * noise * z * z)  # not, where it is NaN
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
