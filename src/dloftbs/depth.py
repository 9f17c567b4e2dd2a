"""Depth as it is stored, in metres."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.config import DepthConfig


def unit_of(depth: npt.NDArray[Any], config: DepthConfig) -> float:
    """Return the metres per count of a depth image."""
    return 1.0 if depth.dtype.kind == "f" else config.integer_unit_m


def to_metres(stored: npt.NDArray[Any], config: DepthConfig) -> FloatArray:
    """Return depth in metres, NaN where it is missing: not finite, or outside of `DepthConfig.range_m`."""
    metres: FloatArray = stored.astype(np.float64) * unit_of(stored, config)
    low, high = config.range_m
    with np.errstate(invalid="ignore"):
        metres[~((metres >= low) & (metres <= high))] = np.nan
    return metres
