"""A first guess at the cables of a picture, before anybody drew a stroke."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.support.arrays import check_image

_SIDE_PX = 640
"""Longest side of the picture that is looked at, px.

Source: bounds time.
"""
_GROUND_PX = 41
"""Side of the square whose median is the ground, px.

Source: by hand; wider than a cable there, by far.
"""
_MIN_LENGTH = 8.0
"""Least length of a part, as a multiple of its width: area over the square of the width.

Source: by hand; tools on a bench have less.
"""


def suggest_mask(image: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Return what differs from the ground around it and is long for its width.

    Parameters
    ----------
    image : array_like, shape (H, W, 3), uint8
        BGR.

    Returns
    -------
    numpy.ndarray, shape (H, W), uint8
        1 where a cable may be, else 0.

    Raises
    ------
    InputError
        If it is no such image.
    """
    array = check_image(image)
    if 0 in array.shape:
        return np.zeros(array.shape[:2], np.uint8)
    height, width = array.shape[:2]
    scale = min(1.0, _SIDE_PX / max(height, width))
    small = cv2.resize(
        array, (max(1, round(scale * width)), max(1, round(scale * height))), interpolation=cv2.INTER_AREA
    )
    lab = cv2.cvtColor(small, cv2.COLOR_BGR2LAB)
    ground = cv2.medianBlur(lab, _GROUND_PX)
    difference = cv2.absdiff(lab, ground).max(axis=2)
    _, mask = cv2.threshold(difference, 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    long = _long_parts(mask)
    return np.asarray(cv2.resize(long, (width, height), interpolation=cv2.INTER_NEAREST), np.uint8)


def _long_parts(mask: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Return the parts of a mask that are long for their width."""
    number, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
    distance = cv2.distanceTransform(mask, cv2.DIST_L2, 3)
    half_width = np.zeros(number)
    np.maximum.at(half_width, labels.ravel(), distance.ravel())
    long = stats[:, cv2.CC_STAT_AREA] > _MIN_LENGTH * np.maximum(2.0 * half_width, 2.0) ** 2
    long[0] = False
    return long.astype(np.uint8)[labels]
