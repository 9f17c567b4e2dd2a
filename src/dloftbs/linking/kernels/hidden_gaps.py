"""Matching of ends in which sure gaps are evidence that something hides parts of the cables."""

from __future__ import annotations

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.graph_ends import X, Y
from dloftbs.kernels.shared.selection import falling_order
from dloftbs.linking.kernels.end_matching import match_ends
from dloftbs.linking.kernels.joint_features import GAP_LENGTH
from dloftbs.linking.kernels.weights import JOINT

_Joints = tuple[Ints, Floats, Floats, Ints]

_HIDING_SHARE = 2.0 / 3.0
"""Share of what its length costs that a gap is spared where another one shows that something hides parts of the cables.

Source: measured; of 72 generated masks behind discs 58 are right at 0, 61 at a third, 62 at two thirds. At 1, one gap
over several pieces of a cable costs no more than short gaps between them.
"""

_HIDDEN_MARGIN = 0.8
"""Margin, nats, from which a gap is evidence that something hides parts of the cables.

Source: by hand; the odds that such a gap is hidden are above two to one, e to the power of 0.8.
"""

_SIZE_RATIO = 1.5
"""Length of another gap over that of the longest one with evidence, up to which the same may hide it.

Source: by hand; a disc hides chords of any length up to its diameter.
"""

_LONGEST = 3
"""Number of sure gaps, the longest ones, among which one shares no end with a pair.

Source: by definition; each end of the pair belongs to one sure gap at most.
"""


@helper
def _gap_length(nodes: Ints, states: Floats, i: int, j: int) -> float:
    """Return the length of the gap between two ends, px; 0 between ends at one junction."""
    if nodes[i] >= 0 and nodes[i] == nodes[j]:
        return 0.0
    return np.hypot(states[i, X] - states[j, X], states[i, Y] - states[j, Y])


@helper
def _match_gaining(
    rows: Ints, columns: Ints, costs: Floats, bonus: Floats, open_cost: Floats, end_id: Ints
) -> tuple[_Joints, Floats]:
    """Match ends by the pairs that cost less than two open ends; return the extra cost of each pair over these, too."""
    lacking, count = np.empty(len(rows)), 0
    own_rows, own_columns = np.empty(len(rows), dtype=np.int64), np.empty(len(rows), dtype=np.int64)
    own_costs, own_bonus = np.empty(len(rows)), np.empty(len(rows))
    for p in range(len(rows)):
        lacking[p] = costs[p] - bonus[p] - open_cost[rows[p]] - open_cost[columns[p]]
        if lacking[p] < 0.0:
            own_rows[count], own_columns[count] = rows[p], columns[p]
            own_costs[count], own_bonus[count] = costs[p], bonus[p]
            count += 1
    joints = match_ends(own_rows[:count], own_columns[:count], own_costs[:count], own_bonus[:count], open_cost, end_id)
    return joints, lacking


@helper
def _lower_costs(
    rows: Ints,
    columns: Ints,
    costs: Floats,
    partner: Ints,
    margin: Floats,
    nodes: Ints,
    states: Floats,
    counted: Floats,
) -> Floats:
    """Return the costs, lower for gaps that share no end with a sure one of about their size or longer."""
    sure, lengths, count = np.empty(len(partner), dtype=np.int64), np.empty(len(partner)), 0
    for i in range(len(partner)):
        if partner[i] > i and margin[i] >= _HIDDEN_MARGIN:
            sure[count], lengths[count] = i, _gap_length(nodes, states, i, partner[i])
            count += lengths[count] > 0.0
    lowered = costs.copy()
    longest_first = falling_order(lengths[:count])[:_LONGEST]
    for p in range(len(rows) if count > 0 else 0):
        i, j, longest = rows[p], columns[p], 0.0
        for k in longest_first:
            a, b = sure[k], partner[sure[k]]
            if i not in (a, b) and j not in (a, b):
                longest = lengths[k]
                break
        if _gap_length(nodes, states, i, j) <= _SIZE_RATIO * longest:
            lowered[p] -= _HIDING_SHARE * JOINT[GAP_LENGTH] * counted[p]
    return lowered


@kernel(
    read(int64, 1), read(int64, 1), read(float64, 1), read(float64, 1), read(float64, 1), read(int64, 1),
    read(int64, 1), read(float64, 2), read(float64, 1),
)  # fmt: skip
def match_with_hiding(
    rows: Ints,
    columns: Ints,
    costs: Floats,
    bonus: Floats,
    open_cost: Floats,
    end_id: Ints,
    nodes: Ints,
    states: Floats,
    counted: Floats,
) -> tuple[Ints, Floats, Floats, Ints, Floats]:
    """Match ends as `match_ends`, and once more if a sure gap shows that something hides parts of the cables.

    Gaps of about its size that share no end with it then cost less. Pairs that cost more than two open ends take no
    part.

    Parameters
    ----------
    rows, columns, costs, bonus, open_cost, end_id
        As `match_ends` takes them.
    nodes : (n,) int64
    states : (n, 6) float64
    counted : (k,) float64
        How much of the length of each pair's gap counts in its cost, widths; 0 for links.

    Returns
    -------
    partner, cost, margin, alternative
        As `match_ends` returns them.
    lacking : (k,) float64
        Extra cost of each pair, as it was matched, over two open ends.
    """
    given = costs.copy()  # of the type of the lowered costs, so that they are matched by the same code
    joints, lacking = _match_gaining(rows, columns, given, bonus, open_cost, end_id)
    lowered = _lower_costs(rows, columns, given, joints[0], joints[2], nodes, states, counted)
    if (lowered != given).any():
        joints, lacking = _match_gaining(rows, columns, lowered, bonus, open_cost, end_id)
    partner, cost, margin, alternative = joints
    return partner, cost, margin, alternative, lacking
