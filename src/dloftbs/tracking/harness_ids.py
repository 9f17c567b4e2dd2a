"""Ids of harnesses and of branch points through a stream, by the tracks of their branches and by place."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from dloftbs.data.branch_point import BranchPoint
from dloftbs.data.detection import place_in
from dloftbs.data.harness import Harness
from dloftbs.data.tracks import Track

_REACH_WIDTHS = 8.0
"""Distance by which a branch point moves from frame to frame at most, widths of its branches.

Source: by hand; as far as a cable that is followed, too.
"""


class HarnessIds:
    """Gives harnesses and branch points the ids that they had: those of the most of their branches' tracks."""

    def __init__(self) -> None:
        self._harness_of: dict[int, int] = {}  # by track
        self._points: dict[int, tuple[tuple[float, float], frozenset[int]]] = {}  # place and tracks, by id
        self._next_harness = self._next_point = 1

    def update(
        self, harnesses: Sequence[Harness], tracks: Sequence[Track], held: Collection[int]
    ) -> tuple[Harness, ...]:
        """Return the harnesses of a frame with ids.

        Parameters
        ----------
        harnesses : sequence of Harness
        tracks : sequence of Track
            Of the same frame; a branch without a track says nothing.
        held : collection of int
            Ids of all tracks that the tracker holds; what only others had is forgotten.
        """
        if not harnesses:
            return ()
        self._harness_of = {track: number for track, number in self._harness_of.items() if track in held}
        self._points = {number: one for number, one in self._points.items() if not one[1].isdisjoint(held)}
        track_of = _tracks_of(harnesses[0], tracks)
        found, taken = [], set[int]()
        order = sorted(range(len(harnesses)), key=lambda k: -len(harnesses[k].branches))
        named: dict[int, Harness] = {}
        for k in order:
            own = [track_of[branch] for branch in harnesses[k].branches if branch in track_of]
            votes = Counter([self._harness_of[one] for one in own if one in self._harness_of])
            known = [number for number, _ in votes.most_common() if number not in taken]
            number = known[0] if known else self._new_harness()
            taken.add(number)
            self._harness_of.update(dict.fromkeys(own, number))
            named[k] = replace(harnesses[k], id=number)
        places: dict[int, tuple[tuple[float, float], frozenset[int]]] = {}
        for k in range(len(harnesses)):
            points = []
            for point in named[k].branch_points:
                own_tracks = frozenset([track_of[branch] for branch, _ in point.members if branch in track_of])
                number = self._known_point(named[k], point, own_tracks, set(places)) or self._new_point()
                places[number] = point.position, own_tracks
                points.append(replace(point, id=number))
            found.append(replace(named[k], branch_points=tuple(points)))
        self._points.update(places)  # one whose branches are hidden keeps its place
        return tuple(found)

    def reset(self) -> None:
        """Forget what was seen; ids are not used again."""
        self._harness_of.clear()
        self._points.clear()

    def _known_point(self, harness: Harness, point: BranchPoint, tracks: frozenset[int], taken: set[int]) -> int | None:
        """Return the id of the point with the most tracks in common, of these the nearest; None where none is near."""
        width = max(harness.detections[branch].width_px for branch, _ in point.members)
        options = []
        for number, (place, known) in self._points.items():
            distance = float(np.hypot(place[0] - point.position[0], place[1] - point.position[1]))
            common = len(tracks & known)
            if number not in taken and (common >= 2 or distance <= _REACH_WIDTHS * width):
                options.append((-common, distance, number))
        return min(options)[2] if options else None

    def _new_harness(self) -> int:
        self._next_harness += 1
        return self._next_harness - 1

    def _new_point(self) -> int:
        self._next_point += 1
        return self._next_point - 1


def _tracks_of(harness: Harness, tracks: Sequence[Track]) -> dict[int, int]:
    """Return the id of the track of each detection that has one."""
    held = [(track.id, track.detection) for track in tracks if track.detection is not None]
    places = [(place_in(harness.detections, detection)[0], number) for number, detection in held]
    return {place: number for place, number in places if place is not None}
