"""Strokes and what lies beneath them: a band with edges along it, such as a cable, or the ground."""

from __future__ import annotations

from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.config import Stroke
from dloftbs.support.arrays import FloatArray, check_image

_CLEARLY = 1.0
"""Least difference of a band from what lies beside it, standard deviations of that difference along the stroke.

Source: geometry; of a difference without a cause the mean is near 0, and a band differs in five places of six.
"""
_NOTICEABLE = 2.3
"""Least difference that counts, units of CIELAB.

Source: Mahy, Van Eycken and Oosterlinck 1994, the difference that people just notice; codecs make smaller ones.
"""
_GROWTH = 2.0**0.5
"""Ratio of the distance to the sides to the next smaller one.

Source: by definition; two steps double it, and a cable's side is as wide as the cable or wider.
"""
_REACH = 0.25
"""Largest distance to the sides, as a share of the picture's shorter side.

Source: by hand; wider than cables in pictures of cables.
"""
_MIN_PLACES = 8
"""Least number of places along a stroke that say something.

Source: by hand; below, a standard deviation is chance.
"""


def lies_along_band(image: npt.ArrayLike, stroke: Stroke) -> bool:
    """Return True if a stroke runs along a band that is lighter, darker or of another tint than both its sides.

    Ground beside a cable is like the ground on its other side, and the border of a cable lies between the two. A click
    has no direction, and so lies along nothing.

    Parameters
    ----------
    image : array_like, shape (H, W, 3), uint8
        BGR.
    stroke : Stroke
        In the image.

    Raises
    ------
    InputError
        If the image is none.
    """
    lab = cv2.cvtColor(check_image(image).astype(np.float32) / 255.0, cv2.COLOR_BGR2Lab)
    places, normals = _along(stroke)
    half = max(stroke.radius_px, 1.0)
    most = _REACH * min(lab.shape[:2])
    distance = 2.0 * half
    within = _mean_across(lab, places, normals, 0.0, half)
    while distance <= most:
        left, right = (_mean_across(lab, places, normals, side * distance, half) for side in (1.0, -1.0))
        if _is_apart(within - left, within - right):
            return True
        distance *= _GROWTH
    return False


def _along(stroke: Stroke) -> tuple[FloatArray, FloatArray]:
    """Return places along a stroke, some 1 px apart, and the unit normals there, shape (n, 2) each."""
    points = np.array(stroke.points)
    places, normals = [np.zeros((0, 2))], [np.zeros((0, 2))]
    for start, end in pairwise(points):
        length = float(np.hypot(*(end - start)))
        count = int(length)
        if count:
            places.append(start + ((np.arange(count) + 0.5) / count)[:, None] * (end - start))
            normals.append(np.tile(np.array([start[1] - end[1], end[0] - start[0]]) / length, (count, 1)))
    return np.concatenate(places), np.concatenate(normals)


def _mean_across(
    lab: npt.NDArray[np.float32], places: FloatArray, normals: FloatArray, offset: float, half: float
) -> FloatArray:
    """Return the mean colour across a strip beside each place, shape (n, 3); NaN where it leaves the picture."""
    offsets = offset + np.linspace(-half, half, 2 * int(half) + 1)
    points = (places[:, None] + offsets[:, None] * normals[:, None]).astype(np.float32)
    if not len(points):
        return np.zeros((0, 3))
    found = cv2.remap(lab, points, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=(np.nan,) * 3)
    return np.asarray(found.mean(axis=1), np.float64)


def _is_apart(from_left: FloatArray, from_right: FloatArray) -> bool:
    """Return True if a band differs from both sides in the same direction, of lightness or tint, nearly everywhere."""
    inside = np.isfinite(from_left).all(axis=1) & np.isfinite(from_right).all(axis=1)
    if np.count_nonzero(inside) < _MIN_PLACES:
        return False
    sides = np.stack((from_left[inside], from_right[inside]))
    mean, least = sides.mean(axis=1), np.maximum(_CLEARLY * sides.std(axis=1), _NOTICEABLE)
    return bool(((mean > least).all(axis=0) | (mean < -least).all(axis=0)).any())
