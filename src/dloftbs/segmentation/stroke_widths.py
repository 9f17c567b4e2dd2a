"""Cables beneath strokes: how wide they are, which pixels are theirs, and which are ground beside them."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from dloftbs.config import Stroke
from dloftbs.segmentation.colour_samples import SUBPIXEL_BITS, pixels_of
from dloftbs.support.arrays import BoolArray, ByteArray, FloatArray, IntArray

_REACH = 0.11
"""Largest half width of a cable, as a share of the picture's shorter side.

Source: by hand; wider than cables in pictures of cables.
"""
_LEAST_REACH_PX = 10.0
"""Least such half width that is looked for, px.

Source: by hand; in a picture of a few dozen pixels a cable may take a third. Only below 91 px does it matter.
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
_LEAST_PX = 3
"""Least width of a cable, px.

Source: numerics; the two edges of a thinner one are within two pixels, and blur into one.
"""
_STRONG = 0.9
"""Least strength of the edges of a narrower band that may be the cable, as a share of the strongest.

Source: by hand; from 0.85 to 0.95 the share of wrong widths on EWD's photographs changes by 0.01.
"""
_ALIKE = 0.5
"""Largest difference of two colours that are alike, as a share of the change at the edge between.

Source: geometry; a colour is nearer to one side of the edge than to the other.
"""
_PITCH_WIDTHS = 1.4
"""Least distance from the middle of a cable to that of the next, widths; nearer is a stripe of light on one cable.

Source: by hand; a stripe is seldom wider than what is dark on either side of it.
"""


class CablesBeneath(NamedTuple):
    """Pixels of cables and of the ground beside them (H, W), and the median width in px; NaN where none has edges."""

    cable: BoolArray
    beside: BoolArray
    width_px: float


class CableAxis(NamedTuple):
    """Axis of a cable beneath a stroke: its places and normals (n, 2), which have edges (n,), and the width in px."""

    places: FloatArray
    normals: FloatArray
    is_clear: BoolArray
    width_px: float


class _Band(NamedTuple):
    """Band between two edges: its width in px, and the numbers of the left edge along a stroke (n,)."""

    width_px: int
    left: IntArray

    def outsides(self, reach: int) -> tuple[tuple[int, IntArray], ...]:
        """Return, for each side, the direction away and the columns (n,) just outside, of colours twice the reach."""
        return (-1, self.left + reach + 1), (1, self.left + reach + 2 + self.width_px)


def axes_beneath(image: ByteArray, strokes: Sequence[Stroke]) -> dict[Stroke, CableAxis | None]:
    """Return the axis of the cable beneath each stroke on an image (H, W, 3) BGR; None where no width shows."""
    lab = cv2.cvtColor(image.astype(np.float32) / 255.0, cv2.COLOR_BGR2Lab)
    return {stroke: _axis(lab, stroke) if stroke.cable else None for stroke in strokes}


def cables_beneath(
    image: ByteArray, strokes: Sequence[Stroke], axes: Mapping[Stroke, CableAxis | None] | None = None
) -> CablesBeneath:
    """Find the cables that strokes were drawn along.

    Parameters
    ----------
    image : numpy.ndarray, shape (H, W, 3), uint8
        BGR.
    strokes : sequence of Stroke
        Those on cables count. Beneath one that shows no width, the cable is what was drawn on.
    axes : mapping, optional
        What `axes_beneath` found of these strokes, and maybe of others: it takes most of the time.
    """
    height, width = image.shape[:2]
    if axes is None:
        axes = axes_beneath(image, strokes)
    cable, beside = np.zeros((2, height, width), np.uint8)
    widths, plain = [], []
    for stroke in strokes:
        axis = axes[stroke]
        if axis is None:
            plain.append(stroke)
            continue
        centre, normal, clear, width_px = axis
        widths.append(width_px)
        half = 0.5 * (width_px - 1.0)
        far = half + _BORDER_PX + _BESIDE * width_px
        _fill(cable, centre, normal, clear, -half, half)
        _fill(beside, centre, normal, clear, -far, -half - _BORDER_PX)
        _fill(beside, centre, normal, clear, half + _BORDER_PX, far)
    on_cable, on_ground = (
        pixels_of((height, width), [one for one in plain if one.cable is kind]) for kind in (True, False)
    )
    on_cable |= cable > 0
    median = float(np.median(widths)) if widths else float("nan")
    return CablesBeneath(on_cable & ~on_ground, (beside > 0) & ~on_cable & ~on_ground, median)


