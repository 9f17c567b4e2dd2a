"""Prediction of the tracks for the next frame, by their motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.tracking.track_model import TrackModel


def predict_points(models: Sequence[TrackModel], duration_s: float) -> FloatArray:
    """Return the samples (t, SAMPLES, 2) of the tracks after some seconds of their motion."""
    return np.array([m.points + duration_s * m.motion.velocity for m in models])
