"""Cables beneath strokes: how wide they are, which pixels are theirs, and which are ground beside them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from dloftbs.config import Stroke
from dloftbs.segmentation.colour_samples import SUBPIXEL_BITS, pixels_of
from dloftbs.support.arrays import FloatArray

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
_LEAST_PX = 3
"""Least width of a cable, px.

Source: numerics; the two edges of a thinner one are within two pixels, and blur into one.
"""
_RANK = 0.25
"""Exponent of the distribution of the rank of a cable's edge among all changes across its stroke: 0 is the strongest,
1 the weakest, and changes of the ground have any rank alike.

Source: measured on the labels of 27 photographs, 0.25 to 0.34.
"""
_ALIKE_PX = 4.0
"""Length along a stroke over which changes of colour count once, px.

Source: by hand; on busy prints 0.84 of the widths are right to a third, at 3 px 0.85, at 8 px 0.66.
"""
_MOVES = 0.12
"""Probability that a cable's edge lies a pixel to the left at the next place along a stroke; the same to the right.

Source: measured on the labels of 27 photographs over 4 px of strokes, 0.12 to 0.14.
"""
_SPREAD = 0.2
"""Standard deviation of the logarithm of the width of a picture's cables.

Source: measured on the labels of 27 photographs, 0.16 to 0.27.
"""


class CablesBeneath(NamedTuple):
    """Pixels of cables and of the ground beside them (H, W), and the median width in px; NaN where none has edges."""

    cable: npt.NDArray[np.bool_]
    beside: npt.NDArray[np.bool_]
    width_px: float


def cables_beneath(image: npt.NDArray[np.uint8], strokes: Sequence[Stroke]) -> CablesBeneath:
    """Find the cables that strokes were drawn along.

    Parameters
    ----------
    image : numpy.ndarray, shape (H, W, 3), uint8
        BGR.
    strokes : sequence of Stroke
        Those on cables count. Beneath one that shows no width, the cable is what was drawn on.
    """
    height, width = image.shape[:2]
    lab = cv2.cvtColor(image.astype(np.float32) / 255.0, cv2.COLOR_BGR2Lab)
    cable, beside = np.zeros((2, height, width), np.uint8)
    found, plain = [], []
    for stroke in (one for one in strokes if one.cable):
        across = _Across.of(lab, stroke)
        if across is None:
            plain.append(stroke)
        else:
            found.append((stroke, across))
    shown = []
    for (stroke, across), width_px in zip(found, _widths([across for _, across in found]), strict=True):
        half = 0.5 * (width_px - 1.0)
        far = half + _BORDER_PX + _BESIDE * width_px
        centre, clear = across.axis(width_px)
        if not clear.any():
            plain.append(stroke)
            continue
        shown.append(width_px)
        _fill(cable, centre, across.normals, clear, -half, half)
        _fill(beside, centre, across.normals, clear, -far, -half - _BORDER_PX)
        _fill(beside, centre, across.normals, clear, half + _BORDER_PX, far)
    on_cable = pixels_of((height, width), plain) | (cable > 0)
    on_ground = pixels_of((height, width), [stroke for stroke in strokes if not stroke.cable])
    median = float(np.median(shown)) if shown else float("nan")
    return CablesBeneath(on_cable & ~on_ground, (beside > 0) & ~on_cable & ~on_ground, median)


@dataclass(frozen=True, eq=False)
class _Across:
    """Changes of colour across a stroke, as evidence of the edges of a cable.

    Parameters
    ----------
    places, normals : numpy.ndarray, shape (n, 2), float64
        Places along the stroke, and the unit normals there.
    offsets : numpy.ndarray, shape (m,), float64
        Distances of the changes from a place along its normal, px.
    evidence : numpy.ndarray, shape (n, m), float64
        Log-likelihood ratio of each change, of a cable's edge to anything else.
    by_width : numpy.ndarray, shape (k,), float64
        Log-likelihood ratio of a cable of each width from `_LEAST_PX` on, where every other cable shows no edges.
    """

    places: FloatArray
    normals: FloatArray
    offsets: FloatArray
    evidence: FloatArray
    by_width: FloatArray

    @classmethod
    def of(cls, lab: npt.NDArray[np.float32], stroke: Stroke) -> _Across | None:
        """Look across a stroke; None where it is too short or no colour changes.

        Changes are compared by their rank among all of them, so that contrast and texture need no scale.
        """
        places, normals = _places(stroke)
        if len(places) < _PLACES:
            return None
        reach = max(2, round(_REACH * min(lab.shape[:2])))
        offsets = np.arange(-reach, reach + 1)
        points = (places[:, None] + offsets[:, None] * normals[:, None]).astype(np.float32)
        across = cv2.remap(lab, points, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        steps = 0.5 * (across[:, 2:-1] + across[:, 3:] - across[:, :-3] - across[:, 1:-2])
        changes = np.linalg.norm(steps, axis=2)
        if not changes.any():
            return None
        order = np.sort(changes, axis=None)
        below, up_to = (np.searchsorted(order, changes, side) for side in ("left", "right"))
        rank = 1.0 - 0.5 * (below + up_to) / changes.size  # alike changes share their mean rank, as on drawn pictures
        evidence = (math.log(_RANK) - (1.0 - _RANK) * np.log(rank)) / _ALIKE_PX
        at = offsets[1:-2] + 0.5
        widths = np.arange(_LEAST_PX, len(at))
        by_width = np.sum([np.log(factor) for _, factor in _paths(evidence, at, widths)], axis=0)
        return cls(places, normals, at, evidence, np.logaddexp(0.0, by_width))

    def axis(self, width_px: int) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
        """Return the mean axis of a cable of a width, shape (n, 2), and the places that show its edges, shape (n,)."""
        width = np.array([width_px])
        ahead = np.array([share[0] for share, _ in _paths(self.evidence, self.offsets, width)])
        back = np.array([share[0] for share, _ in _paths(self.evidence[::-1], self.offsets, width)])[::-1]
        own = self.evidence.copy()
        own[:, :-width_px] += self.evidence[:, width_px:]
        share = ahead * back * np.exp(-own)  # both ways count the place's own evidence
        share /= share.sum(axis=1, keepdims=True)
        aside = share @ self.offsets + 0.5 * width_px
        clear = ndimage.uniform_filter1d((share * own).sum(axis=1), _PLACES, mode="nearest") > 0.0
        return self.places + aside[:, None] * self.normals, clear


def _widths(found: Sequence[_Across]) -> list[int]:
    """Return the likeliest width beneath each stroke, px, where all widths spread around a common one."""
    if not found:
        return []
    by_width = np.stack([one.by_width for one in found])
    widths = np.log(np.arange(_LEAST_PX, _LEAST_PX + by_width.shape[1]))
    prior = -0.5 * ((widths - widths[:, None]) / _SPREAD) ** 2 - widths  # a scale has no prior but 1 / width
    prior -= np.logaddexp.reduce(prior, axis=1, keepdims=True)
    common = np.logaddexp.reduce(by_width[:, None] + prior, axis=2).sum(axis=0) - widths
    return [_LEAST_PX + int(k) for k in np.argmax(by_width + prior[common.argmax()], axis=1)]


def _paths(
    evidence: FloatArray, offsets: FloatArray, widths: npt.NDArray[np.int64]
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield the filtered distribution of the left edge at each place, and the factor of likelihood that the place adds.

    The stroke lies on the cable, or a pixel beside it; anything else is as likely at the first place.

    Yields
    ------
    share : numpy.ndarray, shape (k, m), float64
        Probability of each left edge, for each width, given this place and those before.
    factor : numpy.ndarray, shape (k,), float64
        Likelihood ratio of this place for each width, given those before.
    """
    count = len(offsets)
    right = np.arange(count) + widths[:, None]
    middle = offsets + 0.5 * widths[:, None]
    within = (right < count) & (np.abs(middle) <= 0.5 * widths[:, None] + 1.0)
    right = np.minimum(right, count - 1)
    share = within / within.sum(axis=1, keepdims=True)
    for number, row in enumerate(np.exp(evidence)):
        if number:
            moved = (1.0 - 2.0 * _MOVES) * share
            moved[:, 1:] += _MOVES * share[:, :-1]
            moved[:, :-1] += _MOVES * share[:, 1:]
            share = moved
        share = share * row * row[right] * within
        factor = share.sum(axis=1)
        share /= factor[:, None]
        yield share, factor


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
        scaled = np.rint(corners * (1 << SUBPIXEL_BITS)).astype(np.int32)
        cv2.fillConvexPoly(mask, scaled, 1, cv2.LINE_8, SUBPIXEL_BITS)
