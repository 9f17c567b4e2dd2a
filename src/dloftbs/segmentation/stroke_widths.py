"""Cables beneath strokes: how wide they are, which pixels are theirs, and which are ground beside them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from dloftbs.config import Stroke
from dloftbs.segmentation.colour_samples import pixels_of
from dloftbs.support.arrays import FloatArray

_LARGEST_LOG_RATIO = 3.0
"""Most that the colour of a pixel says for or against cable, as a logarithm.

Source: by hand; a highlight of two pixels does not end a cable.
"""
_REACH = 0.11
"""Largest half width of a cable, as a share of the picture's shorter side.

Source: by hand; wider than cables in pictures of cables.
"""
_PLACES = 7
"""Number of places along a stroke that are averaged, and least number that give a width.

Source: bounds noise; a hand wanders by less than a pixel within them.
"""
_BESIDE = 0.75
"""Width of the ground beside a cable, as a share of the cable's.

Source: by hand; another cable is seldom nearer.
"""
_BORDER_PX = 2.0
"""Distance of that ground from the cable, px.

Source: by hand; the image is blurred there.
"""
_SUBPIXEL_BITS = 4
"""Binary digits of a fraction of a pixel.

Source: by definition, as OpenCV takes them.
"""


class CablesBeneath(NamedTuple):
    """Pixels of cables and of the ground beside them (H, W), and the median width in px; NaN where none is clear."""

    cable: npt.NDArray[np.bool_]
    beside: npt.NDArray[np.bool_]
    width_px: float


def cables_beneath(log_ratio: npt.NDArray[np.float32], strokes: Sequence[Stroke]) -> CablesBeneath:
    """Find the cables that strokes were drawn along.

    Parameters
    ----------
    log_ratio : numpy.ndarray, shape (H, W), float32
        How much likelier each pixel's colour is on a cable than on the ground, as a logarithm.
    strokes : sequence of Stroke
        Those on cables count. Pixels beneath them that are clearly ground are left out: a hand leaves the cable.
    """
    height, width = log_ratio.shape
    clipped = np.clip(log_ratio, -_LARGEST_LOG_RATIO, _LARGEST_LOG_RATIO)
    drawn = [stroke for stroke in strokes if stroke.cable]
    cable, beside = np.zeros((2, height, width), np.uint8)
    widths = []
    for stroke in drawn:
        axis = _axis(clipped, stroke)
        if axis is None:
            continue
        centre, normal, clear, width_px = axis
        widths.append(width_px)
        half = 0.5 * (width_px - 1.0)
        far = half + _BORDER_PX + _BESIDE * width_px
        _fill(cable, centre, normal, clear, -half, half)
        _fill(beside, centre, normal, clear, -far, -half - _BORDER_PX)
        _fill(beside, centre, normal, clear, half + _BORDER_PX, far)
    on_cable = (cable > 0) | (pixels_of((height, width), drawn) & (log_ratio > -_LARGEST_LOG_RATIO))
    on_ground = pixels_of((height, width), [stroke for stroke in strokes if not stroke.cable])
    median = float(np.median(widths)) if widths else float("nan")
    return CablesBeneath(on_cable & ~on_ground, (beside > 0) & ~on_cable & ~on_ground, median)


def _axis(
    log_ratio: npt.NDArray[np.float32], stroke: Stroke
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.bool_], float] | None:
    """Return places on the axis of the cable beneath a stroke, the normals there, which are clear, and the width.

    The edges at a place are where the sum of the log-ratios from the stroke outwards is greatest.
    """
    places, normals = _places(stroke)
    if len(places) < _PLACES:
        return None
    reach = max(2, round(_REACH * min(log_ratio.shape)))
    offsets = np.arange(-reach, reach + 1)
    points = (places[:, None] + offsets[:, None] * normals[:, None]).astype(np.float32)
    across = cv2.remap(
        log_ratio, points, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=-_LARGEST_LOG_RATIO
    )
    across = cv2.blur(across, (1, _PLACES), borderType=cv2.BORDER_REPLICATE)
    right = np.cumsum(across[:, reach:], axis=1).argmax(axis=1)
    left = np.cumsum(across[:, reach::-1], axis=1).argmax(axis=1)
    width = (left + right + 1).astype(np.float64)
    found = width > 2.0
    if np.count_nonzero(found) < _PLACES:
        return None
    median = float(np.median(width[found]))
    clear = found & (np.abs(width - median) < 0.5 * median)
    if not clear.any():
        return None
    index = np.arange(len(places))
    middle = np.interp(index, index[clear], 0.5 * (right - left)[clear])
    middle = ndimage.median_filter(middle, size=_PLACES, mode="nearest")
    return places + middle[:, None] * normals, normals, clear, median


def _places(stroke: Stroke) -> tuple[FloatArray, FloatArray]:
    """Return places along a stroke, some 1 px apart, and the unit normals there, shape (n, 2) each."""
    points = np.array(stroke.points)
    steps = np.hypot(*np.diff(points, axis=0).T)
    points, length = points[np.r_[True, steps > 0.0]], np.r_[0.0, np.cumsum(steps[steps > 0.0])]
    if length[-1] < _PLACES:
        return np.zeros((0, 2)), np.zeros((0, 2))
    at = np.linspace(0.0, length[-1], int(length[-1]))
    places = np.stack([np.interp(at, length, points[:, axis]) for axis in range(2)], axis=1)
    places = ndimage.gaussian_filter1d(places, 0.5 * _PLACES, axis=0, mode="nearest")
    tangents = np.gradient(places, axis=0)
    tangents /= np.maximum(np.hypot(*tangents.T), 1e-9)[:, None]
    return places, np.stack((-tangents[:, 1], tangents[:, 0]), axis=1)


def _fill(
    mask: npt.NDArray[np.uint8],
    centre: FloatArray,
    normal: FloatArray,
    clear: npt.NDArray[np.bool_],
    low: float,
    high: float,
) -> None:
    """Fill the strip between two offsets from an axis where that is clear."""
    one, other = centre + low * normal, centre + high * normal
    for k in np.flatnonzero(clear[:-1] & clear[1:]):
        corners = np.array([one[k], one[k + 1], other[k + 1], other[k]])
        scaled = np.rint(corners * (1 << _SUBPIXEL_BITS)).astype(np.int32)
        cv2.fillConvexPoly(mask, scaled, 1, cv2.LINE_8, _SUBPIXEL_BITS)
