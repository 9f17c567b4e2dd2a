"""Masks of several cables as segmentation networks leave them: blurred, merged, short at the ends, with blobs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic import blemishes
from dloftbs_lab.synthetic.fault_ranges import Faults, Mask, check_amounts, check_lengths, check_ranges

# Each fault has random numbers of its own: more of one leaves the others as they are.
_GAPS, _ENDS, _BLOBS, _STROKES, _SURE = range(10, 15)
_SHARES = ("lost_ends", "connectors", "strays")
_LONGEST_PX = 1e3  # by hand: no fault of a mask is as long
_STEP_PX = 2.0  # between the discs that take an end away
_WIDER = 1.6  # half a width to the radius of such a disc


@dataclass(frozen=True)
class NetworkFaults(Faults):
    """Faults of a network's mask; lengths are of an image of 1280 x 720 with cables of 12 px.

    A network decides on a coarse grid how sure it is, and what is at least as likely cable as ground is set: slits
    between neighbours close, ends and corners are round, and the border wanders where the picture says little. The
    defaults were chosen by eye, beside masks of cables by networks in publications; none is fitted.

    Parameters
    ----------
    blur_px : float
        Deviation of the blur that the grid leaves: slits of about twice that close.
    unsure : float
        Deviation of the limit above which a pixel is set, in 0..0.4 around a half.
    patch_px : float
        Distance over which that deviation goes together.
    lost_ends : float
        Share of the cables' ends that are missing, in 0..1.
    lost_px : (float, float)
        Length of what is missing there.
    gaps : float
        Share of the cables' length that is missing elsewhere, in 0..0.9.
    gap_radius_px : (float, float)
        Radii of the discs that cut it out.
    connectors : float
        Share of the other ends that sit in a blob, a connector or terminal that is taken for cable, in 0..1.
    connector_radius_px : (float, float)
    strays : float
        Share of the images with a stray stroke, something thin that is no cable, in 0..1.
    stray_length_px, stray_width_px : (float, float)
    name : str
        For the names of sequences.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    blur_px: float = 2.0
    unsure: float = 0.12
    patch_px: float = 24.0
    lost_ends: float = 0.15
    lost_px: tuple[float, float] = (8.0, 36.0)
    gaps: float = 0.008
    gap_radius_px: tuple[float, float] = (7.0, 16.0)
    connectors: float = 0.2
    connector_radius_px: tuple[float, float] = (8.0, 15.0)
    strays: float = 0.25
    stray_length_px: tuple[float, float] = (25.0, 70.0)
    stray_width_px: tuple[float, float] = (5.0, 9.0)
    name: str = "network"

    _LENGTHS = ("blur_px", "patch_px")
    _RANGES = ("lost_px", "gap_radius_px", "connector_radius_px", "stray_length_px", "stray_width_px")

    def __post_init__(self) -> None:
        check_amounts(self, _SHARES, 1.0)
        check_amounts(self, ("gaps",), 0.9)
        check_amounts(self, ("unsure",), 0.4)
        check_lengths(self, self._LENGTHS, _LONGEST_PX)
        check_ranges(self, self._RANGES, _LONGEST_PX)

    @property
    def hides(self) -> bool:
        """Whether there are lost ends or gaps."""
        return self.lost_ends > 0.0 or self.gaps > 0.0

    def hidden(self, curves: Sequence[BSplineCurve], size: tuple[int, int], key: Sequence[int]) -> Mask:
        """Return where ends are lost and gaps are, shape (H, W)."""
        covered = np.zeros(size, bool)
        if self.gaps and curves:
            rng = np.random.default_rng([*key, _GAPS])
            blemishes.draw_discs(covered, *blemishes.gaps_along(curves, self.gaps, self.gap_radius_px, rng), True)
        for curve, from_end, lost_px in self._lost(curves, size, key):
            steps = np.arange(0.0, lost_px, _STEP_PX) / curve.length
            spots = curve.spline(1.0 - steps if from_end else steps)
            radius = _WIDER * 0.5 * self.connector_radius_px[0]
            blemishes.draw_discs(covered, spots, np.full(len(spots), radius), True)
        return covered

    def _spoil(self, seen: Mask, curves: Sequence[BSplineCurve], key: Sequence[int]) -> Mask:
        size = seen.shape[0], seen.shape[1]
        rng = np.random.default_rng([*key, _BLOBS])
        lost = {(id(curve), from_end) for curve, from_end, _ in self._lost(curves, size, key)}
        for curve, from_end, spot in _ends(curves):
            is_blob = rng.random() < self.connectors and not self._is_cut(spot, size)
            if is_blob and (id(curve), from_end) not in lost:
                blemishes.draw_blobs(seen, spot[None], self.connector_radius_px, True, rng)
        rng = np.random.default_rng([*key, _STROKES])
        if rng.random() < self.strays:
            blemishes.draw_stroke(seen, self.stray_length_px, self.stray_width_px, rng)
        return self._decided(seen, np.random.default_rng([*key, _SURE]))

    def _lost(
        self, curves: Sequence[BSplineCurve], size: tuple[int, int], key: Sequence[int]
    ) -> list[tuple[BSplineCurve, bool, float]]:
        """Return the ends that are missing: the curve, whether it is its second end, and the length, px."""
        rng = np.random.default_rng([*key, _ENDS])
        drawn = [(*end, rng.random(), float(rng.uniform(*self.lost_px))) for end in _ends(curves)]
        return [
            (curve, from_end, px)
            for curve, from_end, spot, chance, px in drawn
            if chance < self.lost_ends and not self._is_cut(spot, size)
        ]

    def _is_cut(self, spot: FloatArray, size: tuple[int, int]) -> bool:
        """Say whether a cable ends at the image's border, and not by itself."""
        room = np.minimum(spot, np.array(size[::-1]) - 1.0 - spot).min()
        return bool(room < self.connector_radius_px[0])

    def _decided(self, seen: Mask, rng: np.random.Generator) -> Mask:
        likely = cv2.GaussianBlur(seen.astype(np.float32), (0, 0), self.blur_px)
        limit = 0.5 + blemishes.smooth_field(seen.shape, self.unsure, self.patch_px, rng)
        return np.asarray(likely > np.clip(limit, 0.1, 0.9))


def _ends(curves: Sequence[BSplineCurve]) -> list[tuple[BSplineCurve, bool, FloatArray]]:
    """Return both ends of each curve: the curve, whether it is its second end, and the place (2,), px."""
    return [
        (curve, is_second, curve.end if is_second else curve.start) for curve in curves for is_second in (False, True)
    ]


NETWORK = NetworkFaults()
"""Faults of masks of cables of 12 px in HD."""
