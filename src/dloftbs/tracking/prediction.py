"""Prediction of the tracks for the next frame, by their motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.tracking.track_model import TrackModel


class PredictedTracks(NamedTuple):
    """Predicted samples of the tracks.

    Parameters
    ----------
    points : numpy.ndarray, shape (t, SAMPLES, 2)
    lengths, length_tolerances : numpy.ndarray, shape (t,)
        px; and the largest differences that do not count.
    closed : numpy.ndarray, shape (t,), bool
    """

    points: FloatArray
    lengths: FloatArray
    length_tolerances: FloatArray
    closed: npt.NDArray[np.bool_]

    @classmethod
    def extrapolate(cls, models: Sequence[TrackModel], duration_s: float) -> PredictedTracks:
        """Predict the tracks by continuing their motion for some seconds."""
        points = np.array([m.points for m in models])
        points += duration_s * np.array([m.motion.velocity for m in models])
        lengths, tolerances = np.array([m.length for m in models]), np.array([m.length_tolerance_px for m in models])
        return cls(points, lengths, tolerances, np.array([m.curve.closed for m in models]))

    def subset(self, rows: list[int]) -> PredictedTracks:
        """Return some of the tracks."""
        return PredictedTracks(self.points[rows], self.lengths[rows], self.length_tolerances[rows], self.closed[rows])
