"""Scores of identities and directions over a sequence: CLEAR MOT, IDF1, direction flips.

`TrackingScorer` takes a frame at a time and knows neither the tracker nor what its distances mean. Nothing found is
a value: a frame without output counts each of its objects as missed, and a rate of nothing is NaN, never left out.

References
----------
Bernardin, Stiefelhagen: Evaluating Multiple Object Tracking Performance: The CLEAR MOT Metrics, 2008 (MOTA, MOTP).
Li, Huang, Nevatia: Learning to Associate: HybridBoosted Multi-Target Tracker for Crowded Scene, 2009 (mostly tracked).
Ristani, Solera, Zou, Cucchiara, Tomasi: Performance Measures and a Data Set for Multi-Target, Multi-Camera Tracking,
2016 (IDF1).
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, fields
from itertools import groupby

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.evaluation.gate import check_gate

_MOSTLY, _HARDLY = 0.8, 0.2  # of an object's frames


@dataclass(frozen=True)
class TrackingScores:
    """Counts of the events in a sequence; the sum of two counts both, each with identities of its own.

    Parameters
    ----------
    frames : int
    objects : int
        Appearances of true objects: in how many frames each is, summed.
    outputs : int
        Appearances of tracks, likewise.
    matches : int
        Appearances of objects that were given a track, switches included.
    distance_sum : float
        Over the matches, in the unit of the distances.
    switches : int
        Matches of an object to another track than the last one that it had, however long ago.
    flips : int
        Matches of an object to a track that ran the other way when the two last met.
    fragmentations : int
        Interruptions of an object's matches, by frames in which it was there and not matched, that end with a match.
    id_matches : int
        ``IDTP``: frames in which the one track that an object is given for the whole sequence is near enough to it.
    mostly_tracked, partly_tracked, mostly_lost : int
        Objects that were matched in at least 80 per cent of their frames, in less, and in less than 20 per cent.
    """

    frames: int = 0
    objects: int = 0
    outputs: int = 0
    matches: int = 0
    distance_sum: float = 0.0
    switches: int = 0
    flips: int = 0
    fragmentations: int = 0
    id_matches: int = 0
    mostly_tracked: int = 0
    partly_tracked: int = 0
    mostly_lost: int = 0

    def __add__(self, other: TrackingScores) -> TrackingScores:
        names = [field.name for field in fields(self)]
        return TrackingScores(**{name: getattr(self, name) + getattr(other, name) for name in names})

    @property
    def misses(self) -> int:
        """Appearances of objects without a track."""
        return self.objects - self.matches

    @property
    def false_positives(self) -> int:
        """Appearances of tracks without an object."""
        return self.outputs - self.matches

    @property
    def mota(self) -> float:
        """``1 - (misses + false positives + switches) / objects``; negative for the worst, NaN without objects."""
        return 1.0 - _ratio(self.misses + self.false_positives + self.switches, self.objects)

    @property
    def motp(self) -> float:
        """Mean distance of the matches, in the unit of the distances: smaller is better; NaN without matches."""
        return _ratio(self.distance_sum, self.matches)

    @property
    def idf1(self) -> float:
        """``2 IDTP / (objects + outputs)``, 0 to 1; NaN without either."""
        return _ratio(2 * self.id_matches, self.objects + self.outputs)


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else math.nan


class TrackingScorer:
    """Collects the frames of one sequence.

    Parameters
    ----------
    gate : float, optional
        The largest distance at which a track can be that of an object; in the unit of the distances. Without it only
        those that are NaN or infinite cannot.

    Raises
    ------
    InputError
        If the gate is negative.
    """

    def __init__(self, gate: float = math.inf) -> None:
        self._gate = check_gate("gate", gate)
        self._counts: Counter[str] = Counter()
        self._distance_sum = 0.0
        self._track_of: dict[Hashable, Hashable] = {}
        self._forward: dict[tuple[Hashable, Hashable], bool] = {}
        self._near: Counter[tuple[Hashable, Hashable]] = Counter()
        self._matched: defaultdict[Hashable, list[bool]] = defaultdict(list)

    def add(
        self,
        true_ids: Sequence[Hashable],
        track_ids: Sequence[Hashable],
        distances: npt.ArrayLike,
        forward: npt.ArrayLike | None = None,
    ) -> dict[Hashable, Hashable]:
        """Count a frame.

        As in CLEAR MOT, an object keeps the track that it last had where that is near enough. Of several objects that
        last had the same track, the one that had it most recently keeps it; `motmetrics` takes the first in the list.
        Among the others as many as possible are matched, with the least sum of distances. The order of the objects does
        not matter.

        Parameters
        ----------
        true_ids : sequence of hashable
            The objects that are in the frame, hidden ones included if they should be tracked.
        track_ids : sequence of hashable
            The tracks that were put out; none is right for a frame without output.
        distances : array_like, shape (objects, tracks)
            For instance undirected L3 (`compare_curves`), or the mean of `point_error`. NaN or infinite where the two
            cannot be one.
        forward : array_like, shape (objects, tracks), bool, optional
            Whether the track runs as the object does. Without it the frame says nothing about directions.

        Returns
        -------
        dict
            From each object that was given a track to that track.

        Raises
        ------
        InputError
            If an id comes twice, a shape is wrong, or a distance is negative.
        """
        shape = (_check_ids("true_ids", true_ids), _check_ids("track_ids", track_ids))
        distance = _as_matrix("distances", distances, shape).astype(np.float64)
        if (distance < 0.0).any():
            raise InputError(f"distances must not be negative, got {np.nanmin(distance)}")
        distance[~(distance <= self._gate)] = np.inf
        directions = None if forward is None else _as_matrix("forward", forward, shape).astype(np.bool_)
        for i, j in zip(*np.nonzero(np.isfinite(distance)), strict=True):
            self._near[true_ids[i], track_ids[j]] += 1
        pairs = self._match(true_ids, track_ids, distance)
        for i, j in pairs.items():
            self._count_match(true_ids[i], track_ids[j], None if directions is None else bool(directions[i, j]))
            self._distance_sum += float(distance[i, j])
        for i, true_id in enumerate(true_ids):
            self._matched[true_id].append(i in pairs)
        self._counts.update(frames=1, objects=shape[0], outputs=shape[1], matches=len(pairs))
        return {true_ids[i]: track_ids[j] for i, j in pairs.items()}

    def track_of(self, true_id: Hashable) -> Hashable | None:
        """Return the track that an object had last, or None where it never had one."""
        return self._track_of.get(true_id)

    def _match(
        self, true_ids: Sequence[Hashable], track_ids: Sequence[Hashable], distance: FloatArray
    ) -> dict[int, int]:
        """Return the rows that are matched and their columns: first those that go on, then the best of the others."""
        row_of = {true_id: i for i, true_id in enumerate(true_ids)}
        column_of = {track_id: j for j, track_id in enumerate(track_ids)}
        pairs: dict[int, int] = {}
        for true_id, track_id in reversed(self._track_of.items()):
            i, j = row_of.get(true_id), column_of.get(track_id)
            if i is not None and j is not None and j not in pairs.values() and np.isfinite(distance[i, j]):
                pairs[i] = j
        rows = [i for i in range(len(true_ids)) if i not in pairs]
        columns = [j for j in range(len(track_ids)) if j not in pairs.values()]
        rest = _most_then_nearest(distance[np.ix_(rows, columns)])
        return pairs | {rows[i]: columns[j] for i, j in rest}

    def _count_match(self, true_id: Hashable, track_id: Hashable, forward: bool | None) -> None:
        # Taken out first, so that the objects stay in the order of their latest matches.
        if self._track_of.pop(true_id, track_id) != track_id:
            self._counts["switches"] += 1
        self._track_of[true_id] = track_id
        if forward is None:
            return
        if self._forward.get((true_id, track_id), forward) != forward:
            self._counts["flips"] += 1
        self._forward[true_id, track_id] = forward

    def scores(self) -> TrackingScores:
        """Return the scores of the frames so far."""
        shares = [sum(matched) / len(matched) for matched in self._matched.values()]
        return TrackingScores(
            **self._counts,
            distance_sum=self._distance_sum,
            fragmentations=sum(_interruptions(matched) for matched in self._matched.values()),
            id_matches=self._id_matches(),
            mostly_tracked=sum(share >= _MOSTLY for share in shares),
            partly_tracked=sum(_HARDLY <= share < _MOSTLY for share in shares),
            mostly_lost=sum(share < _HARDLY for share in shares),
        )

    def _id_matches(self) -> int:
        """Return the largest number of frames that one-to-one identities of the whole sequence can agree in."""
        # The least IDFN + IDFP of the definition is the largest IDTP, for the three differ by constants alone.
        rows = {true_id: i for i, true_id in enumerate(dict.fromkeys(true_id for true_id, _ in self._near))}
        columns = {track_id: j for j, track_id in enumerate(dict.fromkeys(track_id for _, track_id in self._near))}
        frames = np.zeros((len(rows), len(columns)), dtype=np.int64)
        for (true_id, track_id), count in self._near.items():
            frames[rows[true_id], columns[track_id]] = count
        return int(frames[linear_sum_assignment(frames, maximize=True)].sum())


def _interruptions(matched: list[bool]) -> int:
    return max(sum(found for found, _ in groupby(matched)) - 1, 0)


def _most_then_nearest(distance: FloatArray) -> list[tuple[int, int]]:
    """Return as many pairs of finite distance as possible, and of those the least sum."""
    finite = np.isfinite(distance)
    if not finite.any():
        return []
    # One forbidden pair costs more than all allowed ones together.
    forbidden = 2.0 * min(distance.shape) * float(distance[finite].max()) + 1.0
    rows, columns = linear_sum_assignment(np.where(finite, distance, forbidden))
    return [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if finite[i, j]]


def _check_ids(name: str, ids: Sequence[Hashable]) -> int:
    if len(set(ids)) != len(ids):
        raise InputError(f"{name} must differ within a frame, got {list(ids)}")
    return len(ids)


def _as_matrix(name: str, value: npt.ArrayLike, shape: tuple[int, int]) -> npt.NDArray[np.float64 | np.bool_]:
    array = np.asarray(value)
    if array.size == 0 and 0 in shape:
        return np.zeros(shape)
    if array.shape != shape:
        raise InputError(f"{name} must have shape {shape} (objects, tracks), got {array.shape}")
    return array
