"""Even samples of a curve, by which curves are compared."""

from __future__ import annotations

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.kernels import cubic_samples
from dloftbs.support.arrays import FloatArray, frozen

SAMPLES = 64
"""Number of points that represent a curve, at even parameters."""

U = np.linspace(0.0, 1.0, SAMPLES)
"""Parameters of the samples."""


def sample_curve(
    curve: BSplineCurve, first: float = 0.0, last: float = 1.0, count: int = SAMPLES
) -> tuple[FloatArray, float]:
    """Return points along a curve in the plane or in space, read-only, and the length of the polygon through them.

    The `SAMPLES` points of a whole curve are kept with it, as several steps of tracking need them.
    """
    if first != 0.0 or last != 1.0 or count != SAMPLES:
        return _sample_anew(curve, first, last, count)
    kept: tuple[FloatArray, float] | None = curve.__dict__.get("samples")
    if kept is None:
        kept = curve.__dict__["samples"] = _sample_anew(curve, first, last, count)
    return kept


def keep_samples(curve: BSplineCurve | None, backwards: BSplineCurve) -> None:
    """Keep the samples of a curve, if it has them, with the same curve run the other way."""
    if curve is not None and "samples" in curve.__dict__:
        points, length = curve.__dict__["samples"]
        backwards.__dict__["samples"] = points[::-1], length


def _sample_anew(curve: BSplineCurve, first: float, last: float, count: int) -> tuple[FloatArray, float]:
    if curve.degree == 3:
        points, length = cubic_samples.sample_cubic(curve.knots, curve.control_points, first, last, count)
    else:
        points = curve.spline(np.linspace(first, last, count))
        length = float(np.linalg.norm(points[1:] - points[:-1], axis=1).sum())
    return frozen(points), length
