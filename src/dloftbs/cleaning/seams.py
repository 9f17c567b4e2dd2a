"""Seams: where the masks of two objects touch, which their union does not show."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.support.arrays import AnyArray

_OUTLINE_PX = 3
"""Distance up to which a pixel of the mask that has no label belongs to the object that it touches, px.

Source: measured with `benchmarks.object_masks`; of outlines that wave by 1.5 px, 2 to 5 px leave as many frames right.
"""


def open_seams(mask: AnyArray, labels: npt.NDArray[np.uint16]) -> AnyArray:
    """Clear the pixels of a mask that have a neighbour of a higher label, so that no two objects are connected.

    A seam is an edge that the segmenter saw: cables that lie side by side stay two, and the lower one of a crossing
    becomes two pieces, which the linking joins across the upper one.

    Parameters
    ----------
    mask : numpy.ndarray, shape (H, W), bool or integer
        Not changed.
    labels : numpy.ndarray, shape (H, W), uint16
        Single objects; 0 is none. Their outlines need not be those of the mask.

    Returns
    -------
    numpy.ndarray, shape (H, W)
        The mask itself where no two objects touch. A seam is one pixel wide, and taken from the lower label.
    """
    if labels.size == 0:  # OpenCV refuses it
        return mask
    around = np.ones((3, 3), np.uint8)
    for _ in range(_OUTLINE_PX):
        bare = (labels == 0) & (mask != 0)
        if not bare.any():
            break
        labels = np.where(bare, cv2.dilate(labels, around), labels)
    seams = (cv2.dilate(labels, around) > labels) & (labels > 0)
    if not seams.any():
        return mask
    opened = mask.copy()
    np.copyto(opened, False, where=seams)
    return opened
