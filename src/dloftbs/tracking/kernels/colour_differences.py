"""Colours of objects that are of two different ones, however they are lit."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float64

from dloftbs.kernels.compiler import kernel, read

_OTHER_HUE_COSINE = 0.966
"""Cosine of the angle of two colours, as vectors of channels, below which they are of different objects.

Source: by hand; 15 degrees, as red and orange. More or less light changes the length of the vector, not its direction.
"""

_OTHER_BRIGHTNESS = 2.5
"""Ratio of the lengths of these vectors above which they are of different objects.

Source: by hand; a shadow takes less, and white is four times as bright as black, and more.
"""

_DARK = 10.0
"""Value added to each channel, levels of 255, so that noise makes no colour of black.

Source: by hand; three times the noise of a camera's 8-bit image.
"""


@kernel(read(float64, 2), read(float64, 2))
def compare_colours(own: npt.NDArray[np.float64], found: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Tell which colours differ clearly from which others, in hue or in brightness.

    Parameters
    ----------
    own : (t, 3) float64
    found : (d, 3) float64
        BGR; NaN where it is unknown, which agrees with any.

    Returns
    -------
    (t, d) bool
    """
    differ = np.empty((len(own), len(found)), dtype=np.bool_)
    for t in range(len(own)):
        for d in range(len(found)):
            dot = one = other = 0.0
            for c in range(3):
                a, b = own[t, c] + _DARK, found[d, c] + _DARK
                dot, one, other = dot + a * b, one + a * a, other + b * b
            one, other = math.sqrt(one), math.sqrt(other)
            other_hue = dot < _OTHER_HUE_COSINE * one * other
            differ[t, d] = other_hue or one > _OTHER_BRIGHTNESS * other or other > _OTHER_BRIGHTNESS * one
    return differ
