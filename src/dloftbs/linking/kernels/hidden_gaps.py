"""Matching of ends in which sure gaps are evidence that something hides parts of the cables."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float64, int64

from dloftbs.kernels.compiler import helper, kernel, read
from dloftbs.kernels.shared.graph_ends import X, Y
from dloftbs.linking.kernels.end_matching import match_ends
from dloftbs.linking.kernels.joint_features import GAP_LENGTH
from dloftbs.linking.kernels.weights import JOINT

_Joints = tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.int64], float]

_HIDING_SHARE = 2.0 / 3.0
"""Share of what its length costs that a gap is spared where another one shows that something hides parts of the cables.

Source: measured; of 72 generated masks behind discs 58 are right at 0, 61 at a third, 62 at two thirds. At 1, one gap
over several pieces of a cable costs no more than short gaps between them.
"""

_HIDDEN_MARGIN = 0.8
"""Margin, nats, from which a gap is evidence that something hides parts of the cables.

Source: by hand; the odds that such a gap is hidden are above two to one, e to the power of 0.8.
"""

_HIDDEN_WIDTHS = 2.0
"""Length from which a gap is evidence that something hides parts of the cables, widths.

Source: by hand; shorter gaps are common in masks of cables in plain sight.
"""

_SIZE_RATIO = 1.5
"""Length of another gap over that of the longest one with evidence, up to which the same may hide it.

Source: by hand; a disc hides chords of any length up to its diameter.
"""

_MOST_EVIDENCE = 3
"""Number of gaps with evidence that are kept, the longest.

Source: derived; a pair shares its ends with two of them at most.
"""


@helper
def _gap_length(nodes: npt.NDArray[np.int64], states: npt.NDArray[np.float64], i: int, j: int) -> float:
    """Return the length of the gap between two ends, px; 0 between ends at one junction."""
    if nodes[i] >= 0 and nodes[i] == nodes[j]:
        return 0.0
    return np.hypot(states[i, X] - states[j, X], states[i, Y] - states[j, Y])


@helper
def _match_gaining(
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
    bonus: npt.NDArray[np.float64],
    open_cost: npt.NDArray[np.float64],
    end_id: npt.NDArray[np.int64],
) -> tuple[_Joints, npt.NDArray[np.float64]]:
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
def _find_hidden(
    partner: npt.NDArray[np.int64],
    margin: npt.NDArray[np.float64],
    nodes: npt.NDArray[np.int64],
    states: npt.NDArray[np.float64],
    width: float,
    hidden: npt.NDArray[np.int64],
    lengths: npt.NDArray[np.float64],
) -> int:
    """Write the joints that are evidence that something hides, the longest first, and their lengths; count them."""
    count = 0
    for i in range(len(partner)):
        if partner[i] <= i or margin[i] < _HIDDEN_MARGIN:
            continue
        length = _gap_length(nodes, states, i, partner[i])
        if length < _HIDDEN_WIDTHS * width:
            continue
        place = min(count, _MOST_EVIDENCE)
        while place > 0 and lengths[place - 1] < length:
            place -= 1
        for k in range(min(count, _MOST_EVIDENCE - 1), place, -1):
            hidden[k], lengths[k] = hidden[k - 1], lengths[k - 1]
        if place < _MOST_EVIDENCE:
            hidden[place], lengths[place] = i, length
            count = min(count + 1, _MOST_EVIDENCE)
    return count


@helper
def _lower_costs(
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
    hidden: npt.NDArray[np.int64],
    lengths: npt.NDArray[np.float64],
    partner: npt.NDArray[np.int64],
    nodes: npt.NDArray[np.int64],
    states: npt.NDArray[np.float64],
    width: float,
) -> npt.NDArray[np.float64]:
    """Return the costs, lower for gaps that share no end with a hidden one of about their size."""
    lowered = costs.copy()
    for p in range(len(rows)):
        i, j = rows[p], columns[p]
        for k in range(len(hidden)):
            a, b = hidden[k], partner[hidden[k]]
            if i not in (a, b) and j not in (a, b):
                length = _gap_length(nodes, states, i, j)
                if length <= _SIZE_RATIO * lengths[k]:
                    lowered[p] -= _HIDING_SHARE * JOINT[GAP_LENGTH] * length / width
                break
    return lowered


@kernel(
    read(int64, 1), read(int64, 1), read(float64, 1), read(float64, 1), read(float64, 1), read(int64, 1),
    read(int64, 1), read(float64, 2), float64,
)  # fmt: skip
def match_with_hiding(
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
    bonus: npt.NDArray[np.float64],
    open_cost: npt.NDArray[np.float64],
    end_id: npt.NDArray[np.int64],
    nodes: npt.NDArray[np.int64],
    states: npt.NDArray[np.float64],
    width: float,
) -> tuple[
    npt.NDArray[np.int64],
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.int64],
    float,
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
]:
    """Match ends as `match_ends`, and once more if a sure gap shows that something hides parts of the cables.

    Gaps of about its size that share no end with it then cost less. Pairs that cost more than two open ends take no
    part.

    Parameters
    ----------
    rows, columns, costs, bonus, open_cost, end_id
        As `match_ends` takes them.
    nodes : (n,) int64
    states : (n, 6) float64
    width : float
        px.

    Returns
    -------
    partner, cost, margin, alternative, override
        As `match_ends` returns them.
    costs : (k,) float64
        Costs of the pairs as they were matched.
    lacking : (k,) float64
        Extra cost of each pair over two open ends.
    """
    given = costs.copy()  # of the type of the lowered costs, so that they are matched by the same code
    joints, lacking = _match_gaining(rows, columns, given, bonus, open_cost, end_id)
    hidden, lengths = np.empty(_MOST_EVIDENCE, dtype=np.int64), np.empty(_MOST_EVIDENCE)
    count = _find_hidden(joints[0], joints[2], nodes, states, width, hidden, lengths)
    lowered = _lower_costs(rows, columns, given, hidden[:count], lengths, joints[0], nodes, states, width)
    if count > 0:
        joints, lacking = _match_gaining(rows, columns, lowered, bonus, open_cost, end_id)
    partner, cost, margin, alternative, override = joints
    return partner, cost, margin, alternative, override, lowered, lacking


@kernel(
    read(int64, 1), read(int64, 1), read(float64, 1), read(int64, 1), read(float64, 1), read(int64, 1),
    read(float64, 2), float64,
)  # fmt: skip
def lower_hidden(
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    costs: npt.NDArray[np.float64],
    partner: npt.NDArray[np.int64],
    margin: npt.NDArray[np.float64],
    nodes: npt.NDArray[np.int64],
    states: npt.NDArray[np.float64],
    width: float,
) -> npt.NDArray[np.float64]:
    """Return the costs of pairs of ends as `match_with_hiding` lowers them, after a matching that is made.

    Parameters
    ----------
    rows, columns : (k,) int64
    costs : (k,) float64
    partner : (n,) int64
        Of each end in the matching, or -1.
    margin : (n,) float64
        Of each joint.
    nodes : (n,) int64
    states : (n, 6) float64
    width : float
        px.

    Returns
    -------
    (k,) float64
        nats.
    """
    hidden, lengths = np.empty(_MOST_EVIDENCE, dtype=np.int64), np.empty(_MOST_EVIDENCE)
    count = _find_hidden(partner, margin, nodes, states, width, hidden, lengths)
    return _lower_costs(rows, columns, costs, hidden[:count], lengths, partner, nodes, states, width)
