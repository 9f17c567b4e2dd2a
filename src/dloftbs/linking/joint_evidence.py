"""Columns of joints from evidence in the frame besides its mask."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.data.graph import TANGENT
from dloftbs.evidence import EndEvidence
from dloftbs.linking.kernels.evidence_weights import DEPTHS, PIXELS
from dloftbs.linking.kernels.joint_evidence import describe_seen, list_gaps
from dloftbs.linking.kernels.joint_features import DEPTH_SWERVE, OTHER_COLOUR

_Ints = npt.NDArray[np.int64]
_Floats = npt.NDArray[np.float64]


def add_evidence(
    evidence: EndEvidence, ids: _Ints, nodes: _Ints, states: _Floats, roundness: _Floats, pairs: _Ints, joints: _Floats
) -> None:
    """Add the evidence of the frame to what is measured of joints.

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
    gaps, lengths = list_gaps(nodes, states, pairs)
    own = ids[pairs]
    hidden, pixels, depths = evidence.across(own[gaps], lengths[gaps])
    describe_seen(hidden, pixels @ PIXELS + depths @ DEPTHS, gaps, pairs, roundness, joints)
    is_own = ~are_shared(ids)[pairs].any(axis=1)
    if evidence.tells_swerves:
        joints[:, DEPTH_SWERVE] = evidence.swerves(own, lengths) * (is_own & ~are_folds(states, pairs))
    joints[:, OTHER_COLOUR] = evidence.differ_in_colour(own) & is_own


def are_folds(states: _Floats, pairs: _Ints) -> npt.NDArray[np.bool_]:
    """Return True for pairs of ends (k, 2) between which a cable turns by more than a right angle.

    It folds back there, seen from its side: depth may change by any amount, and that is no swerve.
    """
    one, other = np.moveaxis(states[pairs, TANGENT], 1, 0)
    folds: npt.NDArray[np.bool_] = (one * other).sum(axis=1) > 0.0
    return folds


def are_shared(ids: _Ints) -> npt.NDArray[np.bool_]:
    """Return True for ends of branches that two cables share: depth and colour there are of the one on top."""
    shared: npt.NDArray[np.bool_] = np.bincount(ids)[ids] > 1
    return shared
