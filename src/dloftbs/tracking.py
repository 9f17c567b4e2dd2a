"""Detections to tracks: identity and direction held by continuity between frames (paper, section III-G).

The only place with memory; it remembers what it published.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from dloftbs._arrays import FloatArray
from dloftbs.config import TrackingConfig
from dloftbs.frame import Detection, Track, TrackState

_SAMPLES = 32  # points of a curve that stand for it in comparisons
_PLACES = 32  # places along a whole curve where a visible part of it is tried
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
        self._published: list[FloatArray] = []  # points of each track's curve, as it was published
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
        detected = [detection.curve.sample(_SAMPLES) for detection in detections]
        partner = self._assign(detected)
        tracks: list[Track] = []
        published: list[FloatArray] = []
        for row, track in enumerate(self._tracks):
            before, index = self._published[row], partner.get(row)
            if index is None:
                follow_up, points = self._miss(track), before
            else:
                detection, points = detections[index], detected[index]
                if _runs_backwards(points, before, detection.curve.closed, track.curve.closed):
                    detection, points = detection.reversed(), points[::-1]
                follow_up = self._hit(track, detection)
            if follow_up is not None:
                tracks.append(follow_up)
                published.append(points)
        taken = set(partner.values())
        for index, detection in enumerate(detections):
            if index not in taken:
                tracks.append(self._start(detection))
                published.append(detected[index])
        self._tracks, self._published = tuple(tracks), published
        return self._tracks

    def _assign(self, detected: list[FloatArray]) -> dict[int, int]:
        """Map the rows of known tracks to detections, given as points of their curves."""
        if not self._tracks or not detected:
            return {}
        old, new = np.stack(self._published), np.stack(detected)
        nearness, difference = _distances(old, new)
        within = nearness < self._config.gate * np.maximum.outer(_lengths(old), _lengths(new))
        # Beyond the gate all pairs cost the same, more than all others together, and are dropped afterwards.
        rows, columns = linear_sum_assignment(np.where(within, difference, difference.sum() + 1.0))
        return {int(r): int(c) for r, c in zip(rows, columns, strict=True) if within[r, c]}

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


def _distances(old: FloatArray, new: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how near curves (curves, n, 2) lie to each other and how much they differ, shape (old, new) each, px.

    Both come from the two mean distances from one curve's points to the other's nearest: the smaller one, by which a
    visible part is near to its whole, and their mean, by which the piece that shows most of it differs least.
    """
    dx = old[:, None, :, None, 0] - new[None, :, None, :, 0]
    dy = old[:, None, :, None, 1] - new[None, :, None, :, 1]
    squared = dx * dx + dy * dy
    nearest_new, nearest_old = np.sqrt(squared.min(axis=3)), np.sqrt(squared.min(axis=2))
    there, back = nearest_new.mean(axis=2), nearest_old.mean(axis=2)
    return np.minimum(there, back), (there + back) / 2.0


def _lengths(points: FloatArray) -> FloatArray:
    """Return the lengths of polylines (curves, n, 2), px."""
    return np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)


def _runs_backwards(points: FloatArray, published: FloatArray, closed: bool, published_closed: bool) -> bool:
    """Tell whether a curve must be reversed to run as the published one does; each is given as points (n, 2).

    The shorter one is laid along the longer one wherever it may lie, point by point, in both directions.
    """
    if closed and published_closed:
        return _signed_area(points) * _signed_area(published) < 0.0
    length, length_before = _lengths(np.stack((points, published))).tolist()
    if (closed, length) < (published_closed, length_before):  # of an open curve and a loop, the loop is the whole
        part, whole, share, is_loop = points, published, length / length_before, published_closed
    else:
        part, whole, share, is_loop = published, points, length_before / length, closed
    places = _places(whole, min(share, 1.0), is_loop)
    forwards, backwards = (np.linalg.norm(places - p, axis=2).sum(axis=1).min() for p in (part, part[::-1]))
    return bool(backwards < forwards)


def _places(whole: FloatArray, share: float, closed: bool) -> FloatArray:
    """Return where a part may lie that is this share of a whole (n, 2), as points (places, n, 2)."""
    slack = 1.0 if closed else 1.0 - share
    count = 1 + round(slack * _PLACES)
    if count == 1:
        return whole[None]
    u = (np.linspace(0.0, slack, count)[:, None] + share * _U) % (1.0 + 1e-12)  # a loop goes on behind its seam
    return np.stack([np.interp(u, _U, coordinate) for coordinate in whole.T], axis=2)


def _signed_area(points: FloatArray) -> float:
    x, y = points.T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2.0
