"""Slits in the mask of a bundle: ground that a network shows between cables that are tied to each other."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

_WIDEST_WIDTHS = 0.6
"""Width of a slit up to which it is closed, mean widths of the mask.

Source: measured with `benchmarks.harnesses` on a network's masks of BWH.
"""


def close_slits(mask: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Close a mask by a disc that is narrower than its cables; at the image's border it goes on as it is there.

    Parameters
    ----------
    mask : numpy.ndarray, shape (H, W), bool or integer
        Any non-zero is cable. Never changed.

    Returns
    -------
    numpy.ndarray, shape (H, W), uint8
        0 and 1.
    """
    cable = (mask != 0).astype(np.uint8)
    outlines, _ = cv2.findContours(cable, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    outline = sum(map(len, outlines))
    reach = round(_WIDEST_WIDTHS * int(cable.sum()) / outline) if outline else 0
    if reach == 0:
        return cable
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    framed = cv2.copyMakeBorder(cable, reach, reach, reach, reach, cv2.BORDER_REPLICATE)
    return np.ascontiguousarray(cv2.morphologyEx(framed, cv2.MORPH_CLOSE, disc)[reach:-reach, reach:-reach])
