"""Stage 3: patch to skeleton, one pixel wide (paper: open and skeletonise)."""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt

from dloftbs.kernels import bitmask
from dloftbs.mask_crop import MaskCrop, Pose, Skeleton
from dloftbs.skeleton.kernels import thinning

_PEELING_ORDER = (thinning.NORTH, thinning.SOUTH, thinning.WEST, thinning.EAST)  # in the patch's pose


def skeletonize(patch: MaskCrop) -> Skeleton:
    """Thin a patch to lines one pixel wide, with as many pieces and holes as it has.

    Returns
    -------
    Skeleton
    """
    thinned = patch.words.copy()
    thinning.thin(thinned, _peeling_order(patch.pose))
    pose, (h, w) = patch.pose, patch.size
    pixels_rc, degrees = bitmask.list_pixels(thinned, h, w, pose.flip_x, pose.flip_y, pose.transpose)
    return Skeleton(patch.posed(bitmask.as_bytes(thinned, h, w)), pixels_rc, degrees)


@functools.cache  # there are eight poses
def _peeling_order(pose: Pose) -> npt.NDArray[np.uint8]:
    """Return the sides in the order in which they are peeled, as the patch lies in memory."""
    return np.array([_unposed_side(side, pose) for side in _PEELING_ORDER], dtype=np.uint8)


def _unposed_side(side: int, pose: Pose) -> int:
    """Return which side of the patch as it lies in memory is `side` in its pose."""
    dy, dx = {thinning.NORTH: (-1, 0), thinning.SOUTH: (1, 0), thinning.WEST: (0, -1), thinning.EAST: (0, 1)}[side]
    if pose.transpose:
        dy, dx = dx, dy
    if pose.flip_y:
        dy = -dy
    if pose.flip_x:
        dx = -dx
    return {(-1, 0): thinning.NORTH, (1, 0): thinning.SOUTH, (0, -1): thinning.WEST, (0, 1): thinning.EAST}[dy, dx]
