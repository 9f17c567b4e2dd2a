"""Evidence of the frame as columns of joints: at branches that two cables share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from dloftbs.graph import FREE
from dloftbs.linking.joint_evidence import add_evidence
from dloftbs.linking.kernels.joint_features import DEPTH_SWERVE
from dloftbs.linking.kernels.weights import JOINT


@dataclass(frozen=True)
class Depths:
    """Evidence that knows depth alone: of each end of the graph, m."""

    known: tuple[float, ...]
    width: float = 12.0
    tells_swerves: bool = True

    @property
    def depths(self) -> np.ndarray:
        return np.column_stack((self.known, np.full(len(self.known), 1e-3)))

    def swerves(self, pairs: np.ndarray, lengths: np.ndarray) -> np.ndarray:
        return np.abs(np.subtract(*self.depths[pairs, 0].T)) * len(lengths[:1])

    def across(self, pairs: np.ndarray) -> np.ndarray:
        return np.zeros((len(pairs), 3))


def swerve_of(depth: float, shared_depth: float, shared: bool) -> float:
    """Return the column of a joint from a cable, branch 0, into branch 1, which branch 2 may double."""
    nodes = [FREE, 0, 0, FREE] + [0, FREE] * shared
    ids = np.array([0, 1, 2, 3] + [2, 3] * shared)
    joints = np.zeros((1, len(JOINT)))
    states, roundness = np.zeros((len(ids), 6)), np.ones(len(ids))
    evidence = Depths((depth, depth, shared_depth, shared_depth))
    add_evidence(evidence, ids, np.array(nodes), states, roundness, np.array([(1, 2)]), joints)  # type: ignore[arg-type]
    return float(joints[0, DEPTH_SWERVE])


@pytest.mark.parametrize("depth", [0.8, 0.9])
def test_a_step_in_depth_is_one_of_the_cable(depth: float) -> None:
    assert swerve_of(depth, 0.85, shared=False) > 0.0


@pytest.mark.parametrize("depth", [0.8, 0.9])
def test_where_two_cables_share_a_branch_its_depth_is_either_ones(depth: float) -> None:
    assert swerve_of(depth, 0.85, shared=True) == 0.0
