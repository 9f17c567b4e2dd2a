"""Random masks with holes, and their ground pixel by pixel."""

from __future__ import annotations

import cv2
import numpy as np


def holed(seed: int) -> np.ndarray:
    """Return a mask of blobs with holes, wider than a word, with an empty margin."""
    rng = np.random.default_rng(seed)
    noise = cv2.GaussianBlur(rng.random((int(rng.integers(20, 60)), int(rng.integers(60, 150)))), (0, 0), 2.5)
    return np.pad((noise > np.median(noise)).astype(np.uint8), 1)


def in_runs(first: np.ndarray, start: np.ndarray, end: np.ndarray, part: np.ndarray, columns: int) -> np.ndarray:
    """Return the part that each pixel of the ground belongs to, -1 for foreground."""
    parts = np.full((len(first) - 1, columns), -1)
    for row in range(len(first) - 1):
        for i in range(first[row], first[row + 1]):
            parts[row, max(start[i], 0) : min(end[i], columns)] = part[i]
    return parts
