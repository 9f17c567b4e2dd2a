"""Samples of a track: `SAMPLES` values at even ``u``."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.observation import SAMPLES, U


def samples_within(spans: tuple[tuple[float, float], ...]) -> npt.NDArray[np.bool_]:
    """Return a mask (SAMPLES,) of the samples that lie in spans of ``u``."""
    result = np.zeros(SAMPLES, dtype=np.bool_)
    for low, high in spans:
        result |= (low <= U) & (high >= U)
    return result


def interpolate_samples(samples: FloatArray, u: FloatArray) -> FloatArray:
    """Interpolate samples (SAMPLES, d) at parameters (n,), as (n, d)."""
    return np.stack([np.interp(u, U, column) for column in samples.T], axis=1)
