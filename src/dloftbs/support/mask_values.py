"""Values of masks: any non-zero for cable, a probability, or labels."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError
from dloftbs.support.arrays import AnyArray

_MAX_LABEL = 32
"""Largest number of an object in a mask whose values may be labels.

Source: by hand; as of an image in indexed colour, whose labels are 21.
"""
_MAX_CODES = 8
"""Largest number of values of a mask in which each stands for something, and none is a share of a pixel.

Source: measured; a mask scaled up by two has 10, one of JPEG 20 and more, a network's 200.
"""
BORDER = 255
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


def kind_of(mask: AnyArray, before: str = "binary") -> str:
    """Return what the values of a mask are: "binary", a "probability", or "labels".

    Few values may be any of these. In a stream they are what a mask `before` was that had more: a probability, also of
    a single value; or labels, also of one object with its border.

    A probability is of floating point, or of 8 or 16 bits with many values, few of them unsure. Edges that were
    smoothed, scaled, or stored as JPEG are such values, too: one half is the cable's edge there. Labels are small
    numbers of two objects or more, and besides them at most 255, as borders have.
    """
    if mask.dtype.kind == "f":
        return "probability"
    if mask.dtype.kind not in "iu" or mask.size == 0 or int(mask.min()) < 0:
        return "binary"
    high = int(mask.max())
    if high > BORDER and mask.dtype != np.uint16:
        return "binary"
    values = as_probability(mask) if high > BORDER else np.ascontiguousarray(mask, np.uint8)
    was_soft = before == "probability"
    if not was_soft and _are_two(values):
        return "binary"
    import cv2  # late: the types of the package load without it

    counts = cv2.calcHist([values], [0], None, [256], [0.0, 256.0]).ravel()
    levels = np.flatnonzero(counts[1:BORDER]) + 1
    least = 1 if before == "labels" else 2
    if not was_soft and len(levels) >= least and int(levels[-1]) <= _MAX_LABEL:
        return "labels" if high <= BORDER else "binary"
    is_soft = mask.dtype in (np.uint8, np.uint16) and (was_soft or np.count_nonzero(counts) > _MAX_CODES)
    return "probability" if is_soft and float(counts[_BETWEEN].sum()) <= _MAX_BETWEEN * mask.size else "binary"


def without_border(labels: AnyArray) -> AnyArray:
    """Return labels (H, W) with 0 in place of `BORDER`, if all other numbers are small and there is one."""
    is_border = labels == BORDER
    others = np.where(is_border, labels.dtype.type(0), labels)
    return others if is_border.any() and 0 < int(others.max()) <= _MAX_LABEL else labels


def _are_two(values: npt.NDArray[np.uint8]) -> bool:
    """Return whether all that is not 0 is the same, which takes a tenth of the time that counting takes."""
    import cv2  # late: the types of the package load without it

    return bool(cv2.sumElems(values)[0] == float(values.max()) * cv2.countNonZero(values))


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
