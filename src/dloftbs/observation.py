"""Observations of one frame, ready to be compared: detections, or bare curves from any detector, and their samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs._arrays import LARGEST, FloatArray
from dloftbs._values import check_number
from dloftbs.centerline import JointKind
from dloftbs.curve import BSplineCurve
from dloftbs.detection import Detection
from dloftbs.errors import InputError
from dloftbs.kernels import cubic_samples

SAMPLES = 64
"""Points of a curve that stand for it, at even parameters."""

U = np.linspace(0.0, 1.0, SAMPLES)
"""Their parameters."""


_GAP_WIDTHS = 2.5  # a longer gap is not taken for bridged until the past agrees


class Seen(NamedTuple):
    """One object in a frame, or a part of it that hangs together.

    Parameters
    ----------
    curve : BSplineCurve
        Of the object.
    points : numpy.ndarray, shape (SAMPLES, 2)
        Along the part, px.
    length, width : float
        Of the part, px; the width is NaN where it is not known.
    detection : Detection or None
    of : (float, float)
        Stretch of the curve's ``u`` that the part is.
    number : int
        Of the object in the frame.
    total : float
        Length of the whole object, px.
    clear : bool
        Whether the object has no long gaps.
    gaps : tuple of (float, float)
        The intervals of the curve's ``u`` that the detector inferred.
    backwards : bool
        Whether it is run the other way than it was found.
    """

    curve: BSplineCurve
    points: FloatArray
    length: float
    width: float
    detection: Detection | None
    of: tuple[float, float]
    number: int
    total: float
    clear: bool
    gaps: tuple[tuple[float, float], ...] = ()
    backwards: bool = False

    @property
    def curve_3d(self) -> BSplineCurve | None:
        """The object's curve in space."""
        return None if self.detection is None else self.detection.curve_3d

    def reversed(self) -> Seen:
        """Return the same part run the other way."""
        detection = None if self.detection is None else self.detection.reversed()
        curve = self.curve.reversed() if detection is None else detection.curve
        return self._replace(
            curve=curve,
            points=self.points[::-1],
            detection=detection,
            of=(1.0 - self.of[1], 1.0 - self.of[0]),
            gaps=tuple((1.0 - high, 1.0 - low) for low, high in reversed(self.gaps)),
            backwards=not self.backwards,
        )

    def parts(self) -> list[Seen]:
        """Return what lies between the long gaps."""
        if self.detection is None or self.clear:
            return [self]
        gap = _GAP_WIDTHS * self.width / self.total
        first, last = self.of
        cuts = [
            joint.u
            for joint in self.detection.joints
            if first <= joint.u[0]
            and joint.u[1] <= last
            and joint.kind is not JointKind.CROSSING
            and joint.u[1] - joint.u[0] > gap
        ]
        if not cuts:
            return [self]
        edges = [first, *(edge for span in cuts for edge in span), last]
        parts = [self.between(low, high) for low, high in zip(edges[::2], edges[1::2], strict=True) if high > low]
        return [part for part in parts if part.length > 0.0]

    def between(self, first: float, last: float) -> Seen:
        """Return the part between two ``u`` of the curve."""
        points, length = sample(self.curve, first, last)
        return self._replace(points=points, length=length, of=(first, last))


def look_at(found: Sequence[Detection | BSplineCurve], widths: Sequence[float] | None) -> list[Seen]:
    """Return what a frame shows; what has no length is left out.

    Raises
    ------
    InputError
        If something is neither, a curve is not in the image, or the widths are not one for each.
    """
    if widths is not None and len(widths) != len(found):
        raise InputError(f"widths must be one for each of {len(found)} curves, got {len(widths)}")
    shown = []
    for index, one in enumerate(found):
        detection = one if isinstance(one, Detection) else None
        curve = one.curve if isinstance(one, Detection) else one
        if not isinstance(curve, BSplineCurve) or curve.ndim != 2:
            raise InputError(f"expected a Detection or a BSplineCurve in the image (ndim 2), got {curve!r}")
        width = math.nan if detection is None else detection.width
        if widths is not None:
            given = widths[index]
            unknown = isinstance(given, float) and math.isnan(given)
            width = math.nan if unknown else check_number("a width", given, 0.0, LARGEST)
        points, length = sample(curve)
        if length > 0.0:
            gaps = () if detection is None or not detection.joints else detection.inferred
            clear = not any((high - low) * length > _GAP_WIDTHS * width for low, high in gaps)
            shown.append(Seen(curve, points, length, width, detection, (0.0, 1.0), index, length, clear, gaps))
    return shown


def sample(
    curve: BSplineCurve, first: float = 0.0, last: float = 1.0, count: int = SAMPLES
) -> tuple[FloatArray, float]:
    """Return points along a curve in the plane or in space, and the length of the polygon through them."""
    if curve.degree == 3:
        points = np.empty((count, curve.ndim))
        return points, cubic_samples.sample_cubic(curve.knots, curve.control_points, first, last, points)
    points = curve(np.linspace(first, last, count))
    return points, float(np.linalg.norm(points[1:] - points[:-1], axis=1).sum())
