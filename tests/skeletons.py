"""Calling the kernels of masks and skeletons as the stages do."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from dloftbs.kernels.bitmask import as_bytes
from dloftbs.kernels.shared.bitmask_layout import TILE_ROWS
from dloftbs.skeleton.kernels.thinning import EAST, NORTH, SOUTH, WEST, thin

ORDER = (NORTH, SOUTH, WEST, EAST)


def padded(mask: np.ndarray) -> np.ndarray:
    """Put a mask into the frame that the kernels want: a margin of one pixel, a width that is a multiple of 8."""
    h, w = mask.shape
    frame = np.zeros((h + 2, -(-(w + 2) // 8) * 8), dtype=np.uint8)
    frame[1 : h + 1, 1 : w + 1] = mask
    return frame


def framed_bitmask(mask: np.ndarray) -> np.ndarray:
    """Put a mask into a framed bitmask, as `dloftbs.kernels.bitmask.frame` does."""
    h, w = mask.shape
    n = -(-(w + 2) // 64)
    grid = np.zeros((h + 2, 64 * n), dtype=np.uint8)
    grid[1 : h + 1, 1 : w + 1] = mask
    framed = np.zeros((n + 2, -(-h // TILE_ROWS) * TILE_ROWS + 2), dtype=np.uint64)
    framed[1:-1, : h + 2] = np.packbits(grid, axis=1, bitorder="little").view(np.uint64).T
    return framed


def as_words(mask: np.ndarray) -> np.ndarray:
    """Return a mask with 64 pixels a word, shape (H, n), as a bitmask is cut from."""
    h, w = mask.shape
    grid = np.zeros((h, -(-w // 64) * 64), dtype=np.uint8)
    grid[:, :w] = mask != 0
    return np.packbits(grid, axis=1, bitorder="little").view(np.uint64)


def as_pixels(bitmask: np.ndarray) -> np.ndarray:
    """Return a bitmask as pixels of 0 and 1, word beside word."""
    rows = np.ascontiguousarray(bitmask.T).view(np.uint8)
    return np.unpackbits(rows, axis=1, bitorder="little")


def pasted(bitmask: np.ndarray, x0: int, y0: int, size: tuple[int, int]) -> np.ndarray:
    """Put a bitmask into an image (H, W), its column 0 and row 0 at `x0` and `y0`; nothing lies outside of it."""
    image = np.zeros(size, dtype=np.uint8)
    rows, columns = np.nonzero(as_pixels(bitmask))
    image[rows + y0, columns + x0] = 1
    return image


def fast_skeleton(mask: np.ndarray, order: tuple[int, ...] = ORDER) -> np.ndarray:
    """Return the skeleton of a mask, in the kernels' frame."""
    framed = framed_bitmask(mask)
    thin(framed, np.array(order, dtype=np.uint8))
    return as_bytes(framed, *mask.shape)


def slow_degrees(grid: np.ndarray) -> np.ndarray:
    """Return the number of foreground neighbours of every pixel, by convolution."""
    return ndimage.convolve(grid.astype(int), np.ones((3, 3), int), mode="constant") - grid


def listed(grid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the foreground of a skeleton, (n, 2) int32 ``(row, column)``, and the number of neighbours of each."""
    pixels_rc = np.argwhere(grid).astype(np.int32)
    return pixels_rc, slow_degrees(grid)[tuple(pixels_rc.T)].astype(np.uint8)
