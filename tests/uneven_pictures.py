"""Pictures of lines that no colour tells from their ground: dim, or under uneven light."""

from __future__ import annotations

import cv2
import numpy as np
from drawings import draw_cable, wave

SIZE = (240, 320)


def lit(size=SIZE, *, low=0.5, high=1.5, at=(0.3, 0.3)):
    """Return the light of a lamp (H, W), brightest at a place."""
    rows, columns = np.mgrid[: size[0], : size[1]]
    distance = np.hypot(columns / size[1] - at[0], rows / size[0] - at[1])
    return low + (high - low) * np.exp(-((distance / 0.35) ** 2))


def picture(mask, ground, change, *, light=1.0, noise=2.0, seed=0):
    """Return an image (H, W, 3) of lines that differ from a ground by a change of its levels."""
    blurred = cv2.GaussianBlur(mask.astype(np.float64), (0, 0), 0.7)[..., None]
    levels = (np.asarray(ground, np.float64) + blurred * np.asarray(change, np.float64)) * np.asarray(light)[..., None]
    levels = levels + np.random.default_rng(seed).normal(0.0, noise, (*mask.shape, 1))
    return np.clip(np.rint(levels), 0, 255).astype(np.uint8) * np.ones(3, np.uint8)


def line(width, size=SIZE, phase=0.0):
    """Return the mask of a wave."""
    return draw_cable(wave(size, phase=phase), width, size)


def iou(mask, truth):
    """Return the intersection over the union."""
    return np.count_nonzero((mask != 0) & (truth != 0)) / np.count_nonzero((mask != 0) | (truth != 0))
