"""Columns of evidence, against slow twins."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.linking.kernels.evidence_weights import SHARE_IN_SIGHT
from dloftbs.linking.kernels.joint_evidence import describe_seen, list_gaps
from dloftbs.linking.kernels.joint_features import GAP_LENGTH, GAP_ROUND, GAP_SEEN
from dloftbs.linking.kernels.weights import JOINT

seeds = st.integers(0, 2**31)


def random_ends(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Return the junction of each end, the end of the graph that it stands for, some pairs, and the graph's ends."""
    branches = int(rng.integers(1, 6))
    duplicates = rng.integers(0, branches, rng.integers(0, 3))
    ids = np.concatenate((np.arange(2 * branches), *((2 * b, 2 * b + 1) for b in duplicates))).astype(np.int64)
    nodes = rng.integers(-2, 3, len(ids))
    return nodes, ids, rng.integers(0, len(ids), (rng.integers(0, 12), 2)), 2 * branches


@given(seeds)
def test_gaps_are_the_pairs_that_meet_in_no_junction(seed: int) -> None:
    rng = np.random.default_rng(seed)
    nodes, ids, pairs, _ = random_ends(rng)
    states = rng.uniform(0.0, 100.0, (len(ids), 6))
    gaps, lengths = list_gaps(nodes, states, pairs)
    assert gaps.tolist() == [k for k, (i, j) in enumerate(pairs) if nodes[i] < 0 or nodes[i] != nodes[j]]
    np.testing.assert_array_equal(lengths, [np.hypot(*(states[i, :2] - states[j, :2])) for i, j in pairs])


@given(seeds)
def test_what_is_seen_is_written_and_a_hidden_end_has_any_shape(seed: int) -> None:
    rng = np.random.default_rng(seed)
    nodes, ids, pairs, _ = random_ends(rng)
    gaps, _ = list_gaps(nodes, rng.uniform(0.0, 60.0, (len(ids), 6)), pairs)
    hidden = rng.uniform(0.0, 1.0, len(gaps)) * rng.integers(0, 2, len(gaps))
    log_odds = rng.uniform(-9.0, 9.0, len(gaps)) * rng.integers(0, 2, len(gaps))
    roundness, joints = rng.uniform(0.0, 1.0, len(ids)), rng.uniform(0.0, 1.0, (len(pairs), len(JOINT)))
    expected, covered = joints.copy(), np.zeros(len(ids))
    for k, share, shown in zip(gaps.tolist(), hidden.tolist(), log_odds.tolist(), strict=True):
        expected[k, GAP_SEEN] = -np.log(SHARE_IN_SIGHT * (1.0 - share) * np.exp(-shown) + 1.0 - SHARE_IN_SIGHT)
        expected[k, GAP_LENGTH] *= 1.0 - share
        for end in pairs[k]:
            covered[end] = max(covered[end], share, 2.0 / (1.0 + np.exp(-shown)) - 1.0)
    for k, pair in enumerate(pairs):
        left = (roundness[pair] * (1.0 - covered[pair])).sum()
        expected[k, GAP_ROUND] *= left / max(roundness[pair].sum(), 1e-9)
    describe_seen(hidden, log_odds, gaps, pairs, roundness, joints)
    np.testing.assert_allclose(joints, expected, rtol=1e-9)
