"""Signs of a wrong rig: views that match far better if it is another, and cables of impossible sizes."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np

from dloftbs.stereo.epipolar_matching import MOST_MEAN_COST, Match, match_views
from dloftbs.stereo.rig_result import RigObject
from dloftbs.stereo.space_fit import Pose
from dloftbs.stereo.view_curves import ViewCurve
from dloftbs.stereo.view_groups import Group, RigGeometry

_log = logging.getLogger("dloftbs.stereo")

_POOR = 0.05
"""Mean cost of a point from which two curves do not fit each other all along, squared standard deviations.

Source: measured on `benchmarks.stereo_scenes`; half of the pairs of right rigs with one cable cost less than 0.03.
"""

_GOOD = 0.45
"""Mean cost of a point below which views match under another rig, squared standard deviations.

Source: by hand; nine tenths of the pairs of right rigs with one cable cost less in most scenes.
"""

_BETTER = 2.0
"""Ratio of the cost under one rig to that under another from which the latter is the right one.

Source: measured as before, 264 moments; right rigs cost at most 0.82 times what exchanged and inverted ones do.
"""

_WIDEST_M, _FARTHEST_M = 0.3, 30.0
"""Width and distance of a cable from which the poses are rather in another unit than metres.

Source: by hand; cables before cameras are thinner and nearer by ten times.
"""

_SURE = 0.1
"""Deviation of a curve as a share of its distance up to which that distance counts.

Source: by hand; what is seen under next to no parallax may be anywhere.
"""


class RigDoubts:
    """Doubts about a rig, each of which is said once. A rig that clearly fitted once stays out of doubt.

    Parameters
    ----------
    lasting : bool
        Whether more moments follow, for which it is worth the time to find out that a rig fits.
    """

    def __init__(self, *, lasting: bool) -> None:
        self._lasting = lasting
        self._has_fitted = False
        self._said: set[str] = set()

    def about_poses(
        self, curves: Sequence[Sequence[ViewCurve]], geometry: RigGeometry, groups: Sequence[Group]
    ) -> str | None:
        """Return how a rig is wrong if its first two views match far better then, with the remedy; None otherwise.

        Parameters
        ----------
        curves : sequence of sequence of ViewCurve
            Of each view.
        geometry : RigGeometry
        groups : sequence of Group
        """
        first, second = curves[0], curves[1]
        if self._has_fitted or not first or not second:
            return None
        pairs = [group.matches[1] for group in groups if {0, 1} <= group.matches.keys()]
        # Curves that fit each other all along are seldom a coincidence: then others are seen in one view alone.
        fits = any(pair.cost < _POOR for pair in pairs)
        if fits and not self._lasting:
            return None
        pose, std = geometry.steps[0][1], geometry.epipolar_std(0)
        inverse = Pose(pose.rotation.T.copy(), -pose.rotation.T @ pose.shift)
        others = match_views(second, first, pose, std), match_views(first, second, inverse, std)
        count = max(map(len, (pairs, *others)))
        if not count:
            return None
        own, exchanged, inverted = (_mean_cost(matches, count) for matches in (pairs, *others))
        self._has_fitted = min(exchanged, inverted) > _BETTER * max(own, _POOR)
        if fits or own < _BETTER * min(exchanged, inverted):
            return None
        # Of cameras side by side, both are the same.
        if exchanged <= min(_GOOD, _BETTER * max(inverted, _POOR)):
            doubt = (
                "the views match far better if they are exchanged: give them in the order of the rig's cameras (left "
                "and right are swapped), or exchange the poses of the rig"
            )
        elif inverted <= _GOOD:
            doubt = (
                "the views match far better if the poses are inverted: a pose takes points of the camera to the rig "
                "(p_rig = pose @ p_camera); invert them, as by numpy.linalg.inv"
            )
        else:
            return None
        self._say("poses", doubt)
        return doubt

    def about_unit(self, objects: Sequence[RigObject]) -> None:
        """Warn if all objects whose place in space is known are wider, or farther away, than cables are."""
        sizes = []
        for one in objects:
            if one.curve_3d is None or one.std_m is None or one.width_m is None:
                continue
            away_m = float(np.median(np.linalg.norm(one.curve_3d.control_points, axis=1)))
            if float(np.median(one.std_m)) < _SURE * away_m:
                sizes.append((one.width_m, away_m))
        if sizes and all(width_m > _WIDEST_M or away_m > _FARTHEST_M for width_m, away_m in sizes):
            width_m, away_m = sizes[0]
            self._say(
                "unit",
                f"a cable would be {width_m:.2g} m wide and {away_m:.2g} m away: are the poses in metres? Those of "
                "stereoCalibrate have the unit of the chessboard's squares, and others are in millimetres",
            )

    def _say(self, kind: str, doubt: str) -> None:
        if kind not in self._said:
            self._said.add(kind)
            _log.warning("%s", doubt)


def _mean_cost(matches: Sequence[Match], count: int) -> float:
    """Return the mean cost of so many pairs, of which those that are missing have the largest."""
    return (sum(match.cost for match in matches) + MOST_MEAN_COST * (count - len(matches))) / count
