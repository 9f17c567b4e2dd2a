"""Tracking as published: an object keeps the nearest curve of the next frame, in the direction that fits better."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from dloftbs.data.curve import BSplineCurve, spans_by_length
from dloftbs.data.curve_samples import SAMPLES, sample_curve
from dloftbs.data.detection import Detection, curves_of
from dloftbs.data.prediction import Prediction
from dloftbs.data.tracks import Track, TrackState
from dloftbs.errors import InputError
from dloftbs.evidence import OcclusionEvidence
from dloftbs.support.arrays import FloatArray


class NearestTracker:
    """Gives each detection the id and the direction of the nearest curve of the last frame that showed any.

    It predicts no motion, keeps no hidden object, and gives the linking no prior.

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
        self._published: tuple[Track, ...] = ()
        self._last_id = 0
        self._stamp: float | None = None

    def predict(self, stamp: float | None = None) -> tuple[Prediction, ...]:
        """Return nothing: the linking as published has no prior."""
        return ()

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The tracks as last published."""
        return self._published

    @property
    def _held_ids(self) -> set[int]:
        """Ids of all tracks that may go on."""
        return {track.id for track in self._tracks}

    def reset(self) -> None:
        """Forget all tracks and the time; ids continue, so that none is used twice."""
        self._tracks, self._published, self._stamp = (), (), None

    def update(
        self,
        detections: Sequence[Detection | BSplineCurve],
        stamp: float | None = None,
        size: tuple[int, int] | None = None,
        *,
        occlusion: OcclusionEvidence | None = None,
        outline: FloatArray | None = None,
    ) -> tuple[Track, ...]:
        """Take one frame's detections and return the tracks, by id.

        Parameters
        ----------
        detections : sequence of Detection or BSplineCurve
            Curves are in the image, px.
        stamp : float, optional
            Seconds. A frame with the stamp of the last one is a repetition: nothing changes.
        size, occlusion : optional
            Ignored.

        Raises
        ------
        InputError
            If an item is neither a detection nor a curve in the image, or the stamp is not finite.
        """
        if stamp is not None and not math.isfinite(stamp):
            raise InputError(f"stamp must be a finite number of seconds, got {stamp}")
        curves = curves_of(detections)
        if stamp is not None and stamp == self._stamp:
            return self._published
        self._stamp = stamp
        self._published = ()
        found = [item for item, curve in zip(detections, curves, strict=True) if sample_curve(curve)[1] > 0.0]
        if not found:
            return self._published
        points, before = (
            np.array([sample_curve(curve)[0] for curve in those]).reshape(-1, SAMPLES, 2)
            for those in (curves_of(found), [track.curve for track in self._tracks])
        )
        forward, backward = (_mean_distances(points, one) for one in (before, before[:, ::-1]))
        rows, columns = linear_sum_assignment(np.minimum(forward, backward))
        nearest = dict(zip(rows.tolist(), columns.tolist(), strict=True))
        tracks = []
        for d, one in enumerate(found):
            if d not in nearest:
                self._last_id += 1
                tracks.append(_make_track(self._last_id, one, 1))
                continue
            k = nearest[d]
            oriented = one if forward[d, k] <= backward[d, k] else one.reversed()
            tracks.append(_make_track(self._tracks[k].id, oriented, self._tracks[k].hits + 1))
        self._tracks = self._published = tuple(sorted(tracks, key=lambda track: track.id))
        return self._published


def _mean_distances(ones: FloatArray, others: FloatArray) -> FloatArray:
    """Return the mean distances of curves (n, SAMPLES, 2) from others (k, SAMPLES, 2), sample by sample, as (n, k)."""
    result: FloatArray = np.linalg.norm(ones[:, None] - others[None], axis=3).mean(axis=2)
    return result


def _make_track(track_id: int, one: Detection | BSplineCurve, hits: int) -> Track:
    state = TrackState.CONFIRMED
    if isinstance(one, BSplineCurve):
        return Track(track_id, state, one, None, hits, 0, None)
    inferred = spans_by_length(one.curve, one.centerline.gaps)
    shown = one.curve, one.curve_3d, hits, 0, one, inferred, one.confidence, one.width_px
    return Track(track_id, state, *shown, camera=one.camera)
