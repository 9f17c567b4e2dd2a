"""Stage 5, with depth: which of two cables that share branches is which behind them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.evidence import EndEvidence
from dloftbs.graph import EndMatching, Graph, branch_of, ends_of, other_end
from dloftbs.linking.joint_evidence import are_shared, swerve_bends
from dloftbs.linking.kernels.joint_features import DEPTH_SWERVE
from dloftbs.linking.kernels.weights import JOINT

LEAST_GAIN = 1.0
"""Least gain by depth alone that counts, nats.

Source: by definition; odds of e.
"""

_CHANGED_PLACES = 4.0
"""Log-odds against two cables that change places in depth along the branches that they share, nats.

Source: by hand; on 96 generated frames of five cables 4 and 10 are alike, and 10 is worse with a poor camera.
"""

_SURE_DEVIATIONS = 3.0
"""Difference of two cables' depths that tells nothing, standard deviations; twice as much tells all.

Source: by definition.
"""


class DepthSteps:
    """Depth of the cables of a matching before and behind the branches that two of them share.

    A branch too short for depth of its own takes it from the next one along its cable.

    Parameters
    ----------
    graph : Graph
    matching : EndMatching
    evidence : EndEvidence
    """

    def __init__(self, graph: Graph, matching: EndMatching, evidence: EndEvidence) -> None:
        self._matching, self._evidence = matching, evidence
        ids = np.array(matching.branches.branch_id)
        self._own = ends_of(ids)
        is_shared = are_shared(self._own)
        self._has_slope = evidence.has_depth[self._own] & ~is_shared
        self._depths = np.where(is_shared[:, None], np.nan, evidence.depths[self._own])
        self._lengths = np.diff(graph.spans, axis=1).ravel()[ids]

    def gain(self, end: int, other: int) -> float:
        """Return how much speaks, nats, for two ends to exchange their partners: the cables keep their order in depth.

        Two cables that lie over each other may both rise or fall along the branches that they share, but neither goes
        through the other.
        """
        partners = self._matching.partner[end], self._matching.partner[other]
        if min(partners) < 0:
            return 0.0
        depths, deviations = self._depths.T
        known = [self._nearest(one, ~np.isnan(depths))[0] for one in (end, other, *partners)]
        if min(known) < 0:
            return 0.0
        before, after = (depths[a] - depths[b] for a, b in (known[:2], known[2:]))
        noise = [float(np.hypot(*deviations[pair])) for pair in (known[:2], known[2:])]
        sure = min(abs(before) / noise[0], abs(after) / noise[1]) / _SURE_DEVIATIONS - 1.0
        return float(-np.sign(before * after) * _CHANGED_PLACES * min(max(sure, 0.0), 1.0))

    def gain_of_second(self, before: list[int], beyond: tuple[int, int], at_start: bool, length: float) -> float:
        """Return how much less it costs by depth if the second of two cables runs on where the other one has ended.

        Parameters
        ----------
        before : list of int
            End of each one before the branches that they share.
        beyond : (int, int)
            The points of the graph along which one of them runs on.
        at_start : bool
            True if the first one of these is nearest to the other one's end, not the last one.
        length : float
            Of what they share, px.
        """
        known = [self._nearest(end, self._has_slope) for end in before]
        ends = [end for end, _ in known]
        if min(ends) < 0:
            return 0.0
        lengths = np.array([length + away for _, away in known])
        swerves = self._evidence.swerves_into(self._own[ends].tolist(), beyond, at_start, lengths)
        if swerves is None:
            return 0.0
        one, two = (JOINT[DEPTH_SWERVE] * swerve_bends(swerves)).tolist()
        return float(one - two)

    def _nearest(self, end: int, known: npt.NDArray[np.bool_]) -> tuple[int, float]:
        """Return the end itself if depth is known there, or the next one along its cable, or -1; and how far, px."""
        if known[end]:
            return end, 0.0
        onward = self._matching.partner[other_end(end)]
        return onward if onward >= 0 and known[onward] else -1, float(self._lengths[branch_of(end)])
