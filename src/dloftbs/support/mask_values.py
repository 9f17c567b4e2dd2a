"""Values of masks: any non-zero for cable, a probability, or labels."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError
from dloftbs.support.arrays import AnyArray

GRID_PX = 8
"""Distance of the pixels that are looked at, px.

Source: by hand; 4,800 of 640 x 480 give the share to a percent.
"""
SMALL_PX = 1 << 16
"""Largest number of pixels of a mask that are all counted, px.

Source: bounds time; more take longer than the grid, which has a thousand points from there on.
"""
_MAX_LEVELS = 32
"""Largest number of values of a mask that are labels, or cable and ground.

Source: by hand; as of an image in indexed colour, whose labels are 21 and a border where there are most.
"""
_BORDER = 255
"""Number of what belongs to no object in label images.

Source: published; as of VOC.
"""
_BETWEEN = slice(32, 224)
"""Values that are neither cable nor ground for sure, of 256.

Source: by definition; an eighth of the values at either end is sure.
"""
_MAX_BETWEEN = 0.25
"""Largest share of such values in a mask; more is a photograph.

Source: measured; .08 at most of 69 masks of networks, .75 and more of 27 photographs.
"""


def is_probability(mask: AnyArray) -> bool:
    """Return whether a mask is a probability: floating point, or of 8 bits with many values, few of them unsure."""
    if mask.dtype != np.uint8:
        return mask.dtype.kind == "f"
    import cv2  # late: the types of the package load without it

    some = mask[::GRID_PX, ::GRID_PX] if mask.size > SMALL_PX else mask
    if np.count_nonzero(np.bincount(some.ravel(), minlength=256)) <= 2:
        return False
    counts = cv2.calcHist([np.ascontiguousarray(mask)], [0], None, [256], [0.0, 256.0])
    between = float(counts[_BETWEEN].sum())
    return int(np.count_nonzero(counts)) > _MAX_LEVELS and between <= _MAX_BETWEEN * mask.size


def holds_labels(mask: AnyArray) -> bool:
    """Return whether a mask has small numbers of two objects or more, and besides them at most 255, as borders have."""
    some = mask[::GRID_PX, ::GRID_PX] if mask.size > SMALL_PX else mask
    if mask.dtype.kind not in "iu" or some.size == 0 or int(some.min()) < 0 or int(some.max()) > _BORDER:
        return False
    levels = np.flatnonzero(np.bincount(some.ravel().astype(np.intp)))
    levels = levels[(levels > 0) & (levels < _BORDER)]
    return len(levels) > 1 and int(levels[-1]) <= _MAX_LEVELS


def as_probability(mask: AnyArray) -> npt.NDArray[np.uint8]:
    """Return a mask as a probability of 8 bits: a floating-point one in 0..1, integers as shares of their type's range.

    Raises
    ------
    InputError
        If it has integers of another type than uint8 and uint16.
    """
    if mask.dtype == np.uint8:
        return mask
    if mask.dtype.kind == "f":
        return np.rint(255.0 * mask).astype(np.uint8)
    if mask.dtype == np.uint16:
        return (mask >> 8).astype(np.uint8)
    if mask.dtype == np.bool_:
        return np.where(mask, np.uint8(255), np.uint8(0))
    raise InputError(f"a mask that is a probability must be uint8, uint16 or floating point, got {mask.dtype}")
