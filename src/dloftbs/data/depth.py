"""Depth as it is stored, in metres."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.config import DepthConfig
from dloftbs.support.arrays import FloatArray

_READABLE = (np.dtype(np.float32), np.dtype(np.float64), np.dtype(np.uint16))


class ReadableDepth(NamedTuple):
    """A depth image with what its values mean, as the kernels of the lifting take it.

    Parameters
    ----------
    stored : numpy.ndarray, shape (H, W), float32, float64 or uint16
    unit_m : float
        Metres of one count.
    nearest_m, farthest_m : float
        Depth outside of this range is missing.
    """

    stored: npt.NDArray[Any]
    unit_m: float
    nearest_m: float
    farthest_m: float

    @classmethod
    def of(cls, stored: npt.NDArray[Any], depth_unit_m: float, config: DepthConfig) -> ReadableDepth:
        """Return the depth of a frame; values of other types are converted."""
        values = stored if stored.dtype in _READABLE else stored.astype(np.float64)
        return cls(values, unit_of(stored, depth_unit_m), *config.range_m)


def unit_of(depth: npt.NDArray[Any], depth_unit_m: float) -> float:
    """Return the metres per count of a depth image, given those of an integer one."""
    return 1.0 if depth.dtype.kind == "f" else depth_unit_m


def to_metres(stored: npt.NDArray[Any], depth_unit_m: float, config: DepthConfig) -> FloatArray:
    """Return depth in metres, NaN where it is missing: not finite, or outside of `DepthConfig.range_m`."""
    metres: FloatArray = stored.astype(np.float64) * unit_of(stored, depth_unit_m)
    low, high = config.range_m
    with np.errstate(invalid="ignore"):
        metres[~((metres >= low) & (metres <= high))] = np.nan
    return metres
