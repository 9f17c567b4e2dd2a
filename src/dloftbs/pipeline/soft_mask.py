"""Masks that are probabilities, as networks give them in 8 bits."""

from __future__ import annotations

import cv2
import numpy as np

from dloftbs.pipeline.plausibility import GRID_PX, SMALL_PX
from dloftbs.support.arrays import AnyArray

_MAX_LEVELS = 32
"""Largest number of values of a mask that are labels, or cable and ground.

Source: by hand; as of an image in indexed colour, whose labels are 21 and a border where there are most.
"""
_BETWEEN = slice(32, 224)
"""Values that are neither cable nor ground for sure, of 256.

Source: by definition; an eighth of the values at either end is sure.
"""
_MAX_BETWEEN = 0.25
"""Largest share of such values in a mask; more is a photograph.

Source: measured; .08 at most of 69 masks of networks, .75 and more of 27 photographs.
"""
_HALF = 128
"""Least value of cable.

Source: by definition; more probable than not, of 256.
"""


def is_probability(mask: AnyArray) -> bool:
    """Return whether a mask is a probability of 8 bits: of many values, few of them between cable and ground."""
    if mask.dtype != np.uint8:
        return False
    some = mask[::GRID_PX, ::GRID_PX] if mask.size > SMALL_PX else mask
    if np.count_nonzero(np.bincount(some.ravel(), minlength=256)) <= 2:
        return False
    counts = cv2.calcHist([np.ascontiguousarray(mask)], [0], None, [256], [0.0, 256.0])
    between = float(counts[_BETWEEN].sum())
    return int(np.count_nonzero(counts)) > _MAX_LEVELS and between <= _MAX_BETWEEN * mask.size


def above_half(mask: AnyArray) -> AnyArray:
    """Return where a probability of 8 bits is at least one half."""
    cable: AnyArray = mask >= _HALF
    return cable
