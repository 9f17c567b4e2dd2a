"""Pixels that an object covers, from its curve and its width."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from dloftbs.data.curve import BSplineCurve
from dloftbs.support.arrays import FloatArray

SAMPLE_PX = 0.1
"""Distance of points along a curve, px; half a width from them is half a width from the curve, to 0.003 px.

Source: geometry; the error is an eighth of its square, divided by half a width, of a curve that is 1 px wide.
"""

_MAX_POINTS = 1_000_000
"""Largest number of points along a curve.

Source: bounds memory; only curves that leave the picture by far are so long.
"""

_ROUNDING_PX = 1e-9
"""Length along a curve that is none, px.

Source: numerics; splines are evaluated to 1e-13 px in a picture.
"""

_Indices = npt.NDArray[np.intp]


def pixels_near(points: FloatArray, width_px: float, size: tuple[int, int]) -> tuple[_Indices, _Indices, _Indices]:
    """Return the pixels whose centre lies within half a width of points.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, 2)
        ``(x, y)`` px, in the order of a line; they may leave the image.
    width_px : float
    size : (int, int)
        ``(H, W)`` of the image.

    Returns
    -------
    (rows, columns, nearest) : numpy.ndarray, shape (m,)
        Of each pixel its row, its column, and the index of the nearest point.
    """
    import cv2
    from scipy.spatial import cKDTree

    # OpenCV's thick lines are inexact by a pixel or so: they only choose the candidates.
    thick = math.ceil(width_px) + 5
    beside = np.clip(points.round(), -thick, np.array(size[::-1]) + thick).astype(np.int32)
    near = np.zeros(size, np.uint8)
    cv2.polylines(near, [beside], False, 255, thick)
    rows, columns = np.nonzero(near)
    distance, nearest = cKDTree(points).query(np.stack((columns, rows), axis=1), distance_upper_bound=width_px)
    inside = distance <= width_px / 2.0
    return rows[inside], columns[inside], nearest[inside]


def curve_mask(
    curve: BSplineCurve, width_px: float, size: tuple[int, int], spans: Iterable[tuple[float, float]] = ((0.0, 1.0),)
) -> npt.NDArray[np.bool_]:
    """Return the mask of an object: the pixels whose centre lies within half a width of its curve.

    The ends are flat: curves go up to the tips of objects.

    Parameters
    ----------
    curve : BSplineCurve
        In the image, px; it may leave it.
    width_px : float
    size : (int, int)
        ``(H, W)`` of the image.
    spans : iterable of (float, float)
        The intervals of ``u`` to draw.

    Returns
    -------
    numpy.ndarray, shape (H, W), bool
    """
    mask = np.zeros(size, dtype=bool)
    for low, high in spans:
        count = min(math.ceil((high - low) * curve.length / SAMPLE_PX) + 2, _MAX_POINTS)
        points = curve(np.linspace(low, high, count))
        rows, columns, nearest = pixels_near(points, width_px, size)
        if not (curve.closed and high - low == 1.0):
            inside = _between_ends(points, nearest, np.stack((columns, rows), axis=1))
            rows, columns = rows[inside], columns[inside]
        mask[rows, columns] = True
    return mask


def _between_ends(points: FloatArray, nearest: _Indices, places: npt.NDArray[np.intp]) -> npt.NDArray[np.bool_]:
    """Return which of the places (m, 2) lie not beyond the first or the last point, where that is the nearest."""
    last = len(points) - 1
    before = (nearest == 0) & ((places - points[0]) @ (points[1] - points[0]) < -_ROUNDING_PX)
    behind = (nearest == last) & ((places - points[last]) @ (points[last] - points[last - 1]) > _ROUNDING_PX)
    return ~(before | behind)
