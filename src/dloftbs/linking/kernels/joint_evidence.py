"""Evidence of a frame as columns of joints: hidden gaps, and ground in sight."""

from __future__ import annotations

import math

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, Ints, kernel, read, write
from dloftbs.kernels.shared.graph_ends import X, Y
from dloftbs.linking.kernels.evidence_weights import SHARE_IN_SIGHT
from dloftbs.linking.kernels.joint_features import GAP_LENGTH, GAP_ROUND, GAP_SEEN


@kernel(read(int64, 1), read(float64, 2), read(int64, 2))
def list_gaps(nodes: Ints, states: Floats, pairs: Ints) -> tuple[Ints, Floats]:
    """List the pairs of ends that are no link through a junction, and measure how far apart the ends of each pair lie.

    Parameters
    ----------
    nodes : (n,) int64
        The junction at each end, negative where there is none.
    states : (n, 6) float64
    pairs : (k, 2) int64

    Returns
    -------
    gaps : (g,) int64
        Places in `pairs`.
    lengths : (k,) float64
        px.
    """
    gaps, lengths, count = np.empty(len(pairs), dtype=np.int64), np.empty(len(pairs)), 0
    for k in range(len(pairs)):
        i, j = pairs[k]
        lengths[k] = math.hypot(states[i, X] - states[j, X], states[i, Y] - states[j, Y])
        if nodes[i] < 0 or nodes[i] != nodes[j]:
            gaps[count] = k
            count += 1
    return gaps[:count].copy(), lengths


@kernel(read(float64, 1), read(float64, 1), read(int64, 1), read(int64, 2), read(float64, 1), write(float64, 2))
def describe_seen(hidden: Floats, log_odds: Floats, gaps: Ints, pairs: Ints, roundness: Floats, joints: Floats) -> None:
    """Write what is seen across gaps into the columns of joints.

    The shape of an end does not count before a gap that is shown to be hidden, by as much as is hidden, whichever end
    it is joined with: what is known of one gap and not of another one must not decide between them. What is covered
    does not count as length.

    Parameters
    ----------
    hidden : (g,) float64
        Share of each gap that is covered, or seen as cable.
    log_odds : (g,) float64
        That the rest is hidden, and not ground in sight, as image and depth show it, nats.
    gaps : (g,) int64
        As `list_gaps` makes them.
    pairs : (k, 2) int64
    roundness : (n,) float64
        Of each end.
    joints : (k, columns) float64
        Changed.
    """
    covered = np.zeros(len(roundness))
    for g in range(len(gaps)):
        k = gaps[g]
        in_sight = SHARE_IN_SIGHT * math.exp(-log_odds[g]) * (1.0 - hidden[g])
        joints[k, GAP_SEEN] = -math.log(in_sight + 1.0 - SHARE_IN_SIGHT)
        joints[k, GAP_LENGTH] *= 1.0 - hidden[g]
        is_hidden = max(hidden[g], math.tanh(0.5 * log_odds[g]))  # twice a probability, less 1
        for end in pairs[k]:
            covered[end] = max(covered[end], is_hidden)
    for k in range(len(pairs)):
        i, j = pairs[k]
        shape = roundness[i] * (1.0 - covered[i]) + roundness[j] * (1.0 - covered[j])
        joints[k, GAP_ROUND] *= shape / max(roundness[i] + roundness[j], 1e-9)
