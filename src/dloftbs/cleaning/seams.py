"""Seams: where the masks of two objects touch, which their union does not show."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.support.arrays import AnyArray, as_bytes

_OUTLINE_PX = 3
"""Distance up to which a pixel of the mask that has no label belongs to the object that it touches, px.

Source: measured with `benchmarks.object_masks`; of outlines that wave by 1.5 px, 2 to 5 px leave as many frames right.
"""


def open_seams(mask: AnyArray, labels: npt.NDArray[np.uint16]) -> AnyArray:
    """Clear the pixels of objects in a mask that have a neighbour of a higher label, so that no two are connected.

    A seam is an edge that the segmenter saw: cables that lie side by side stay two, and the lower one of a crossing
    becomes two pieces, which the linking joins across the upper one.

    Parameters
    ----------
    mask : numpy.ndarray, shape (H, W), bool or integer
        Not changed.
    labels : numpy.ndarray, shape (H, W), uint16
        Single objects; 0 is none. Their outlines need not be those of the mask, beyond which they do not count.

    Returns
    -------
    numpy.ndarray, shape (H, W)
        The mask itself where no two objects touch. A seam is one pixel wide, and taken from the lower label.
    """
    if not mask.any():
        return mask
    left, top, width, height = cv2.boundingRect(as_bytes(mask))
    box = np.s_[top : top + height, left : left + width]
    is_set, around = mask[box] != 0, np.ones((3, 3), np.uint8)
    owners = labels[box] * is_set
    for _ in range(_OUTLINE_PX):
        bare = is_set & (owners == 0)
        if not bare.any():
            break
        np.copyto(owners, cv2.dilate(owners, around), where=bare)
    seams = (cv2.dilate(owners, around) > owners) & (owners > 0)
    if not seams.any():
        return mask
    opened = mask.copy()
    np.copyto(opened[box], False, where=seams)
    return opened
