"""Identities of a rig's objects, by the tracks of its views and by their places in space."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import TrackState
from dloftbs.kernels.cubic_samples import sample_cubic
from dloftbs.stereo.rig_result import Members, RigObject, RigResult, RigTrack
from dloftbs.stereo.view_groups import Group
from dloftbs.support.arrays import FloatArray

_SAMPLES = 16
"""Number of points by which two curves in space are compared.

Source: by hand; two for each bend that a cable of a metre has.
"""

_SAME_VIEW = 1.0
"""Gain of a view's track that is the same as before; a loss of as much where that one is elsewhere.

Source: by definition; the unit of the others.
"""

_OTHER_VIEW = 0.95
"""The same of each view but the first one, whose track decides where two views say opposite things.

Source: by hand; a little less than the first one's, in whose frame results are.
"""

_SAME_PLACE = 0.9
"""Gain of a curve in space at the place where it was, at the most; a multiple of that of a view's track.

Source: by hand; less than a view's track, so that one view's error is overruled by the other view and the place.
"""

_FAR_WIDTHS = 10.0
"""Distance from which on the place says nothing, widths of the object.

Source: by hand; a fast cable moves as far between two frames.
"""


_REMEMBERED = 64
"""Number of objects that are out of sight and can be found again under their ids.

Source: by hand; it bounds time and memory of long streams.
"""


@dataclass
class _Known:
    """Knowledge of an object from earlier moments.

    `runs` holds for each view the track that the object had there when it last was in space, and whether the object
    runs against that one. A view that lost the object while another one followed it has none.
    """

    id: int
    members: dict[int, int]
    runs: dict[int, tuple[int, bool]]
    curve: BSplineCurve | None
    points: FloatArray | None
    width_m: float
    hits: int
    misses: int


class RigTracker:
    """Objects of a rig through time."""

    def __init__(self) -> None:
        self._known: list[_Known] = []
        self._next = 1

    def reset(self) -> None:
        """Forget all objects; their ids are not used again."""
        self._known = []

    def update(
        self,
        found: RigResult,
        groups: Sequence[Group],
        tracks: Sequence[Sequence[int | None]],
        views: Sequence[FrameResult],
    ) -> RigResult:
        """Return a moment's result with its tracks; objects run in their tracks' direction.

        Parameters
        ----------
        found : RigResult
        groups : sequence of Group
            For each object the detections that made it.
        tracks : sequence of sequence
            For each view the ids of its detections' tracks; None where a detection has none.
        views : sequence of FrameResult
            As the views' own pipelines gave them.
        """
        members = [members_of(one, tracks) for one in found.objects]
        own = [(number, ids) for number, ids in enumerate(members) if any(one is not None for one in ids)]
        gains = np.zeros((len(own), len(self._known)))
        points = {number: _points(found.objects[number]) for number, _ in own}
        current = {(view, one) for _, ids in own for view, one in enumerate(ids) if one is not None}
        for row, (number, ids) in enumerate(own):
            for column, known in enumerate(self._known):
                gains[row, column] = _gain(ids, points[number], known, current)
        rows, columns = linear_sum_assignment(np.minimum(-gains, 0.0)) if gains.size else ((), ())
        chosen = {int(row): int(column) for row, column in zip(rows, columns, strict=True) if gains[row, column] > 0.0}
        objects = list(found.objects)
        published = []
        seen = set()
        taken: set[tuple[int, int]] = set()
        for row, (number, ids) in enumerate(own):
            if row in chosen:
                known = self._known[chosen[row]]
            else:
                known = _Known(self._next, {}, {}, None, None, 0.0, 0, 0)
                self._next += 1
                self._known.append(known)
            seen.add(known.id)
            one = objects[number]
            known.members.update({view: one_id for view, one_id in enumerate(ids) if one_id is not None})
            taken.update(known.members.items())
            taken.update(_tracks_of_pieces(one, tracks))
            known.runs = {view: run for view, run in known.runs.items() if ids[view] is not None}
            known.hits, known.misses = known.hits + 1, 0
            if one.curve_3d is not None:
                runs = _runs(ids, groups[number], views)
                is_backwards = _is_backwards(one.curve_3d, points[number], runs, known)
                objects[number] = one = one.reversed() if is_backwards else one
                known.runs.update({view: (track, against != is_backwards) for view, (track, against) in runs.items()})
                known.curve, known.points, known.width_m = one.curve_3d, _points(one), one.width_m or 0.0
            published.append(_track(known, _state(ids, views), number, ids))
        published += self._hidden(seen, taken, views)
        if len(self._known) > len(seen) + _REMEMBERED:
            self._known = sorted(self._known, key=lambda known: (known.misses, known.id))[: len(seen) + _REMEMBERED]
        tracked = copy.copy(found)
        object.__setattr__(tracked, "objects", tuple(objects))
        object.__setattr__(tracked, "tracks", tuple(sorted(published, key=lambda track: track.id)))
        return tracked

    def _hidden(self, seen: set[int], taken: set[tuple[int, int]], views: Sequence[FrameResult]) -> list[RigTrack]:
        """Return the tracks that no view shows now, but whose tracks the views still publish.

        A view's track that an object has now is `taken`, also where it is only that of a part.
        """
        published = {(view, track.id) for view, result in enumerate(views) for track in result.tracks}
        hidden = []
        for known in self._known:
            if known.id in seen:
                continue
            known.misses += 1
            left = {view: number for view, number in known.members.items() if (view, number) in published - taken}
            if left:
                own = tuple(left.get(view) for view in range(len(views)))
                hidden.append(_track(known, TrackState.HIDDEN, None, own))
        return hidden


def members_of(one: RigObject, tracks: Sequence[Sequence[int | None]]) -> Members:
    """Return by view the ids of the tracks that an object's members belong to."""
    return tuple(None if member is None else tracks[view][member] for view, member in enumerate(one.members))


