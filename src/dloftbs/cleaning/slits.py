"""Slits in the mask of a bundle: ground that a network shows between cables that are tied to each other."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

_WIDEST_WIDTHS = 0.6
"""Width of a slit up to which it is closed, mean widths of the mask.

Source: measured with `benchmarks.harnesses` on a network's masks of BWH.
"""


def close_slits(pixels: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Close a mask by a disc that is narrower than its cables; beyond its box it goes on as at the edge.

    Parameters
    ----------
    pixels : numpy.ndarray, shape (h + 2, w + 2)
        A mask of 0 and 1 with an empty margin, and pixels at each side of the box. Not changed.

    Returns
    -------
    numpy.ndarray, shape (h + 2, w + 2), uint8
        Of the same box.
    """
    outlines, _ = cv2.findContours(pixels, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    reach = round(_WIDEST_WIDTHS * int(pixels.sum()) / sum(map(len, outlines)))
    rows, columns = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    disc = (np.hypot(rows, columns) <= reach + 0.5).astype(np.uint8)  # OpenCV's ellipses are not those of the transpose
    framed = cv2.copyMakeBorder(pixels[1:-1, 1:-1], reach, reach, reach, reach, cv2.BORDER_REPLICATE)
    closed = np.zeros_like(pixels)
    height, width = pixels.shape[0] - 2, pixels.shape[1] - 2
    closed[1:-1, 1:-1] = cv2.morphologyEx(framed, cv2.MORPH_CLOSE, disc)[reach : reach + height, reach : reach + width]
    return closed
