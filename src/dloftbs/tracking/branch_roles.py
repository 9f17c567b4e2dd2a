"""Identity of the branches of an object that branches: as in the last frame that was read alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

import numpy as np
from scipy.optimize import linear_sum_assignment

from dloftbs.data.detection import place_in
from dloftbs.data.tracks import Track
from dloftbs.tracking.appearance import objects_differ
from dloftbs.tracking.observation import Observation
from dloftbs.tracking.track_model import TrackModel

Roles = Mapping[int, int]
"""From the id of each branch's track to the number of its ends at branch points."""


class BranchRoles:
    """Roles of the tracks in the last frame of each structure; a frame that misreads a branch point has another one."""

    def __init__(self) -> None:
        self._of_structure: dict[tuple[int, ...], Roles] = {}

    def known(self, observations: Sequence[Observation]) -> Roles:
        """Return the roles in the last frame with as many branches of each kind; none without branch points."""
        return self._of_structure.get(_structure(observations), {})

    def record(self, observations: Sequence[Observation], tracks: Sequence[Track], held_ids: Set[int]) -> None:
        """Keep the roles of a frame, if each of its branches is one track.

        Those that need a track which is not held any more are forgotten: nothing can match them.
        """
        self._of_structure = {key: roles for key, roles in self._of_structure.items() if roles.keys() <= held_ids}
        structure = _structure(observations)
        if structure:
            branches = [one.detection for one in observations if one.detection is not None and ends_that_meet(one)]
            held = [t for t in tracks if t.detection is not None and place_in(branches, t.detection)[0] is not None]
            roles = {track.id: ends_that_meet(track) for track in held}
            if tuple(sorted(roles.values())) == structure:
                self._of_structure[structure] = roles


def match_roles(
    models: Sequence[TrackModel], observations: Sequence[Observation], roles: Roles
) -> list[tuple[TrackModel, Observation]]:
    """Pair the tracks of branches with observations of the same role, so that all together are nearest.

    No pair is made if one of the tracks is gone, or if a width or colour clearly differs.
    """
    tracks = [model for model in models if model.id in roles]
    branches = [one for one in observations if ends_that_meet(one)]
    needed, seen = [roles[model.id] for model in tracks], [ends_that_meet(one) for one in branches]
    if not tracks or sorted(needed) != sorted(seen):
        return []
    predicted, found = np.array([m.predicted for m in tracks]), np.array([one.points for one in branches])
    both = [np.hypot(*(predicted[:, None] - way).transpose(3, 0, 1, 2)).mean(axis=2) for way in (found, found[:, ::-1])]
    away = np.minimum(*both)
    excluded = objects_differ(tracks, branches) | (np.array(needed)[:, None] != np.array(seen))
    rows, columns = linear_sum_assignment(np.where(excluded, away.sum() + 1.0, away))
    if excluded[rows, columns].any():
        return []
    return [(tracks[t], branches[d]) for t, d in zip(rows.tolist(), columns.tolist(), strict=True)]


def ends_that_meet(one: Observation | Track) -> int:
    """Return the number of ends of a branch that lie at branch points."""
    found = one.detection
    return 0 if found is None else sum(end is not None for end in found.centerline.branch_ends)


def _structure(observations: Sequence[Observation]) -> tuple[int, ...]:
    """Return the numbers of ends at branch points of all branches, ascending."""
    return tuple(sorted([count for one in observations if (count := ends_that_meet(one))]))
