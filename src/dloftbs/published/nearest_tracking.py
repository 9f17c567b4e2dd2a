"""Tracks as published: an object is what lies nearest to it in the next frame, and runs the way that fits better."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from dloftbs._arrays import FloatArray
from dloftbs.curve import BSplineCurve
from dloftbs.errors import InputError
from dloftbs.frame import Detection, Track, TrackState
from dloftbs.observation import SAMPLES, Seen, look_at


class NearestTracker:
    """Gives each detection the id and the direction of the nearest curve of the last frame that showed any.

    It expects no motion, keeps nothing that is not seen, and tells the linking nothing.

    Examples
    --------
    >>> cable = BSplineCurve([0, 0, 0, 0, 1, 1, 1, 1], [(10, 20), (40, 25), (70, 25), (100, 20)])
    >>> tracker = NearestTracker()
    >>> for curve in (cable, cable.reversed()):
    ...     (track,) = tracker.update([curve])
    >>> track.id, track.curve(0.0).tolist()
    (1, [10.0, 20.0])
    """

    def __init__(self) -> None:
        self._tracks: tuple[Track, ...] = ()  # of the last frame that showed any
        self._shown: tuple[Track, ...] = ()
        self._newest = 0
        self._stamp: float | None = None

    def reset(self) -> None:
        """Forget all tracks and the time; ids go on from where they were, so that none is used twice."""
        self._tracks, self._shown, self._stamp = (), (), None

    def update(
        self,
        detections: Sequence[Detection | BSplineCurve],
        stamp: float | None = None,
        size: tuple[int, int] | None = None,
    ) -> tuple[Track, ...]:
        """Take one frame's detections and return the tracks, by id.

        Parameters
        ----------
        detections : sequence of Detection or BSplineCurve
            Curves are in the image, px.
        stamp : float, optional
            Seconds. A frame with the stamp of the last one is that one once more: nothing changes.
        size : (int, int), optional
            Makes no difference here.

        Raises
        ------
        InputError
            If something is no detection or curve in the image, or the stamp is not finite.
        """
        if stamp is not None and not math.isfinite(stamp):
            raise InputError(f"stamp must be a finite number of seconds, got {stamp}")
        seen = look_at(detections, None)
        if stamp is not None and stamp == self._stamp:
            return self._shown
        self._stamp = stamp
        self._shown = ()
        if not seen:
            return self._shown
        known = look_at([track.curve for track in self._tracks], None)
        points, before = (np.array([one.points for one in those]).reshape(-1, SAMPLES, 2) for those in (seen, known))
        there, back = (_distances(points, one) for one in (before, before[:, ::-1]))
        rows, columns = linear_sum_assignment(np.minimum(there, back))
        nearest = dict(zip(rows.tolist(), columns.tolist(), strict=True))
        tracks = []
        for d, one in enumerate(seen):
            if d not in nearest:
                self._newest += 1
                tracks.append(_track(self._newest, one, 1))
                continue
            k = nearest[d]
            shown = one if there[d, k] <= back[d, k] else one.reversed()
            tracks.append(_track(self._tracks[k].id, shown, self._tracks[k].hits + 1))
        self._tracks = self._shown = tuple(sorted(tracks, key=lambda track: track.id))
        return self._shown


def _distances(ones: FloatArray, others: FloatArray) -> FloatArray:
    """Return the mean distances of curves (n, SAMPLES, 2) from others (k, SAMPLES, 2), point by point, as (n, k)."""
    result: FloatArray = np.linalg.norm(ones[:, None] - others[None], axis=3).mean(axis=2)
    return result


def _track(number: int, seen: Seen, hits: int) -> Track:
    width = None if math.isnan(seen.width) else seen.width
    state = TrackState.CONFIRMED
    return Track._unchecked(number, state, seen.curve, seen.curve_3d, hits, 0, seen.detection, seen.gaps, 1.0, width)
