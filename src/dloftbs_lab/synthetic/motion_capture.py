"""Recorded motion of real cables: markers along each cable, by motion capture, in files that are read in place."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from dloftbs.errors import SourceError, source_errors
from dloftbs.support.arrays import FloatArray
from dloftbs.support.npy import BROKEN, read_members
from dloftbs.support.text import readable

FILES = "cable_*.npz"
"""Names of the files of a folder that are read."""
_MARKERS, _RATE = "markers", "rate_hz"
_FEWEST_MARKERS, _FEWEST_FRAMES = 4, 4
"""A cubic spline goes through four points or more."""
_MAX_BYTES = 1 << 28
"""Of the markers of a file: by hand; 256 MiB are an hour of 100 recordings."""
_FINER = 4
"""Points on the spline for each point that is asked for, between which its length is measured by chords."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Recorded motion of one cable.

    Parameters
    ----------
    markers : numpy.ndarray, shape (frames, n, 3)
        Places of the markers, from end to end, metres, z upwards.
    rate_hz : float
        Frames of the recording per second.
    """

    markers: FloatArray
    rate_hz: float

    @property
    def seconds(self) -> float:
        """Time from the first frame to the last."""
        return (len(self.markers) - 1) / self.rate_hz

    def axis(self, second: float, count: int) -> FloatArray:
        """Return `count` points along the cable, evenly spaced, by cubic splines in time and along it, (count, 3) m."""
        along = self._along
        fine = CubicSpline(along, self._moving(second))(np.linspace(0.0, along[-1], _FINER * count))
        arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))))
        even = np.linspace(0.0, arc[-1], count)
        return np.stack([np.interp(even, arc, values) for values in fine.T], axis=1)

    @cached_property
    def length_m(self) -> float:
        """Mean length of the polyline through the markers."""
        return float(self._along[-1])

    @cached_property
    def _along(self) -> FloatArray:
        """Mean distance of each marker from the first, along the markers, m: the spline's parameter, shape (n,)."""
        steps = np.linalg.norm(np.diff(self.markers, axis=1), axis=2).mean(axis=0)
        return np.concatenate(([0.0], np.cumsum(steps)))

    @cached_property
    def _moving(self) -> CubicSpline:
        return CubicSpline(np.arange(len(self.markers)) / self.rate_hz, self.markers)


@lru_cache(maxsize=4)
def recordings_in(folder: Path) -> tuple[Recording, ...]:
    """Return the recordings in the files ``cable_*.npz`` of a folder, by file, then by number.

    A file has the arrays ``markers``, shape (recordings, frames, n, 3) m, z upwards, and ``rate_hz``.

    Raises
    ------
    SourceError
        If there is no such file, or one cannot be read or holds something else.
    """
    files = sorted(folder.glob(FILES))
    if not files:
        raise SourceError(f"there is no file {FILES} in {readable(str(folder))}")
    return tuple(recording for file in files for recording in _read(file))


def _read(file: Path) -> list[Recording]:
    name = readable(str(file))
    with source_errors(f"cannot read recorded motion from {name}", BROKEN):
        _, arrays = read_members(file, (_MARKERS, _RATE), _MAX_BYTES)
        markers, rate = arrays[_MARKERS].astype(np.float64), float(arrays[_RATE])
    whole = markers.ndim == 4 and markers.shape[1] >= _FEWEST_FRAMES and markers.shape[2] >= _FEWEST_MARKERS
    if not whole or markers.shape[3] != 3 or not np.isfinite(markers).all():
        raise SourceError(
            f"{name}: {_MARKERS} must be finite, of shape (recordings, frames, n, 3), with {_FEWEST_FRAMES} frames and "
            f"{_FEWEST_MARKERS} markers or more, got shape {markers.shape}"
        )
    if not 0.0 < rate < math.inf:
        raise SourceError(f"{name}: {_RATE} must be positive, got {rate}")
    return [Recording(one, rate) for one in markers]
