"""Colours of objects that are of two different ones, however they are lit."""

from __future__ import annotations

import math

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Bools, Floats, Ints, helper, kernel, read

_AGREE = 6
"""One in this number of the samples of a cable may be like any other colour.

Source: by hand; samples beside an end may show what hides the cable.
"""

_OTHER_HUE_COSINE = 0.966
"""Cosine of the angle of two colours, as vectors of channels, below which they are of different objects.

Source: by hand; 15 degrees, as red and orange. More or less light changes the length of the vector, not its direction.
"""

_OTHER_BRIGHTNESS = 2.5
"""Ratio of the lengths of these vectors above which they are of different objects.

Source: by hand; a shadow takes less, and white is four times as bright as black, and more.
"""

_DARK = 30.0
"""Value added to each channel, levels of 255, so that no noise makes a colour of black.

Source: measured; coded video shifts the channels of a black cable of 4 to 10 px by up to 17 towards the ground, at half
the resolution for colours. Between two grounds it is up to 26 (H.264 at crf 30; drawn on wood, grey, white and blue).
"""


@helper
def _differ(a: Floats, b: Floats) -> bool:
    """Return whether two colours differ clearly, in hue or in brightness."""
    dot = one = other = 0.0
    for c in range(3):
        own, found = a[c] + _DARK, b[c] + _DARK
        dot, one, other = dot + own * found, one + own * own, other + found * found
    one, other = math.sqrt(one), math.sqrt(other)
    other_hue = dot < _OTHER_HUE_COSINE * one * other
    return other_hue or one > _OTHER_BRIGHTNESS * other or other > _OTHER_BRIGHTNESS * one


@helper
def _are_unlike(colour: Floats, samples: Floats) -> bool:
    """Return whether a colour differs clearly from all samples but one in `_AGREE`."""
    alike = 0
    for k in range(len(samples)):
        alike += not _differ(colour, samples[k])
    return alike * _AGREE <= len(samples)


@helper
def _all_differ(own: Floats, own_samples: Floats, found: Floats, found_samples: Floats) -> bool:
    """Return whether two medians differ clearly, and each from nearly all samples of the other object."""
    return _differ(own, found) and _are_unlike(own, found_samples) and _are_unlike(found, own_samples)


@kernel(read(float64, 2), read(float64, 2), read(int64, 1), read(int64, 2))
def compare_pairs(colours: Floats, samples: Floats, offsets: Ints, pairs: Ints) -> Bools:
    """Return which pairs of some objects differ clearly in colour: by their medians, and by nearly all samples.

    Parameters
    ----------
    colours : (n, 3) float64
        Median colours, BGR; NaN where one is unknown, which agrees with any.
    samples : (k, 3) float64
        Colours along the objects, one object after the other.
    offsets : (n + 1,) int64
        First sample of each, and the end.
    pairs : (p, 2) int64

    Returns
    -------
    (p,) bool
    """
    differ = np.empty(len(pairs), dtype=np.bool_)
    for p in range(len(pairs)):
        i, j = pairs[p]
        mine, theirs = samples[offsets[i] : offsets[i + 1]], samples[offsets[j] : offsets[j + 1]]
        differ[p] = _all_differ(colours[i], mine, colours[j], theirs)
    return differ
