"""Masks to test with: drawn as text, drawn with lines, and random."""

from __future__ import annotations

import cv2
import numpy as np
from hypothesis import strategies as st


def mask_from_text(text: str) -> np.ndarray:
    """Return the mask (H, W) uint8 that the lines of a text draw: anything but a dot or a space is foreground."""
    lines = [line.strip() for line in text.strip().splitlines()]
    return np.array([[character not in ". " for character in line] for line in lines], dtype=np.uint8)


def draw_cable(points: np.ndarray, width: int, size: tuple[int, int]) -> np.ndarray:
    """Draw a polyline (n, 2) of the given width into a mask of `size` (H, W)."""
    mask = np.zeros(size, dtype=np.uint8)
    cv2.polylines(mask, [np.rint(points * 16).astype(np.int32).reshape(-1, 1, 2)], False, 1, width, cv2.LINE_8, 4)
    return mask


def wave(size: tuple[int, int], periods: float = 1.5, phase: float = 0.0) -> np.ndarray:
    """Return points (200, 2) along a sine wave that fills most of an image of `size` (H, W)."""
    height, width = size
    s = np.linspace(0.0, 1.0, 200)
    x = width * (0.08 + 0.84 * s)
    y = height * (0.5 + 0.33 * np.sin(2 * np.pi * periods * s + phase))
    return np.stack((x, y), axis=1)


def random_mask(seed: int, largest: int = 40) -> np.ndarray:
    """Return noise, blobs or strokes, of any shape from 1 x 1 on."""
    rng = np.random.default_rng(seed)
    height, width = rng.integers(1, largest + 1, 2)
    kind = seed % 4
    if kind == 0:
        return (rng.random((height, width)) < rng.uniform(0.1, 0.95)).astype(np.uint8)
    if kind == 1:
        smooth = cv2.GaussianBlur(rng.random((height, width)), (0, 0), rng.uniform(0.6, 3.0))
        return (smooth > np.quantile(smooth, rng.uniform(0.2, 0.8))).astype(np.uint8)
    mask = np.zeros((height, width), dtype=np.uint8)
    for _ in range(rng.integers(1, 5)):
        points = rng.uniform(0, (width, height), (rng.integers(2, 6), 2))
        mask |= draw_cable(points, int(rng.integers(1, 8)), (height, width))
    return mask


random_masks = st.integers(0, 2**31).map(random_mask)
"""Hypothesis: any of them."""


EIGHT_VERSIONS = [(flip_x, flip_y, transpose) for flip_x in (0, 1) for flip_y in (0, 1) for transpose in (0, 1)]
"""The symmetries of the square, as arguments of `turn` and `turn_points`."""


def turn(mask: np.ndarray, flip_x: int, flip_y: int, transpose: int) -> np.ndarray:
    """Flip the columns, flip the rows, transpose; in this order, each where asked for."""
    turned = mask[:: -1 if flip_y else 1, :: -1 if flip_x else 1]
    return turned.swapaxes(0, 1) if transpose else turned


def versions(mask: np.ndarray) -> list[np.ndarray]:
    """Return a mask in all `EIGHT_VERSIONS`, the first as it is."""
    return [np.ascontiguousarray(turn(mask, *how)) for how in EIGHT_VERSIONS]


def turn_points(points: np.ndarray, size: tuple[int, int], flip_x: int, flip_y: int, transpose: int) -> np.ndarray:
    """Turn points ``(x, y)`` (n, 2) along with a mask of `size` (H, W)."""
    x, y = points.T
    x = size[1] - 1 - x if flip_x else x
    y = size[0] - 1 - y if flip_y else y
    return np.stack((y, x) if transpose else (x, y), axis=1)


def turn_points_back(points: np.ndarray, size: tuple[int, int], flip_x: int, flip_y: int, transpose: int) -> np.ndarray:
    """Undo `turn_points`; `size` (H, W) is that of the mask before it was turned."""
    turned = size[::-1] if transpose else size
    # Transposing first and flipping then undoes flipping first and transposing then.
    return turn_points(turn_points(points, turned, 0, 0, transpose), size, flip_x, flip_y, 0)
