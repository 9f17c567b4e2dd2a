"""Signs of a wrong rig: views that match far better if it is another."""

from __future__ import annotations

from collections.abc import Sequence

from dloftbs.stereo.epipolar_matching import MOST_MEAN_COST, Match, match_views
from dloftbs.stereo.space_fit import Pose
from dloftbs.stereo.view_curves import ViewCurve
from dloftbs.stereo.view_groups import Group, RigGeometry

_POOR = 0.7
"""Share of the best possible agreement of two curves that, where none has it, makes the rig be looked at.

Source: by hand; right rigs of one cable have more than 0.9 in nearly all frames.
"""

_BETTER = 1.5
"""Ratio of the agreement under another rig to that under the stated one from which the latter is in doubt.

Source: by hand.
"""


def doubt_rig(curves: Sequence[Sequence[ViewCurve]], geometry: RigGeometry, groups: Sequence[Group]) -> str | None:
    """Return how a rig is wrong if its first two views match far better then, with the remedy; None otherwise.

    Parameters
    ----------
    curves : sequence of sequence of ViewCurve
        Of each view.
    geometry : RigGeometry
    groups : sequence of Group
    """
    first, second = curves[0], curves[1]
    pairs = [group.matches[1] for group in groups if {0, 1} <= group.matches.keys()]
    # Curves that fit each other all along are seldom a coincidence: then others are seen in one view alone.
    if not first or not second or any(MOST_MEAN_COST - pair.cost > _POOR * MOST_MEAN_COST for pair in pairs):
        return None
    own = _agreement(pairs)
    pose, std = geometry.steps[0][1], geometry.epipolar_std(0)
    inverse = Pose(pose.rotation.T.copy(), -pose.rotation.T @ pose.shift)
    exchanged = _agreement(match_views(second, first, pose, std))
    inverted = _agreement(match_views(first, second, inverse, std))
    least = max(_BETTER * own, _POOR * MOST_MEAN_COST)
    # Of cameras side by side, both are the same.
    if exchanged >= max(least, inverted / _BETTER):
        return (
            "the views match far better if they are exchanged: give them in the order of the rig's cameras (left and "
            "right are swapped), or exchange the poses of the rig"
        )
    if inverted >= least:
        return (
            "the views match far better if the poses are inverted: a pose takes points of the camera to the rig "
            "(p_rig = pose @ p_camera); invert them, as by numpy.linalg.inv"
        )
    return None


def _agreement(matches: Sequence[Match]) -> float:
    """Return by how much pairs are better than none, squared standard deviations a point, in all."""
    return sum(MOST_MEAN_COST - match.cost for match in matches)
