"""Temporal prior: the curves predicted for a frame, as its linking uses them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.curve import BSplineCurve
from dloftbs.kernels.continuity import follow, sample_curves
from dloftbs.mask_crop import MaskCrop

_STEP_WIDTHS = 0.5  # from sample to sample
_MAX_SAMPLES = 2000  # of a curve


class PriorSamples(NamedTuple):
    """Samples of the predicted curves, in the orientation of a mask crop.

    Parameters
    ----------
    points : numpy.ndarray, shape (m, 2)
        Evenly spaced samples of all curves, one after the other.
    first : numpy.ndarray, shape (c + 1,)
        First sample of each curve.
    steps, longest : numpy.ndarray, shape (c,)
        From sample to sample, on average and at most, px.
    closed : numpy.ndarray, shape (c,)
    weight : numpy.ndarray, shape (c,)
        In 0..1.
    """

    points: FloatArray
    first: npt.NDArray[np.int64]
    steps: FloatArray
    longest: FloatArray
    closed: npt.NDArray[np.bool_]
    weight: FloatArray


@dataclass(frozen=True, eq=False)
class TemporalPrior:
    """The predicted curves, sampled at their first use: most frames are unambiguous and never use them.

    Parameters
    ----------
    predicted : sequence of (BSplineCurve, float)
        Curves in the image, each with its weight in 0..1; one or more.
    patch : MaskCrop
    width : float
        Of the cables, px.
    """

    predicted: Sequence[tuple[BSplineCurve, float]]
    patch: MaskCrop
    width: float

    @cached_property
    def samples(self) -> PriorSamples:
        """Samples of the curves."""
        curves = [curve for curve, _ in self.predicted]
        closed = np.array([curve.closed for curve in curves])
        points, first, steps, longest = sample_curves(
            np.concatenate([curve.knots for curve in curves]),
            np.concatenate([curve.control_points for curve in curves]),
            np.array([len(curve.control_points) for curve in curves]),
            closed,
            *self.patch.image_transform,
            _STEP_WIDTHS * self.width,
            _MAX_SAMPLES,
        )
        return PriorSamples(points, first, steps, longest, closed, np.array([weight for _, weight in self.predicted]))

    def continuity(
        self, end_states: FloatArray, rows: npt.NDArray[np.int64], columns: npt.NDArray[np.int64]
    ) -> FloatArray:
        """Return how well pairs of ends continue each other along one of the curves, each in 0..1."""
        return follow(end_states, rows, columns, *self.samples, self.width)
