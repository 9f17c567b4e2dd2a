"""Stage 5: what the frame has besides its mask, as columns of joints."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.evidence import EndEvidence
from dloftbs.graph import POSITION, UNAVAILABLE, other_end
from dloftbs.linking.kernels.joint_features import (
    DEPTH_SWERVE,
    GAP_GROUND,
    GAP_HIDDEN,
    GAP_ROUND,
)

_MOST_GROUND = 0.5
"""Most ground in sight across a gap that counts, widths.

Source: fitted; of a half, one and two widths a half tells the most in all sources: more is no clearer.
"""

_STRAY_GROUND = 0.15
"""Share of a gap below which ground in sight counts as none.

Source: by hand; a place in seven, where what hides a cable looks like the ground, or its depth is a flying pixel.
"""

_MOST_SWERVE_RAD = 0.4
"""Most of a swerve towards the camera or away from it that counts, rad.

Source: measured; of generated cables that lie over each other none of 892 right joints swerves half as much by depth,
and .37 of the wrong exchanges swerve more.
"""

_Ints = npt.NDArray[np.int64]
_Floats = npt.NDArray[np.float64]


def add_evidence(
    evidence: EndEvidence, ids: _Ints, nodes: _Ints, states: _Floats, roundness: _Floats, pairs: _Ints, joints: _Floats
) -> None:
    """Add the evidence of the frame to what is measured of joints.

    The shape of an end does not count before a gap that is shown to be hidden, by as much as is hidden, whichever end
    it is joined with: what is told of one gap and not of another one must not decide between them.

    Parameters
    ----------
    evidence : EndEvidence
    ids : numpy.ndarray, shape (n,)
        End of the graph that each end stands for.
    nodes : numpy.ndarray, shape (n,)
        Junction at each end.
    states : numpy.ndarray, shape (n, 6)
    roundness : numpy.ndarray, shape (n,)
    pairs : numpy.ndarray, shape (k, 2)
        Those at junctions among them.
    joints : numpy.ndarray, shape (k, columns)
        Changed.
    """
    width, (rows, columns) = evidence.width, pairs.T
    gaps = (nodes[rows] < 0) | (nodes[rows] != nodes[columns])
    lengths = np.hypot(*(states[rows, POSITION] - states[columns, POSITION]).T)
    ground, cable, neither = evidence.across(ids[pairs[gaps]]).T
    length = np.maximum(lengths[gaps] / width, 1e-9)
    ground = np.where(ground < _STRAY_GROUND * length, 0.0, ground)
    hidden = np.minimum(cable + neither, length)
    joints[gaps, GAP_GROUND], joints[gaps, GAP_HIDDEN] = np.minimum(ground, _MOST_GROUND), hidden
    covered = np.zeros(len(ids))
    for end in pairs[gaps].T:
        np.maximum.at(covered, end, np.maximum(hidden - ground, 0.0) / length)
    shape = (roundness * (1.0 - covered))[pairs].sum(axis=1) / np.maximum(roundness[pairs].sum(axis=1), 1e-9)
    joints[:, GAP_ROUND] *= shape
    swerves = evidence.swerves(ids[pairs], lengths) * _are_comparable(evidence, ids, nodes, pairs)
    joints[:, DEPTH_SWERVE] = swerve_bends(swerves)


def _are_comparable(evidence: EndEvidence, ids: _Ints, nodes: _Ints, pairs: _Ints) -> npt.NDArray[np.bool_]:
    """Tell for which pairs of ends a difference in depth would be one of the same cable.

    Where two cables share a branch, depth is that of the one on top: a cable that comes from farther away may lie
    below it, one that comes from nearer would have to dive. Of a branch that is shared in part it is either one's.
    """
    shared = are_shared(ids)[pairs]
    ended_in = np.isin(ids, ids[other_end(np.flatnonzero(nodes == UNAVAILABLE))])[pairs]
    depth = evidence.depths[ids[pairs], 0]
    dives = (depth < depth[:, ::-1]) & ~shared & ~ended_in[:, ::-1]
    comparable: npt.NDArray[np.bool_] = ~shared.any(axis=1) | dives.any(axis=1)
    return comparable


def swerve_bends(swerves: _Floats) -> _Floats:
    """Return the bend, rad^2, of swerves towards the camera or away from it: that of the same swerve beside the way."""
    bends: _Floats = 3.0 * np.minimum(swerves, _MOST_SWERVE_RAD) ** 2
    return bends


def are_shared(ids: _Ints) -> npt.NDArray[np.bool_]:
    """Return True for ends of branches that two cables share: depth there is that of the one on top."""
    shared: npt.NDArray[np.bool_] = np.bincount(ids)[ids] > 1
    return shared
