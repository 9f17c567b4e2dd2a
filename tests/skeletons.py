"""Calling the thinning kernels as the stages do."""

from __future__ import annotations

import numpy as np

from dloftbs.kernels.thinning import DELETION_TABLE, EAST, NORTH, SOUTH, WEST, find_border, thin

ORDER = (NORTH, SOUTH, WEST, EAST)


def padded(mask: np.ndarray) -> np.ndarray:
    """Put a mask into the frame that the kernels want: a margin of one pixel, a width that is a multiple of 8."""
    h, w = mask.shape
    frame = np.zeros((h + 2, -(-(w + 2) // 8) * 8), dtype=np.uint8)
    frame[1 : h + 1, 1 : w + 1] = mask
    return frame


def fast_skeleton(mask: np.ndarray, order: tuple[int, ...] = ORDER) -> np.ndarray:
    """Return the skeleton of a mask, in the kernels' frame."""
    state = padded(mask)
    border, area = find_border(state.view(np.uint64))
    thin(state, border, area, np.array(order, dtype=np.uint8), DELETION_TABLE)
    return state
