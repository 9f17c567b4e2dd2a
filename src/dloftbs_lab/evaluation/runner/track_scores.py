"""Scores of tracks through a sequence: all published tracks, hidden ones too, against the whole truth."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
from scipy.optimize import linear_sum_assignment

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.evaluation.curve_matching import CurveDistances
from dloftbs_lab.evaluation.curves import even_distances, even_l3
from dloftbs_lab.evaluation.identity_scores import TrackingScorer
from dloftbs_lab.evaluation.runner.finished_parts import Following, TrackRow
from dloftbs_lab.evaluation.runner.found import Found
from dloftbs_lab.evaluation.runner.frame_scores import TRACK_GATE
from dloftbs_lab.evaluation.runner.known_frame import KnownFrame
from dloftbs_lab.evaluation.runner.mask_pixels import nearest_distances
from dloftbs_lab.evaluation.runner.trace_pairs import compare_traces
from dloftbs_lab.evaluation.runner.visible_truth import distances_of
from dloftbs_lab.evaluation.traces import SAMPLES, Trace, align

NEAR_GATE = 1.0 / 64.0
"""Of the image's longer side: an object is missed without a track at a smaller mean distance, 20 px in HD."""


class FollowingScorer:
    """Scores a sequence, frame by frame, as long as the method gives identities.

    Parameters
    ----------
    family : str
        Kind of motion in the sequence.
    cables : int
        Number of objects.
    """

    def __init__(self, family: str, cables: int) -> None:
        self._family = family
        self._cables = cables
        self._scorer: TrackingScorer | None = None
        self._numbers: dict[Hashable, int] = {}
        self._rows: list[TrackRow] = []
        self._known = True
        self._points = self._ghosts = self._missed = self._shown = 0

    def wants(self, found: Found) -> bool:
        """Return whether the method has given all of its curves identities so far."""
        self._known = self._known and not (found.curves and found.ids is None)
        return self._known

    def add(self, index: int, found: Found, alone: Found, known: KnownFrame, distances: CurveDistances) -> None:
        """Count a frame.

        Parameters
        ----------
        index : int
        found : Found
            With all tracks.
        alone : Found
            Result of the method on the frame when it knows no other.
        known : KnownFrame
            Its truth has curves and masks.
        distances : CurveDistances
            Distances of the curves of `found` to what was visible; see `distances_of`.
        """
        truth = known.truth
        self._scorer = self._scorer or TrackingScorer(gate=TRACK_GATE * max(known.frame.size))
        numbers = [self._numbers.setdefault(track.id, len(self._numbers)) for track in found.tracks]
        curves = tuple(track.curve for track in found.tracks)
        if all(track.seen for track in found.tracks) and len(curves) == len(found.curves):
            published = found
        else:
            published = Found(curves)
            distances, _ = distances_of(published, known)
        if known.pixels is not None:
            self._points += len(published.points)
            self._ghosts += known.pixels.count_beside(published.points)
        self._count_missed(published, known)
        given = self._match(numbers, distances, known)
        whole, whole_alone = (compare_traces(one.traces, known.traces).l3 for one in (published, alone))
        for i, true_id in enumerate(truth.ids):
            number = given.get(true_id)
            j = None if number is None else numbers.index(number)
            errors = None
            if curves:
                nearest = published.traces[int(whole[i].argmin()) if j is None else j]
                errors = _distances_along(nearest, known.traces[i])
            shown = known.shown[i]
            self._rows.append(
                TrackRow(
                    index,
                    true_id,
                    float(shown.mean()),
                    number,
                    j is not None and found.tracks[j].seen,
                    _mean(errors),
                    None if errors is None else _mean(errors[shown]),
                    None if errors is None else _mean(errors[~shown]),
                    float(whole_alone[i].min()) if alone.curves else None,
                    float(whole[i].min()) if curves else None,
                )
            )

    def _match(self, numbers: list[int], distances: CurveDistances, known: KnownFrame) -> dict[int, int]:
        """Count identities and directions, and return the track of each object that has one."""
        assert self._scorer is not None  # `add` saw to it
        truth, visible = known.truth, known.visible
        hidden = [true_id for true_id, shows in zip(truth.ids, visible, strict=True) if not shows]
        lasting = {true_id: last for true_id in hidden if (last := self._scorer.track_of(true_id)) in numbers}
        # Nobody can say where something is that is hidden as a whole: right or wrong, its track does not count.
        rows = [i for i, shows in enumerate(visible) if shows]
        columns = [j for j, number in enumerate(numbers) if number not in lasting.values()]
        ids, tracks, those = [truth.ids[i] for i in rows], [numbers[j] for j in columns], np.ix_(rows, columns)
        given = self._scorer.add(ids, tracks, distances.l3[those], distances.forward[those])
        return given | lasting  # type: ignore[return-value]  # what was put in comes out

    def _count_missed(self, published: Found, known: KnownFrame) -> None:
        """Count the objects that show, and those of them without a track near their whole or visible extent."""
        rows = np.flatnonzero(known.visible)
        far = np.ones((len(rows), len(published.traces)))
        for i, row in enumerate(rows):
            true = [trace for trace in (known.traces[row], known.extents[row]) if trace is not None]
            for j, found in enumerate(published.traces):
                distance = min(_mean_distance(found, one) for one in true)
                far[i, j] = distance >= NEAR_GATE * max(known.frame.size)
        given = linear_sum_assignment(far)
        self._shown += len(rows)
        self._missed += len(rows) - int((far[given] == 0.0).sum())

    def result(self) -> Following | None:
        """Return the scores, or None where the method has curves without identities."""
        if not self._known or self._scorer is None:
            return None
        scores, rows = self._scorer.scores(), tuple(self._rows)
        counts = self._points, self._ghosts, self._missed, self._shown
        return Following(self._family, self._cables, scores, rows, *counts)


def _mean_distance(found: Trace, true: Trace) -> float:
    """Return the mean of both mean distances, from each of two curves to the other."""
    points, others = found.resampled(SAMPLES), true.resampled(SAMPLES)
    return float(nearest_distances(points, others).mean() + nearest_distances(others, points).mean()) / 2.0


def _distances_along(found: Trace, true: Trace) -> FloatArray:
    """Return the distances (SAMPLES,), of which L3 is the mean, along a true curve."""
    best = align(found, true, SAMPLES, even_l3, directed=False)
    return even_distances(best.found, best.true)


def _mean(values: FloatArray | None) -> float | None:
    return None if values is None or not len(values) else float(values.mean())
