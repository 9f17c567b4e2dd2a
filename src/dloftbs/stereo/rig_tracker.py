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
from dloftbs.support.arrays import FloatArray

_SAMPLES = 16
"""Number of points by which two curves in space are compared.

Source: by hand; two for each bend that a cable of a metre has.
"""

_SAME_VIEW = 1.0
"""Gain of a view's track that is the same as before; a loss of as much where that one is elsewhere.

Source: by definition; the unit of the others.
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
    """Knowledge of an object from earlier moments."""

    id: int
    members: dict[int, int]
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

    def update(self, found: RigResult, members: Sequence[Members], views: Sequence[FrameResult]) -> RigResult:
        """Return a moment's result with its tracks; objects run in their tracks' direction.

        Parameters
        ----------
        found : RigResult
        members : sequence of tuple
            For each object the ids of the tracks that it has in the views.
        views : sequence of FrameResult
            As the views' own pipelines gave them.
        """
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
        tracks = []
        seen = set()
        for row, (number, ids) in enumerate(own):
            if row in chosen:
                known = self._known[chosen[row]]
            else:
                known = _Known(self._next, {}, None, None, 0.0, 0, 0)
                self._next += 1
                self._known.append(known)
            seen.add(known.id)
            objects[number] = one = _directed(objects[number], ids, points[number], known, views)
            known.members.update({view: one_id for view, one_id in enumerate(ids) if one_id is not None})
            known.hits, known.misses = known.hits + 1, 0
            if one.curve_3d is not None:
                known.curve, known.points, known.width_m = one.curve_3d, _points(one), one.width_m or 0.0
            state = _state(ids, views)
            tracks.append(RigTrack(known.id, state, number, ids, known.curve, known.hits, 0))
        tracks += self._hidden(seen, views)
        if len(self._known) > len(seen) + _REMEMBERED:
            self._known = sorted(self._known, key=lambda known: (known.misses, known.id))[: len(seen) + _REMEMBERED]
        tracked = copy.copy(found)
        object.__setattr__(tracked, "objects", tuple(objects))
        object.__setattr__(tracked, "tracks", tuple(sorted(tracks, key=lambda track: track.id)))
        return tracked

    def _hidden(self, seen: set[int], views: Sequence[FrameResult]) -> list[RigTrack]:
        """Return the tracks that no view shows now, but whose tracks the views still publish."""
        published = {(view, track.id) for view, result in enumerate(views) for track in result.tracks}
        taken = {(view, number) for known in self._known if known.id in seen for view, number in known.members.items()}
        hidden = []
        for known in self._known:
            if known.id in seen:
                continue
            known.misses += 1
            left = {view: number for view, number in known.members.items() if (view, number) in published - taken}
            if left:
                own = tuple(left.get(view) for view in range(len(views)))
                hidden.append(RigTrack(known.id, TrackState.HIDDEN, None, own, known.curve, known.hits, known.misses))
        return hidden


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
        if one_id == before:
            gain += _SAME_VIEW
        elif (view, before) in current:
            gain -= _SAME_VIEW
    if points is not None and known.points is not None and known.width_m > 0.0:
        apart, far = _apart(points, known.points)[0], _FAR_WIDTHS * known.width_m
        if apart < far:
            gain += _SAME_PLACE * math.exp(-3.0 * apart / far)
    return gain


def _directed(
    one: RigObject, ids: Members, points: FloatArray | None, known: _Known, views: Sequence[FrameResult]
) -> RigObject:
    """Return an object run as its track: by its place before, else as the first view's track runs."""
    if points is None:
        return one
    if known.points is not None:
        return one.reversed() if _apart(points, known.points)[1] else one
    for view, one_id in enumerate(ids):
        if one_id is not None:
            track = next(track for track in views[view].tracks if track.id == one_id)
            return one.reversed() if views[view]._place_of(track)[1] else one
    return one


def _state(ids: Members, views: Sequence[FrameResult]) -> TrackState:
    """Return CONFIRMED if a view's track is."""
    for view, one_id in enumerate(ids):
        if any(track.id == one_id and track.state is TrackState.CONFIRMED for track in views[view].tracks):
            return TrackState.CONFIRMED
    return TrackState.TENTATIVE
