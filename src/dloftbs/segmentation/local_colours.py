"""Probabilities of cable at the edges: by the colours of the cable and of the ground around each place."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

_SIDE = 5
"""Side of the square whose colours are compared, px of an image in which cables are 2.5 px wide.

Source: by definition; two widths, so that there is ground on either side. At 3 and 7 px IoU differs by 0.003.
"""
_NOISE = 25.0
"""Variance added to that of the colours, squares of counts of CIELAB.

Source: by hand; codecs change colours by some counts. At 64, IoU differs by 0.003.
"""
_SHARES = 0.5, 0.25
"""Factors of the log-odds before and of those by these colours.

Source: by hand; twice the second gains at the edges what it loses on busy grounds.
"""
_LEAST = 0.004
"""Least share of cable, and of ground, around a place.

Source: numerics; one count of 255.
"""


def at_edges(
    small: npt.NDArray[np.uint8], probability: npt.NDArray[np.float32], fine: npt.NDArray[np.uint8]
) -> npt.NDArray[np.float32]:
    """Return the probability of cable in a finer image.

    Cable and ground in the square around each place have a mean and a variance each, and a linear discriminant with
    the mean of both variances decides between them. As the variances are shared, an edge is where colours are halfway,
    whichever side varies more.

    Parameters
    ----------
    small : numpy.ndarray, shape (h, w, 3), uint8
        BGR; cables are 5 px wide.
    probability : numpy.ndarray, shape (h, w), float32
    fine : numpy.ndarray, shape (H, W, 3), uint8
        The same picture, larger.
    """
    size = fine.shape[1::-1]
    before = np.clip(probability, _LEAST, 1.0 - _LEAST)
    before = cv2.resize(_SHARES[0] * np.log(before / (1.0 - before)), size, interpolation=cv2.INTER_LINEAR)
    planes = cv2.split(cv2.resize(_discriminant(small, probability), size, interpolation=cv2.INTER_LINEAR))
    by_colours = -planes[3]
    for channel, factor in zip(cv2.split(cv2.cvtColor(fine, cv2.COLOR_BGR2LAB)), planes[:3], strict=True):
        by_colours += channel * factor
    log_odds = before + np.clip(_SHARES[1] * by_colours, -1.0, 1.0)  # a nat at most: a highlight is no ground
    return 1.0 / (1.0 + cv2.exp(-cv2.GaussianBlur(log_odds, (5, 5), 1.0)))


def _discriminant(small: npt.NDArray[np.uint8], probability: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the factors of the three channels of CIELAB, and what is subtracted, shape (h / 2, w / 2, 4)."""
    half = max(1, small.shape[1] // 2), max(1, small.shape[0] // 2)
    rough, probability = (cv2.resize(plane, half, interpolation=cv2.INTER_AREA) for plane in (small, probability))
    lab = cv2.cvtColor(rough, cv2.COLOR_BGR2LAB).astype(np.float32)
    cable, ground = (_moments(lab, weights) for weights in (probability, 1.0 - probability))
    factors = (cable[0] - ground[0]) / (0.5 * (cable[1] + ground[1]) + _NOISE)
    subtracted = np.sum(0.5 * factors * (cable[0] + ground[0]), axis=2, keepdims=True)
    return np.concatenate((factors, subtracted), axis=2)


def _moments(
    lab: npt.NDArray[np.float32], weights: npt.NDArray[np.float32]
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Return the weighted means and variances around each place, shape (h, w, 3) each."""
    side = (_SIDE, _SIDE)
    total = np.maximum(cv2.blur(weights, side), _LEAST)[..., None]
    own = lab * weights[..., None]
    mean = cv2.blur(own, side) / total
    return mean, np.maximum(cv2.blur(own * lab, side) / total - mean * mean, 0.0)
