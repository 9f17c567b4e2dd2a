"""Temporal prior: the curves predicted for a frame, as its linking uses them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from dloftbs.data.graph import POSITION
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.data.prediction import Prediction
from dloftbs.kernels.continuity import follow, sample_curves
from dloftbs.support.arrays import BoolArray, FloatArray, IntArray

_STEP_WIDTHS = 0.5
"""Distance from sample to sample of a predicted curve, widths.

Source: by hand; half of what a curve may lie aside.
"""
MAX_SAMPLES = 2000
"""Largest number of samples of a predicted curve.

Source: bounds time.
"""
_END_WIDTHS = 2.0
"""Distance from a predicted end, in widths, beyond which an end has nothing to do with it.

Source: by hand.
"""


class PriorSamples(NamedTuple):
    """Samples of the predicted curves, in the orientation of a mask crop.

    Parameters
    ----------
    points : numpy.ndarray, shape (m, 2)
        Evenly spaced samples of all curves, one after the other. A curve with unseen stretches is one for each part
        between them.
    first : numpy.ndarray, shape (c + 1,)
        First sample of each curve.
    steps, longest : numpy.ndarray, shape (c,)
        From sample to sample, on average and at most, px.
    closed : numpy.ndarray, shape (c,)
    weight : numpy.ndarray, shape (c,)
        In 0..1.
    """

    points: FloatArray
    first: IntArray
    steps: FloatArray
    longest: FloatArray
    closed: BoolArray
    weight: FloatArray


@dataclass(frozen=True, eq=False)
class TemporalPrior:
    """The predicted curves, sampled at their first use: most frames are unambiguous and never use them.

    Parameters
    ----------
    predicted : sequence of Prediction
        One or more.
    crop : MaskCrop
    width_px : float
        Of the cables, px.
    """

    predicted: Sequence[Prediction]
    crop: MaskCrop
    width_px: float

    @cached_property
    def samples(self) -> PriorSamples:
        """Samples of the curves."""
        curves = [one.curve for one in self.predicted]
        closed = np.array([curve.closed for curve in curves])
        points, first, steps, longest = sample_curves(
            np.concatenate([curve.knots for curve in curves]),
            np.concatenate([curve.control_points for curve in curves]),
            np.array([len(curve.control_points) for curve in curves]),
            closed,
            *self.crop.image_transform,
            _STEP_WIDTHS * self.width_px,
            MAX_SAMPLES,
        )
        weight = np.array([one.confidence for one in self.predicted])
        samples = PriorSamples(points, first, steps, longest, closed, weight)
        return self._seen_parts(samples) if any(one.unseen for one in self.predicted) else samples

    def _seen_parts(self, samples: PriorSamples) -> PriorSamples:
        """Return the samples without the unseen stretches, the parts between them as curves of their own."""
        counts = np.diff(samples.first)
        owner = np.repeat(np.arange(len(counts)), counts)
        u = (np.arange(len(owner)) - samples.first[owner]) / (counts[owner] - 1)
        seen = np.ones(len(owner), dtype=np.bool_)
        for number, one in enumerate(self.predicted):
            for low, high in one.unseen:
                seen &= (owner != number) | (u < low) | (u > high)
        follows = np.concatenate(([False], seen[:-1] & (owner[1:] == owner[:-1])))
        starts = np.flatnonzero(seen & ~follows)
        first = np.append(np.cumsum(seen)[starts] - 1, np.count_nonzero(seen))
        part_of = owner[starts]
        whole = np.array([not one.unseen for one in self.predicted])
        return PriorSamples(
            samples.points[seen],
            first,
            samples.steps[part_of],
            samples.longest[part_of],
            (samples.closed & whole)[part_of],
            samples.weight[part_of],
        )

    @property
    def knows_of_cuts(self) -> bool:
        """True if any two of the objects are known to be no longer one."""
        return any(one.apart for one in self.predicted)

    def are_apart(self, end_states: FloatArray, rows: IntArray, columns: IntArray) -> BoolArray:
        """Return whether pairs of ends are those of two objects that are known not to hang together, shape (k,)."""
        ends = np.concatenate([one.curve.spline(np.array([0.0, 1.0])) for one in self.predicted])
        distances = np.linalg.norm(end_states[:, None, POSITION] - self.crop.to_oriented(ends), axis=2)
        owners = distances.argmin(axis=1) // 2
        near = distances.min(axis=1) < _END_WIDTHS * self.width_px
        apart = np.array([[one.id in other.apart for one in self.predicted] for other in self.predicted])
        one, other = owners[rows], owners[columns]
        result: BoolArray = (apart | apart.T)[one, other] & near[rows] & near[columns]
        return result

    def continuity(self, end_states: FloatArray, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return how well pairs of ends continue each other along one of the curves, each in 0..1."""
        return follow(end_states, rows, columns, *self.samples, self.width_px)
