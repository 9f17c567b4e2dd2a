"""Evidence of the frame as columns of joints: at branches that two cables share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from dloftbs.graph import FREE, UNAVAILABLE
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


def swerve_of(depth: float, shared_depth: float, shared: bool, ends_inside: bool = False) -> float:
    """Return the column of a joint from a cable, branch 0, into branch 1, which branch 2 may double."""
    nodes = [FREE, 0, 0, FREE] + [0, UNAVAILABLE if ends_inside else FREE] * shared
    ids = np.array([0, 1, 2, 3] + [2, 3] * shared)
    joints = np.zeros((1, len(JOINT)))
    states, roundness = np.zeros((len(ids), 6)), np.ones(len(ids))
    evidence = Depths((depth, depth, shared_depth, shared_depth))
    add_evidence(evidence, ids, np.array(nodes), states, roundness, np.array([(1, 2)]), joints)  # type: ignore[arg-type]
    return float(joints[0, DEPTH_SWERVE])


@pytest.mark.parametrize("depth", [0.8, 0.9])
def test_a_step_in_depth_is_one_of_the_cable(depth: float) -> None:
    assert swerve_of(depth, 0.85, shared=False) > 0.0


def test_a_cable_may_come_to_lie_below_the_one_that_shows_but_does_not_dive_through_it() -> None:
    assert swerve_of(0.9, 0.85, shared=True) == 0.0
    assert swerve_of(0.8, 0.85, shared=True) == swerve_of(0.8, 0.85, shared=False)


@pytest.mark.parametrize("depth", [0.8, 0.9])
def test_where_one_cable_ends_inside_of_a_branch_its_depth_is_either_ones(depth: float) -> None:
    assert swerve_of(depth, 0.85, shared=True, ends_inside=True) == 0.0
