"""Contrast of pixels to a mask: what stands out from noise, as wide as it is."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

LEVEL = 16
"""Counts of a contrast to a level of 255.

Source: numerics; smoothed levels keep a sixteenth, and all sums stay within 16 bits.
"""
SMOOTHING_PX = 1.0
"""Least standard deviation of the smoothing before a contrast is measured, px.

Source: derived; it leaves 28 % of white noise, and more than half of the contrast of a line of 2 px.
"""
SAMPLES = 5000
"""Number of pixels that noise is measured on.

Source: bounds time; they give it to a fiftieth.
"""
_NOISE = 6.0
"""Least contrast above the median one, as a multiple of the noise.

Source: derived; four standard deviations: 30 pixels of a million on the ground have more, and none of them is strong.
"""
_STRONG = 2.0
"""Contrast that a part must have somewhere, as a multiple of the least one.

Source: derived; with `_NOISE`, no pixel of noise has it in a thousand images.
"""
_MIN_LEVELS = 3.0
"""Least contrast where there is no noise, in levels.

Source: numerics; conversions of colour round by a level on either side, and codecs leave blocks in place of noise.
"""
_EDGE = np.int16(2)
"""Greatest contrast beside a pixel at a cable's edge, as a multiple of its own.

Source: geometry; a blurred edge lies at half of the step.
"""

Counts = npt.NDArray[np.int16]


def noise_of(counts: Counts, than: Counts | None = None) -> tuple[float, float]:
    """Return the median of counts, and their noise: the median absolute deviation, which outliers do not change.

    Parameters
    ----------
    counts : numpy.ndarray, shape (H, W), int16
    than : numpy.ndarray, shape (H, W), int16, optional
        What is subtracted from them.
    """
    step = max(1, int(np.sqrt(counts.size / SAMPLES)))
    some = counts[::step, ::step].astype(np.float32)
    if than is not None:
        some -= than[::step, ::step]
    median = float(np.median(some))
    return median, float(np.median(np.abs(some - median)))


def limits_of(median: float, noise: float, contrast: float | None) -> tuple[float, float]:
    """Return the least contrast of a pixel, and that of the strongest pixel of a part, in counts.

    Parameters
    ----------
    median, noise : float
        Of the contrast on the ground, in counts, as `noise_of` has them.
    contrast : float or None
        Least contrast in levels, in the place of both.
    """
    if contrast is not None:
        return LEVEL * contrast, LEVEL * contrast
    least = max(median + _NOISE * noise, _MIN_LEVELS * LEVEL)
    return least, _STRONG * least


def greatest_within(contrast: Counts, reach_px: int) -> Counts:
    """Return the greatest contrast within a square around each pixel, shape (H, W)."""
    return np.asarray(cv2.dilate(contrast, np.ones((2 * reach_px + 1, 2 * reach_px + 1), np.uint8)))


def pixels_of(contrast: Counts, beside: Counts, least: float) -> npt.NDArray[np.intp]:
    """Return the flat indices (n,) of pixels that have the least contrast, and half of the greatest beside them.

    Half of the contrast is the place of a blurred edge.
    """
    return np.flatnonzero((contrast >= np.int16(least)) & (contrast >= beside // _EDGE))


def mask_of(pixels: npt.NDArray[np.intp], contrast: Counts, strong: float) -> npt.NDArray[np.uint8]:
    """Return 1 for pixels that hang together with one that is strong, shape (H, W).

    Parameters
    ----------
    pixels : numpy.ndarray, shape (n,)
        Flat indices.
    contrast : numpy.ndarray, shape (H, W), int16
    strong : float
        Contrast of a strong pixel, in counts.
    """
    mask = np.zeros(contrast.shape, np.uint8)
    mask.ravel()[pixels] = 1
    number, labels = cv2.connectedComponents(mask, connectivity=8)
    part = labels.ravel()[pixels]
    is_strong = np.zeros(number, np.uint8)
    is_strong[part[contrast.ravel()[pixels] >= strong]] = 1
    mask.ravel()[pixels] = is_strong[part]
    return mask
