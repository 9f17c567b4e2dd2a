"""Detections to tracks: identity and direction held by continuity between frames (paper, section III-G).

The only place with memory; it remembers what it published.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from dloftbs._arrays import FloatArray
from dloftbs.config import TrackingConfig
from dloftbs.curve import BSplineCurve
from dloftbs.frame import Detection, Track, TrackState

_SAMPLES = 32  # points of a curve that stand for it in comparisons
_PLACES = 32  # places along a whole curve where a visible part of it is tried


class Tracker:
    """Holds identity and direction over a stream of detections from any detector.

    Parameters
    ----------
    config : TrackingConfig

    Examples
    --------
    >>> tracker = Tracker()
    >>> tracker.update([])
    ()
    """

    def __init__(self, config: TrackingConfig | None = None) -> None:
        self._config = TrackingConfig() if config is None else config
        self._tracks: tuple[Track, ...] = ()
        self._next_id = 1

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The tracks as they were last published."""
        return self._tracks

    def reset(self) -> None:
        """Forget all tracks; ids go on from where they were, so that none is used twice."""
        self._tracks = ()

    def update(self, detections: Sequence[Detection]) -> tuple[Track, ...]:
        """Take one frame's detections and return the tracks as they stand after it.

        Each detection goes to at most one track, by the assignment with the least sum of mean curve distances; what is
        farther than the gate starts a track of its own.

        Parameters
        ----------
        detections : sequence of Detection

        Returns
        -------
        tuple of Track
            By id.
        """
        partner = self._assign(detections)
        tracks = []
        for row, track in enumerate(self._tracks):
            index = partner.get(row)
            follow_up = self._miss(track) if index is None else self._hit(track, detections[index])
            if follow_up is not None:
                tracks.append(follow_up)
        taken = set(partner.values())
        tracks += [self._start(detection) for i, detection in enumerate(detections) if i not in taken]
        self._tracks = tuple(tracks)
        return self._tracks

    def _assign(self, detections: Sequence[Detection]) -> dict[int, int]:
        """Map the rows of known tracks to detections."""
        if not self._tracks or not detections:
            return {}
        old, new = [track.curve for track in self._tracks], [detection.curve for detection in detections]
        distance = _distances(old, new)
        longer = np.maximum.outer([curve.length for curve in old], [curve.length for curve in new])
        gate = self._config.gate * longer
        # Beyond the gate all pairs cost the same, more than any within, and are dropped afterwards.
        rows, columns = linear_sum_assignment(np.where(distance < gate, distance, gate.max() * len(gate) * 2.0))
        return {int(r): int(c) for r, c in zip(rows, columns, strict=True) if distance[r, c] < gate[r, c]}

    def _start(self, detection: Detection) -> Track:
        state = TrackState.CONFIRMED if self._config.min_hits <= 1 else TrackState.TENTATIVE
        track = Track(self._next_id, state, detection.curve, detection.curve_3d, 1, 0, detection)
        self._next_id += 1
        return track

    def _hit(self, track: Track, detection: Detection) -> Track:
        if _runs_backwards(detection.curve, track.curve):
            detection = detection.reversed()
        hits = track.hits + 1
        confirmed = track.state is not TrackState.TENTATIVE or hits >= self._config.min_hits
        state = TrackState.CONFIRMED if confirmed else TrackState.TENTATIVE
        return Track(track.id, state, detection.curve, detection.curve_3d, hits, 0, detection)

    def _miss(self, track: Track) -> Track | None:
        if track.state is TrackState.TENTATIVE or track.misses >= self._config.max_misses:
            return None
        return Track(track.id, TrackState.COASTING, track.curve, track.curve_3d, track.hits, track.misses + 1, None)


def _distances(old: Sequence[BSplineCurve], new: Sequence[BSplineCurve]) -> FloatArray:
    """Return how far curves lie apart, shape (old, new), px.

    The smaller of the two mean distances from one curve's points to the other's nearest, so that a visible part matches
    its whole.
    """
    a = np.stack([curve.sample(_SAMPLES) for curve in old])
    b = np.stack([curve.sample(_SAMPLES) for curve in new])
    apart = np.linalg.norm(a[:, None, :, None] - b[None, :, None, :], axis=-1)
    return np.minimum(apart.min(axis=3).mean(axis=2), apart.min(axis=2).mean(axis=2))


def _runs_backwards(curve: BSplineCurve, published: BSplineCurve) -> bool:
    """Tell whether a curve must be reversed to run as the published one does.

    The shorter one is laid along the longer one wherever it may lie, point by point, in both directions.
    """
    if curve.closed and published.closed:
        return _signed_area(curve.sample(_SAMPLES)) * _signed_area(published.sample(_SAMPLES)) < 0.0
    part, whole = sorted((curve, published), key=lambda c: (c.closed, c.length))  # of an open one and a loop, the loop
    share = min(part.length / whole.length, 1.0)
    slack = 1.0 if whole.closed else 1.0 - share
    starts = np.linspace(0.0, slack, 1 + math.ceil(slack * _PLACES))
    places = whole(starts[:, None] + share * np.linspace(0.0, 1.0, _SAMPLES))
    points = part.sample(_SAMPLES)
    forwards, backwards = (np.linalg.norm(places - p, axis=-1).sum(axis=1).min() for p in (points, points[::-1]))
    return bool(backwards < forwards)


def _signed_area(points: FloatArray) -> float:
    x, y = points.T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2.0