def _tracks_of_pieces(one: RigObject, tracks: Sequence[Sequence[int | None]]) -> set[tuple[int, int]]:
    """Return the views and ids of the tracks that the parts of an object belong to."""
    found = {(view, tracks[view][piece]) for view, pieces in enumerate(one.pieces) for piece in pieces}
    return {(view, track) for view, track in found if track is not None}


def _points(one: RigObject) -> FloatArray | None:
    if one.curve_3d is None:
        return None
    points = sample_cubic(one.curve_3d.knots, one.curve_3d.control_points, 0.0, 1.0, _SAMPLES)[0]
    if one.curve_3d.closed:
        points[-1] = points[0]  # to the last bit, by which `_apart` knows a loop
    return points


def _apart(a: FloatArray, b: FloatArray) -> tuple[float, bool]:
    """Return the mean distance of two curves' points, and whether it is less with one of them run backwards.

    Loops have their first point at the end again, and may start anywhere: the nearest start counts.
    """
    if (a[0] == a[-1]).all() and (b[0] == b[-1]).all():
        a, b = a[:-1], b[:-1]
        starts = [np.roll(b, number, axis=0) for number in range(len(b))]
    else:
        starts = [b]
    forward, backward = (
        min(float(np.linalg.norm(a - way, axis=1).mean()) for way in ways)
        for ways in (starts, [start[::-1] for start in starts])
    )
    return min(forward, backward), backward < forward


def _gain(ids: Members, points: FloatArray | None, known: _Known, current: set[tuple[int, int]]) -> float:
    """Return how much speaks for an object's being one that is known; negative where more speaks against it.

    Another track in a view speaks against it only as long as the view shows the former one, too (`current`).
    """
    gain = 0.0
    for view, one_id in enumerate(ids):
        before = known.members.get(view)
        if one_id is None or before is None:
            continue
        unit = _SAME_VIEW if view == 0 else _OTHER_VIEW
        if one_id == before:
            gain += unit
        elif (view, before) in current:
            gain -= unit
    if points is not None and known.points is not None and known.width_m > 0.0:
        apart, far = _apart(points, known.points)[0], _FAR_WIDTHS * known.width_m
        if apart < far:
            gain += _SAME_PLACE * math.exp(-3.0 * apart / far)
    return gain


def _runs(ids: Members, group: Group, views: Sequence[FrameResult]) -> dict[int, tuple[int, bool]]:
    """Return for each view the track of an object as it was found, and whether the object runs against that one."""
    runs = {}
    for view, one_id in enumerate(ids):
        if one_id is not None:
            track = next(track for track in views[view].tracks if track.id == one_id)
            runs[view] = one_id, group.matches[view].backwards != views[view]._place_of(track)[1]
    return runs


def _is_backwards(
    curve: BSplineCurve, points: FloatArray | None, runs: dict[int, tuple[int, bool]], known: _Known
) -> bool:
    """Return whether an object as it was found runs against its track.

    Most views that followed it decide, then the place before, which alone decides for loops, then the first view's
    track.
    """
    votes = 0
    for view, (track, against) in runs.items():
        same, before = known.runs.get(view, (None, False))
        if track == same:
            votes += 1 if against != before else -1
    if votes and not curve.closed:
        return votes > 0
    if points is not None and known.points is not None:
        return _apart(points, known.points)[1]
    return next(iter(runs.values()))[1]


def _track(known: _Known, state: TrackState, number: int | None, ids: Members) -> RigTrack:
    backwards = tuple(one is not None and known.runs.get(view) == (one, True) for view, one in enumerate(ids))
    return RigTrack(known.id, state, number, ids, backwards, known.curve, known.hits, known.misses)


def _state(ids: Members, views: Sequence[FrameResult]) -> TrackState:
    """Return CONFIRMED if a view's track is."""
    for view, one_id in enumerate(ids):
        if any(track.id == one_id and track.state is TrackState.CONFIRMED for track in views[view].tracks):
            return TrackState.CONFIRMED
    return TrackState.TENTATIVE
