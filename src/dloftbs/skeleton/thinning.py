"""Crop to skeleton, one pixel wide (paper: open and skeletonise)."""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt

from dloftbs.data.mask_crop import MaskCrop, Orientation, Skeleton
from dloftbs.kernels import bitmask
from dloftbs.skeleton.kernels import thinning

_PEELING_ORDER = (thinning.NORTH, thinning.SOUTH, thinning.WEST, thinning.EAST)  # in the orientation of the crop


def skeletonize(crop: MaskCrop) -> Skeleton:
    """Thin a crop to lines one pixel wide, with as many pieces and holes as it has.

    Returns
    -------
    Skeleton
    """
    thinned = crop.bitmask.copy()
    thinning.thin(thinned, _peeling_order(crop.orientation))
    to, (h, w) = crop.orientation, crop.size
    pixels_rc, degrees = bitmask.list_pixels(thinned, h, w, to.flip_x, to.flip_y, to.transpose)
    return Skeleton(crop.oriented(bitmask.as_bytes(thinned, h, w)), pixels_rc, degrees)


@functools.cache  # there are eight orientations
def _peeling_order(orientation: Orientation) -> npt.NDArray[np.uint8]:
    """Return the sides in the order in which they are peeled, as the crop lies in memory."""
    return np.array([_side_in_memory(side, orientation) for side in _PEELING_ORDER], dtype=np.uint8)


def _side_in_memory(side: int, orientation: Orientation) -> int:
    """Return the side of the crop as it lies in memory that is `side` in its orientation."""
    dy, dx = {thinning.NORTH: (-1, 0), thinning.SOUTH: (1, 0), thinning.WEST: (0, -1), thinning.EAST: (0, 1)}[side]
    if orientation.transpose:
        dy, dx = dx, dy
    if orientation.flip_y:
        dy = -dy
    if orientation.flip_x:
        dx = -dx
    return {(-1, 0): thinning.NORTH, (1, 0): thinning.SOUTH, (0, -1): thinning.WEST, (0, 1): thinning.EAST}[dy, dx]
