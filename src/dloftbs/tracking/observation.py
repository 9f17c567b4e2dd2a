"""Observations of one frame, ready to be compared: detections, or bare curves from any detector, and their samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs.data.centerline import JointKind
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_samples import keep_samples, sample_curve
from dloftbs.data.detection import Detection, curves_of
from dloftbs.errors import InputError
from dloftbs.evidence import Appearance
from dloftbs.support.arrays import LARGEST, FloatArray
from dloftbs.support.values import check_number, shown
from dloftbs.tracking.belief import READ_RIGHT

_LONG_GAP_WIDTHS = 2.5
"""Length of a gap, in widths, beyond which it is not accepted as bridged until the track confirms it.

Source: by hand.
"""

_MIN_PROBABILITY = 1e-3
"""Least probability of a detection, and of its opposite, a share of all.

Source: by hand; no frame is surer of a reading than that.
"""


class Observation(NamedTuple):
    """One object in a frame, or one connected part of it.

    Parameters
    ----------
    curve : BSplineCurve
        Of the whole object.
    points : numpy.ndarray, shape (SAMPLES, 2)
        Samples along the part, px.
    length, width : float
        Of the part, px; the width is NaN where it is unknown.
    detection : Detection or None
        None for a bare curve.
    curve_span : (float, float)
        The part's interval of the curve's ``u``.
    detection_index : int
        Index of the object in the frame.
    object_length : float
        Length of the whole object, px.
    contiguous : bool
        True if the object has no long gaps.
    gaps : tuple of (float, float)
        The intervals of the curve's ``u`` that the detector inferred.
    px_per_m : float
        Pixels to a metre of the object, in the mean over it; NaN if its curve in space is unknown.
    appearance : Appearance or None
        Of the object; None where there is no image.
    backwards : bool
        True if the direction is opposite to the detector's.
    """

    curve: BSplineCurve
    points: FloatArray
    length: float
    width: float
    detection: Detection | None
    curve_span: tuple[float, float]
    detection_index: int
    object_length: float
    contiguous: bool
    gaps: tuple[tuple[float, float], ...] = ()
    px_per_m: float = math.nan
    appearance: Appearance | None = None
    backwards: bool = False

    @property
    def curve_3d(self) -> BSplineCurve | None:
        """The object's curve in space."""
        return None if self.detection is None else self.detection.curve_3d

    @property
    def log_odds(self) -> float:
        """Log-odds, by the frame alone, that the detection is one whole object, nats; bare curves count as clear."""
        return _log_odds(1.0 if self.detection is None else self.detection.confidence)

    @property
    def existence_log_odds(self) -> float:
        """Log-odds, by the frame alone, that there is an object, nats.

        Those of its confidence, where its reading is clear; else those of its existence, `READ_RIGHT` at most.
        """
        if self.detection is None:
            return self.log_odds
        return max(self.log_odds, _log_odds(min(self.detection.existence, READ_RIGHT)))

    def reversed(self) -> Observation:
        """Return the same part in the opposite direction."""
        detection = None if self.detection is None else self.detection.reversed()
        curve = self.curve.reversed() if detection is None else detection.curve
        keep_samples(self.curve, curve)
        if detection is not None and detection.curve_3d is not None:
            keep_samples(self.curve_3d, detection.curve_3d)
        return Observation(
            curve,
            self.points[::-1],
            self.length,
            self.width,
            detection,
            (1.0 - self.curve_span[1], 1.0 - self.curve_span[0]),
            self.detection_index,
            self.object_length,
            self.contiguous,
            tuple([(1.0 - high, 1.0 - low) for low, high in reversed(self.gaps)]),
            self.px_per_m,
            self.appearance,
            not self.backwards,
        )

    def split_at_gaps(self) -> list[Observation]:
        """Return the parts between the long gaps."""
        if self.detection is None or self.contiguous:
            return [self]
        longest = _LONG_GAP_WIDTHS * self.width / self.object_length
        first, last = self.curve_span
        cuts = [
            joint.u
            for joint in self.detection.centerline.joints
            if first <= joint.u[0]
            and joint.u[1] <= last
            and joint.kind is not JointKind.CROSSING
            and joint.u[1] - joint.u[0] > longest
        ]
        if not cuts:
            return [self]
        edges = [first, *(edge for span in cuts for edge in span), last]
        parts = [self.between(low, high) for low, high in zip(edges[::2], edges[1::2], strict=True) if high > low]
        return [part for part in parts if part.length > 0.0]

    def between(self, first: float, last: float) -> Observation:
        """Return the part between two parameters of the curve."""
        if (first, last) == self.curve_span:
            return self
        points, length = sample_curve(self.curve, first, last)
        return self._replace(points=points, length=length, curve_span=(first, last))


def make_observations(
    found: Sequence[Detection | BSplineCurve], widths: Sequence[float] | None = None
) -> list[Observation]:
    """Return the observations of a frame; objects of zero length are left out.

    Raises
    ------
    InputError
        If an item is neither a detection nor a curve in the image, or there is not one width for each.
    """
    curves = curves_of(found)
    if widths is not None and not _is_list_of(len(found), widths):
        raise InputError(f"widths must be one for each of {len(found)} curves, got {shown(widths)}")
    observations = []
    for index, (item, curve) in enumerate(zip(found, curves, strict=True)):
        detection = item if isinstance(item, Detection) else None
        width = math.nan if detection is None else detection.width_px
        if widths is not None:
            given = widths[index]
            unknown = isinstance(given, float) and math.isnan(given)
            width = math.nan if unknown else check_number("a width", given, 0.0, LARGEST)
        width = width or math.nan  # nothing has a width of 0: it is not known
        points, length = sample_curve(curve)
        if length > 0.0:
            gaps = () if detection is None else detection.centerline.gaps
            contiguous = not gaps or not any((high - low) * length > _LONG_GAP_WIDTHS * width for low, high in gaps)
            space = None if detection is None else detection.curve_3d
            metres = 0.0 if space is None else sample_curve(space)[1]
            scale = length / metres if metres > 0.0 else math.nan
            observations.append(
                Observation(curve, points, length, width, detection, (0.0, 1.0), index, length, contiguous, gaps, scale)
            )
    return observations


def _log_odds(probability: float) -> float:
    return math.log(max(probability, _MIN_PROBABILITY) / max(1.0 - probability, _MIN_PROBABILITY))


def _is_list_of(count: int, values: object) -> bool:
    if isinstance(values, np.ndarray):
        return values.shape == (count,)
    return isinstance(values, Sequence) and len(values) == count
