"""Detections to tracks: identity and direction held by continuity between frames (paper: tracking).

The only place with memory; it remembers what it published.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from dloftbs._arrays import FloatArray
from dloftbs.config import TrackingConfig
from dloftbs.curve import BSplineCurve
from dloftbs.frame import Detection, Track, TrackState

_SAMPLES = 32  # points of a curve that stand for it in comparisons
_U = np.linspace(0.0, 1.0, _SAMPLES)
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
        self._published: list[_Trace] = []  # of each track's curve, as it was published
        self._next_id = 1

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The tracks as they were last published."""
        return self._tracks

    def reset(self) -> None:
        """Forget all tracks; ids go on from where they were, so that none is used twice."""
        self._tracks = ()
        self._published = []

    def update(self, detections: Sequence[Detection]) -> tuple[Track, ...]:
        """Take one frame's detections and return the tracks as they stand after it.

        Each detection goes to at most one track, by the assignment with the least sum of mean curve distances, both
        ways; what is farther than the gate, the nearer way, starts a track of its own.

        Parameters
        ----------
        detections : sequence of Detection

        Returns
        -------
        tuple of Track
            By id.
        """
        detected = [_Trace.of(detection.curve) for detection in detections]
        partner = self._assign(detected)
        tracks: list[Track] = []
        published: list[_Trace] = []
        for row, track in enumerate(self._tracks):
            before, index = self._published[row], partner.get(row)
            if index is None:
                follow_up, trace = self._miss(track), before
            else:
                detection, trace = detections[index], detected[index]
                if _runs_backwards(trace, before):
                    detection, trace = detection.reversed(), trace.reversed()
                follow_up = self._hit(track, detection)
            if follow_up is not None:
                tracks.append(follow_up)
                published.append(trace)
        taken = set(partner.values())
        for index, detection in enumerate(detections):
            if index not in taken:
                tracks.append(self._start(detection))
                published.append(detected[index])
        self._tracks, self._published = tuple(tracks), published
        return self._tracks

    def _assign(self, detected: list[_Trace]) -> dict[int, int]:
        """Map the rows of known tracks to detections."""
        if not self._tracks or not detected:
            return {}
        nearness, difference = _distances(self._published, detected)
        longer = np.maximum.outer([trace.length for trace in self._published], [trace.length for trace in detected])
        within = nearness < self._config.gate * longer
        # Beyond the gate all pairs cost the same, more than all others together, and are dropped afterwards.
        rows, columns = linear_sum_assignment(np.where(within, difference, difference.sum() + 1.0))
        return {r: c for r, c in zip(rows.tolist(), columns.tolist(), strict=True) if within[r, c]}

    def _start(self, detection: Detection) -> Track:
        state = TrackState.CONFIRMED if self._config.min_hits <= 1 else TrackState.TENTATIVE
        track = Track(self._next_id, state, detection.curve, detection.curve_3d, 1, 0, detection)
        self._next_id += 1
        return track

    def _hit(self, track: Track, detection: Detection) -> Track:
        hits = track.hits + 1
        confirmed = track.state is not TrackState.TENTATIVE or hits >= self._config.min_hits
        state = TrackState.CONFIRMED if confirmed else TrackState.TENTATIVE
        return Track(track.id, state, detection.curve, detection.curve_3d, hits, 0, detection)

    def _miss(self, track: Track) -> Track | None:
        if track.state is TrackState.TENTATIVE or track.misses >= self._config.max_misses:
            return None
        return Track(track.id, TrackState.COASTING, track.curve, track.curve_3d, track.hits, track.misses + 1, None)


class _Trace(NamedTuple):
    """What stands for a curve in comparisons: points (n, 2) along it, px, their length, and whether it is a loop."""

    points: FloatArray
    length: float
    closed: bool

    @classmethod
    def of(cls, curve: BSplineCurve) -> _Trace:
        points = curve(_U)
        return cls(points, float(_norms(points[1:] - points[:-1]).sum()), curve.closed)

    def reversed(self) -> _Trace:
        return self._replace(points=self.points[::-1])


def _norms(vectors: FloatArray) -> FloatArray:
    """Return the lengths of vectors (..., 2)."""
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))


def _distances(old: list[_Trace], new: list[_Trace]) -> tuple[FloatArray, FloatArray]:
    """Return how near curves lie to each other and how much they differ, shape (old, new) each, px.

    Both come from the two mean distances from one curve's points to the other's nearest: the smaller one, by which a
    visible part is near to its whole, and their mean, by which the piece that shows most of it differs least.
    """
    a, b = (np.array([trace.points for trace in traces]) for traces in (old, new))
    dx = a[:, None, :, None, 0] - b[None, :, None, :, 0]
    dy = a[:, None, :, None, 1] - b[None, :, None, :, 1]
    squared = dx * dx + dy * dy
    there = np.sqrt(squared.min(axis=3)).mean(axis=2)
    back = np.sqrt(squared.min(axis=2)).mean(axis=2)
    return np.minimum(there, back), (there + back) / 2.0


def _runs_backwards(seen: _Trace, published: _Trace) -> bool:
    """Tell whether a curve must be reversed to run as the published one does.

    The shorter one is laid along the longer one wherever it may lie, point by point, in both directions.
    """
    if seen.closed and published.closed:
        return _signed_area(seen.points) * _signed_area(published.points) < 0.0
    # Of an open curve and a loop, the loop is the whole.
    part, whole = sorted((seen, published), key=lambda trace: (trace.closed, trace.length))
    places = _places(whole, min(part.length / whole.length, 1.0) if whole.length > 0.0 else 1.0)
    forwards = _norms(places - part.points).sum(axis=1).min()
    backwards = _norms(places - part.points[::-1]).sum(axis=1).min()
    return bool(backwards < forwards)


def _places(whole: _Trace, share: float) -> FloatArray:
    """Return where a part may lie that is this share of a whole, as points (places, n, 2)."""
    slack = 1.0 if whole.closed else 1.0 - share
    count = 1 + round(slack * _PLACES)
    if count == 1:
        return whole.points[None]
    u = (np.linspace(0.0, slack, count)[:, None] + share * _U) % (1.0 + 1e-12)  # a loop goes on behind its seam
    return np.stack([np.interp(u, _U, coordinate) for coordinate in whole.points.T], axis=2)


def _signed_area(points: FloatArray) -> float:
    x, y = points.T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2.0