def _axis(lab: npt.NDArray[np.float32], stroke: Stroke) -> CableAxis | None:
    """Return the axis of the cable beneath a stroke; None without.

    Two edges run along a stroke, a width apart, where changes of colour across it are strongest on both sides
    together. From a place to the next the axis moves aside by a pixel at most. Square roots of the changes are added:
    a few that are strong, as of a shadow or of another cable, are no edge along it. Edges of parallel cables are as
    strong: of such bands, the narrowest that is a whole cable is taken.
    """
    places, normals = _places(stroke)
    if len(places) < _PLACES:
        return None
    reach = round(max(_LEAST_REACH_PX, _REACH * min(lab.shape[:2])))
    offsets = np.arange(-2 * reach, 2 * reach + 1)  # the outer half shows what lies beyond the widest band
    points = (places[:, None] + offsets[:, None] * normals[:, None]).astype(np.float32)
    across = cv2.remap(lab, points, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    near = across[:, reach:-reach]
    steps = 0.5 * (near[:, 2:-1] + near[:, 3:] - near[:, :-3] - near[:, 1:-2])
    edges = np.sqrt(np.linalg.norm(steps, axis=2))
    count = edges.shape[1]
    widths, left = np.arange(_LEAST_PX, count)[:, None], np.arange(count)
    right = np.minimum(left + widths, count - 1)
    middle = left + 1.5 + 0.5 * widths - reach
    is_beneath = (left + widths < count) & (np.abs(middle) <= 0.5 * widths + 1.0)
    never = np.where(is_beneath, np.float32(0.0), np.float32(-np.inf))
    (sums,) = deque(_ways(edges, right, never), maxlen=1)  # all would be as many as the stroke has pixels
    best = sums.max(axis=1)
    if not best.max() > 0.0:
        return None
    is_strong = (best >= _STRONG * best.max()) & (best == ndimage.maximum_filter1d(best, 3))
    numbers = np.flatnonzero(is_strong[: best.argmax() + 1])
    bands = [_Band(int(widths[k, 0]), _left_edge(edges, right[k : k + 1], never[k : k + 1])) for k in numbers]
    at = next(at for at, band in enumerate(bands) if _is_whole(across, reach, band, bands[at + 1 :]))
    (width, path), rows = bands[at], np.arange(len(edges))
    strength = ndimage.uniform_filter1d(edges[rows, path] + edges[rows, path + width], _PLACES, mode="nearest")
    aside = ndimage.median_filter(middle[numbers[at], path], size=_PLACES, mode="nearest")
    is_clear = strength > 0.5 * np.median(strength)
    return CableAxis(places + aside[:, None] * normals, normals, is_clear, float(width))


def _left_edge(edges: npt.NDArray[np.float32], right: IntArray, never: npt.NDArray[np.float32]) -> IntArray:
    """Return the numbers of the left edge along a stroke (n,) of the strongest band of one width."""
    ways = [row[0] for row in _ways(edges, right, never)]
    at = int(ways[-1].argmax())
    found = [at]
    for before in ways[-2::-1]:
        first = max(0, at - 1)
        at = first + int(before[first : at + 2].argmax())
        found.append(at)
    return np.array(found[::-1])


def _is_whole(across: npt.NDArray[np.float32], reach: int, band: _Band, wider: Sequence[_Band]) -> bool:
    """Return whether a band is a whole cable, and wider ones reach from it to its neighbours.

    Ground lies between it and the edge of a wider band, and again beyond that edge, or beyond the cable that begins
    there. Beside a stripe of light on a cable lies the rest of the cable instead, and beyond it something else.
    """
    border, width = round(_BORDER_PX), band.width_px
    for other in wider:
        for (away, outside), (_, beyond) in zip(band.outsides(reach), other.outsides(reach), strict=True):
            length = away * float(np.mean(beyond - outside))
            if length <= _BORDER_PX:
                continue  # the same edge
            inside = _colours(across, outside - away * (1 + min(border, width // 2)), away, 1)
            beside = _colours(across, outside + away * border, away, max(1, math.ceil(length) - 2 * border))
            alike = _ALIKE * np.linalg.norm(beside[0] - inside)
            ground = beside[np.linalg.norm(beside - inside, axis=1) > alike]
            found = _colours(across, beyond + away * border, away, width + border + 1)
            is_ground = (np.linalg.norm(found[:, None] - ground, axis=2) < alike).any(axis=1)
            if not is_ground.any() or length + border + int(is_ground.argmax()) < _PITCH_WIDTHS * width:
                return False
    return True


def _colours(across: npt.NDArray[np.float32], first: IntArray, away: int, count: int) -> npt.NDArray[np.float32]:
    """Return the median colours along a stroke, from a column at each place on in a direction, shape (count, 3)."""
    columns = np.clip(first[:, None] + away * np.arange(count), 0, across.shape[1] - 1)
    return np.asarray(np.median(np.take_along_axis(across, columns[:, :, None], axis=1), axis=0))


def _ways(
    edges: npt.NDArray[np.float32], right: IntArray, never: npt.NDArray[np.float32]
) -> Iterator[npt.NDArray[np.float32]]:
    """Yield the greatest sum of edges up to each place, of ways that lead to each left edge (widths, edges)."""
    best = np.zeros_like(never)
    for row in edges:
        best = best + row + row[right] + never
        yield best
        best = ndimage.maximum_filter1d(best, 3, axis=1, mode="nearest")


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


def _fill(mask: ByteArray, centre: FloatArray, normal: FloatArray, clear: BoolArray, low: float, high: float) -> None:
    """Fill the strip between two offsets from an axis where that is clear."""
    one, other = centre + low * normal, centre + high * normal
    for k in np.flatnonzero(clear[:-1] & clear[1:]):
        corners = np.array([one[k], one[k + 1], other[k + 1], other[k]])
        scaled = np.rint(corners * (1 << SUBPIXEL_BITS)).astype(np.int32)
        cv2.fillConvexPoly(mask, scaled, 1, cv2.LINE_8, SUBPIXEL_BITS)
