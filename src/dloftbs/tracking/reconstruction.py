"""Reconstruction of a whole curve from its visible parts and its last shape, in the plane or in space.

Hidden spans keep their shape, take the length that is known of them, and follow the visible parts beside them: at an
end as rigidly as the one side moves, in between bent from one to the other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_samples import sample_curve
from dloftbs.kernels import least_squares
from dloftbs.support.arrays import FloatArray
from dloftbs.tracking.kernels.hidden_spans import fill_hidden
from dloftbs.tracking.partial_match import SAME_U, PartialMatch

CURVE_SAMPLES = 193
"""Number of samples of the reconstructed curve, at even parameters.

Source: by hand; three to each of a curve's `SAMPLES`.
"""

_SAMPLES_PER_SPAN = 4
"""Number of samples to a span of the reconstructed spline.

Source: by hand; fewer do not determine it against noise.
"""

EVEN_U = np.linspace(0.0, 1.0, CURVE_SAMPLES)
"""Parameters of the samples, units of ``u``.

Source: by definition.
"""

_KNOTS = least_squares.open_knots(EVEN_U, CURVE_SAMPLES // _SAMPLES_PER_SPAN)

_WINDOW_SHARE = 0.15
"""Least visible share of the whole length that determines a rigid motion.

Source: by hand.
"""


class VisiblePart(NamedTuple):
    """A visible part: the span `curve_span` of a curve lies at the span `track_span` of the whole, both in ``u``."""

    curve: BSplineCurve
    track_span: tuple[float, float]
    curve_span: tuple[float, float]


def visible_parts(matches: Sequence[PartialMatch]) -> list[VisiblePart]:
    """Return the visible parts of a track, in the image."""
    return [VisiblePart(match.observation.curve, match.track_span, match.curve_span) for match in matches]


def reconstruct(old: FloatArray, parts: Sequence[VisiblePart], length: float) -> BSplineCurve:
    """Return the whole curve.

    Parameters
    ----------
    old : numpy.ndarray, shape (CURVE_SAMPLES, d)
        Points at even parameters along its last known shape, open.
    parts : sequence of VisiblePart
        One or more, in order, without overlaps.
    length : float
        Of the whole.
    """
    new, steps = np.empty_like(old), CURVE_SAMPLES - 1
    visible: list[tuple[int, int]] = []  # first and last sample
    for part in parts:
        (low, high), (first, last) = part.track_span, part.curve_span
        start, stop = math.ceil((low - SAME_U) * steps), math.floor((high + SAME_U) * steps)
        if stop > start:
            scale = (last - first) / (high - low)
            begin, end = first + (start / steps - low) * scale, first + (stop / steps - low) * scale
            new[start : stop + 1] = sample_curve(part.curve, max(begin, first), min(end, last), stop - start + 1)[0]
            visible.append((start, stop))
    if not visible:  # they are shorter than the step between samples
        return fit_samples(old)
    fill_hidden(old, new, np.array(visible), round(_WINDOW_SHARE * CURVE_SAMPLES), length)
    return fit_samples(new)


def cut(curve: BSplineCurve, span: tuple[float, float]) -> BSplineCurve:
    """Return a span of a curve as a curve of its own."""
    return fit_samples(sample_curve(curve, *span, CURVE_SAMPLES)[0])


def fit_samples(points: FloatArray) -> BSplineCurve:
    """Return the curve through points (CURVE_SAMPLES, d) at even parameters."""
    return BSplineCurve._unchecked(_KNOTS, least_squares.fit_open(EVEN_U, points, _KNOTS), 3, False)
