"""Routes of a known curve through the curves of one frame: each of its nodes is seen on one of them, or hidden."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, Ints, helper, inlined, kernel, read, write
from dloftbs.kernels.shared.selection import nth_least
from dloftbs.tracking.kernels.interpolation import value_at

_TANGENT_X, _TANGENT_Y, _EXTRA_COST = 2, 3, 4
"""Columns of a frame's samples after ``x`` and ``y``: the unit tangent, and a cost of its own.

Source: by definition.
"""

WIDENING_PER_S = 4.0
"""Growth of the gate and of the reach of an unseen track, multiples per second.

Source: by hand; it doubles in a quarter of a second.
"""

MAX_WIDENING = 3.0
"""Largest multiple to which they grow.

Source: by hand.
"""

SAMPLES_PER_NODE = 4
"""Number of samples of a frame's curves from one node of the known curve to the next.

Source: by hand; a node is found to a quarter of the spacing.
"""

_MAX_CANDIDATES = 64
"""Number of samples near a node that are kept, the cheapest.

Source: bounds time.
"""

_MIN_COSINE = 0.5
"""Least cosine between the headings of a node and of a sample that may be it.

Source: by hand; a crossing cable is left out, a bend that moves is not.
"""

_ALONG_WEIGHT = 0.25
"""Weight of a squared distance along the curve, ratio.

Source: by hand; the motion in that direction is known the least.
"""

_TURN_COST = 1.0
"""Cost of a right angle between the headings; a distance at the limit of reach costs 1.

Source: by definition of the unit of cost, and by hand.
"""

_SLIP_COST = (0.6, 0.15, 0.0, 0.15, 0.6)
"""Cost of advancing by 2 to 6 samples from node to node.

Source: by hand.
"""

_SWITCH_COST = 2.0
"""Cost of changing to another curve.

Source: by hand; twice that of a hidden node, so that it takes some nodes to be worth it.
"""

_HIDDEN_COST = 1.0
"""Cost of a node that is hidden.

Source: by definition; that of a sample at the limit of reach.
"""

_STILL_HIDDEN_COST = 0.4
"""Cost of a node that is hidden and was before.

Source: by hand; what hid it is likely there still.
"""

_HIDE_AT_END_COST = 0.3
"""Cost of a hidden span that begins or ends at the end of a curve.

Source: by hand; such ends are where something may hide the rest.
"""

_HIDE_INSIDE_COST = 3.0
"""Cost of a hidden span that begins or ends inside of a curve.

Source: by hand; a curve that is seen to go on is hardly hidden.
"""

MAX_BRIDGE = 1.15
"""Ratio of the chord between the ends of a hidden span to its length up to which it may be hidden.

Source: by hand; a hidden length is known to 15 %.
"""

_MAX_STEP = 6
"""Number of samples from node to node at most.

Source: by hand; half as far again as there are samples to a node.
"""

_MAX_SWITCH_STEP = 1.75
"""Distance over which a track may change from one curve to another, multiples of the node spacing.

Source: by hand; the next node but one is too far.
"""

_MIN_SWITCH_ADVANCE = 0.2
"""Advance along the track with such a change, multiples of the node spacing.

Source: by hand; above 0, so that no track turns back.
"""


class _Problem(NamedTuple):
    """Arguments of `find_route`; tangents (k, 2) of the nodes, curves (n,) of the samples, steps that are at an end."""

    nodes: Floats
    headings: Floats
    samples: Floats
    part: Ints
    bounds: Ints
    spacing: float
    slack: float
    room: int


class _Candidates(NamedTuple):
    """Samples (k, m) at which each node may be seen, negative if reversed, their costs, and how many there are."""

    found: Ints
    costs: Floats
    sizes: Ints


@helper
def _tangent(points: Floats, first: int, last: int, i: int) -> tuple[float, float]:
    """Return the unit tangent at a point of a curve that lies from `first` to `last`; 0 if its neighbours coincide."""
    before, after = max(i - 1, first), min(i + 1, last)
    x, y = points[after, 0] - points[before, 0], points[after, 1] - points[before, 1]
    size = math.sqrt(x * x + y * y)
    return (x / size, y / size) if size > 0.0 else (0.0, 0.0)


@helper
def _find_candidates(k: int, problem: _Problem, steps_per_px: float, candidates: _Candidates) -> None:
    """Find the samples, so many to a pixel at least, that a node may be seen at."""
    found, costs, count = candidates.found[k], candidates.costs[k], 0
    samples, bounds = problem.samples, problem.bounds
    x, y, reach = problem.nodes[k, 0], problem.nodes[k, 1], problem.nodes[k, 2]
    towards_x, towards_y = problem.headings[k, 0], problem.headings[k, 1]
    for p in range(len(bounds)):
        i, last = bounds[p, 0], bounds[p, 1]
        while i <= last:
            dx, dy = samples[i, 0] - x, samples[i, 1] - y
            squared = dx * dx + dy * dy
            if squared > reach * reach:
                # Compared as floats, since there is no integer for infinity.
                i += int(max(1.0, min((math.sqrt(squared) - reach) * steps_per_px, last + 1.0 - i)))
                continue
            cosine = samples[i, _TANGENT_X] * towards_x + samples[i, _TANGENT_Y] * towards_y
            if abs(cosine) >= _MIN_COSINE:
                along = dx * towards_x + dy * towards_y
                weighted = squared - (1.0 - _ALONG_WEIGHT) * along * along
                cost = weighted / (reach * reach) + _TURN_COST * (1.0 - abs(cosine)) + samples[i, _EXTRA_COST]
                at = count if count < _MAX_CANDIDATES else int(np.argmax(costs))
                if count < _MAX_CANDIDATES or cost < costs[at]:
                    found[at] = i + 1 if cosine > 0.0 else -(i + 1)
                    costs[at] = cost
                    count = min(count + 1, _MAX_CANDIDATES)
            i += 1
    candidates.sizes[k] = count


@kernel(read(float64, 2), read(float64, 1), float64, float64, int64)
def place_nodes(predicted: Floats, unseen_s: Floats, frameless_s: float, reach: float, count: int) -> Floats:
    """Place the nodes of a known curve evenly along it.

    Parameters
    ----------
    predicted : (m, 2) float64
        Samples of it at even parameters, px.
    unseen_s : (m,) float64
        Seconds from when each was last seen to the last frame.
    frameless_s : float
        Seconds since then in which frames were due, and none came.
    reach : float
        Largest distance of what may be a node that was just seen, px.
    count : int
        Number of nodes, two or more.

    Returns
    -------
    (count, 4) float64
        As for `find_route`.
    """
    samples, nodes = np.empty((len(predicted), 4)), np.empty((count, 4))
    for i in range(len(predicted)):
        samples[i, 0], samples[i, 1] = predicted[i, 0], predicted[i, 1]
        samples[i, 2] = reach * min(1.0 + WIDENING_PER_S * (unseen_s[i] + frameless_s), MAX_WIDENING)
        samples[i, 3] = _STILL_HIDDEN_COST if unseen_s[i] > 0.0 else _HIDDEN_COST
    for k in range(count):
        for d in range(4):
            nodes[k, d] = value_at(samples, k / (count - 1) * (len(samples) - 1), d)
    return nodes


@kernel(write(float64, 2), read(int64, 2))
def describe_curves(samples: Floats, bounds: Ints) -> float:
    """Find the tangents along curves.

    Parameters
    ----------
    samples : (n, 5) float64
        As for `find_route`, one curve after the other; the tangents are written.
    bounds : (p, 2) int64
        First and last sample of each curve.

    Returns
    -------
    float
        The longest distance from sample to sample of a curve.
    """
    longest = 0.0
    for p in range(len(bounds)):
        for i in range(bounds[p, 0], bounds[p, 1] + 1):
            samples[i, _TANGENT_X], samples[i, _TANGENT_Y] = _tangent(samples, bounds[p, 0], bounds[p, 1], i)
            if i > bounds[p, 0]:
                step_x, step_y = samples[i, 0] - samples[i - 1, 0], samples[i, 1] - samples[i - 1, 1]
                longest = max(longest, math.hypot(step_x, step_y))
    return longest


@inlined
def _hiding_cost(signed: int, after: bool, problem: _Problem) -> float:
    """Return the cost of a hidden span that begins after a sample, or ends before it."""
    i = abs(signed) - 1
    first, last = problem.bounds[problem.part[i], 0], problem.bounds[problem.part[i], 1]
    beyond = last - i if (signed > 0) == after else i - first
    return _HIDE_AT_END_COST if beyond <= problem.room else _HIDE_INSIDE_COST


@inlined
def _follow_curve(signed: int, problem: _Problem, place: Ints, former: Ints, total: Floats) -> tuple[float, int]:
    """Return the least cost of reaching a sample along its curve, and the former node's candidate that has it."""
    i, way = abs(signed) - 1, 1 if signed > 0 else -1
    first, last = problem.bounds[problem.part[i], 0], problem.bounds[problem.part[i], 1]
    before = i - first if way > 0 else last - i
    least, source = math.inf, -1
    for advance in range(2, min(before, _MAX_STEP) + 1):
        p = place[i - way * advance]
        if p >= 0 and way * former[p] > 0:
            cost = total[p] + _SLIP_COST[advance - 2]
            if cost < least or (cost == least and p < source):
                least, source = cost, p
    return least, source


@inlined
def _may_reappear(signed: int, node: int, last_signed: int, last_node: int, problem: _Problem) -> bool:
    """Return True if a curve that was last seen at a node may be seen again at a sample, by the hidden length."""
    if last_node < 0:
        return True
    i, j, way = abs(signed) - 1, abs(last_signed) - 1, 1 if signed > 0 else -1
    samples, part = problem.samples, problem.part
    dx, dy = samples[i, 0] - samples[j, 0], samples[i, 1] - samples[j, 1]
    hidden = (node - last_node) * problem.spacing
    if math.sqrt(dx * dx + dy * dy) > MAX_BRIDGE * hidden + problem.slack:
        return False
    # Nothing is seen twice.
    return part[i] != part[j] or way * last_signed < 0 or way * (i - j) > 0


@inlined
def _may_switch(signed: int, other: int, node: int, problem: _Problem) -> bool:
    """Return True if a track may change to a sample at a node from another one, that is not the last on its curve."""
    i, j, way = abs(signed) - 1, abs(other) - 1, 1 if signed > 0 else -1
    samples, part, spacing = problem.samples, problem.part, problem.spacing
    if part[i] == part[j] and way * other > 0 and 2 <= way * (i - j) <= _MAX_STEP:
        return False
    dx, dy = samples[i, 0] - samples[j, 0], samples[i, 1] - samples[j, 1]
    near = dx * dx + dy * dy <= (_MAX_SWITCH_STEP * spacing) ** 2
    ahead = dx * problem.headings[node, 0] + dy * problem.headings[node, 1]
    return near and ahead >= _MIN_SWITCH_ADVANCE * spacing


@helper
def _trace_back(state: int, candidates: _Candidates, back: Ints, hidden_back: Ints, assignment: Ints) -> float:
    """Write the assignment that ends in a state, 0 if hidden; return the mean cost of the visible nodes."""
    total, seen = 0.0, 0
    for k in range(len(assignment) - 1, -1, -1):
        if state < 0:
            assignment[k] = 0
            state = hidden_back[k]
        else:
            assignment[k] = candidates.found[k, state]
            total += candidates.costs[k, state]
            seen += 1
            state = back[k, state]
    return total / seen if seen else math.inf


@helper
def _accumulate_costs(problem: _Problem, candidates: _Candidates, back: Ints, hidden_back: Ints) -> int:
    """Accumulate the least costs of all states, node by node; write their sources, and return the cheapest last state.

    A state is a candidate of a node, or -1 for being hidden.
    """
    found, costs, sizes = candidates.found, candidates.costs, candidates.sizes
    count, hidden_cost = len(problem.nodes), problem.nodes[:, 3]
    total = np.empty((count, _MAX_CANDIDATES))
    place = np.full(len(problem.samples), -1, dtype=np.int64)  # of each sample among the former node's candidates
    hidden_total, last_node, last_signed = hidden_cost[0], -1, 0  # cheapest hidden state, and where it was last seen
    for c in range(sizes[0]):
        total[0, c] = costs[0, c] + _hiding_cost(found[0, c], False, problem)
    for k in range(1, count):
        former, former_total, former_size = found[k - 1], total[k - 1], sizes[k - 1]
        cheapest = math.inf
        for p in range(former_size):
            cheapest = min(cheapest, former_total[p])
            place[abs(former[p]) - 1] = p
        for c in range(sizes[k]):
            signed = found[k, c]
            least, source = _follow_curve(signed, problem, place, former, former_total)
            cost = hidden_total + _hiding_cost(signed, False, problem)
            if cost < least and _may_reappear(signed, k, last_signed, last_node, problem):
                least, source = cost, -1
            if cheapest + _SWITCH_COST <= least:
                for p in range(former_size):
                    cost = former_total[p] + _SWITCH_COST
                    if cost > least or (cost == least and 0 <= source <= p):
                        continue
                    if _may_switch(signed, former[p], k, problem):
                        least, source = cost, p
            total[k, c], back[k, c] = least + costs[k, c], source
        for p in range(former_size):
            place[abs(former[p]) - 1] = -1
        hidden_total += hidden_cost[k]
        for p in range(former_size):
            cost = former_total[p] + _hiding_cost(former[p], True, problem) + hidden_cost[k]
            if cost < hidden_total:
                hidden_total, hidden_back[k], last_node, last_signed = cost, p, k - 1, former[p]
    state, least = -1, hidden_total
    for c in range(sizes[count - 1]):
        cost = total[count - 1, c] + _hiding_cost(found[count - 1, c], True, problem)
        if cost < least:
            state, least = c, cost
    return state


@kernel(read(float64, 2), read(float64, 2), read(int64, 2), float64, float64, float64, write(int64, 1))
def find_route(
    nodes: Floats, samples: Floats, bounds: Ints, longest_step: float, spacing: float, slack: float, assignment: Ints
) -> float:
    """Find the cheapest route of a known curve's nodes through a frame's curves, by dynamic programming.

    A node is seen at a sample that lies near in its direction, or hidden. The next one continues along the same curve,
    or at a cost along another one that passes there. A hidden span may end where its length allows.

    Parameters
    ----------
    nodes : (k, 4) float64
        Of the known curve, evenly spaced; two or more: the predicted ``x, y``, the largest distance of a sample, and
        the cost of the node being hidden; a sample at the limit of its reach costs 1.
    samples : (n, 5) float64
        Along the frame's curves, one after the other, `SAMPLES_PER_NODE` times as dense as the nodes: ``x, y``, the
        unit tangent, and what is added to the cost.
    bounds : (p, 2) int64
        First and last sample of each curve.
    longest_step : float
        From sample to sample, as `describe_curves` finds it.
    spacing : float
        From node to node.
    slack : float
        Distance from the end of a curve within which a sample is at the end.
    assignment : (k,) int64
        Written: one more than the index of the sample at which the node is seen, negative if the curve is reversed
        there, 0 if the node is hidden.

    Returns
    -------
    float
        Mean cost of the nodes that are seen; infinite if none is.
    """
    count = len(nodes)
    headings, part = np.empty((count, 2)), np.empty(len(samples), np.int64)
    for p in range(len(bounds)):
        part[bounds[p, 0] : bounds[p, 1] + 1] = p
    for k in range(count):
        headings[k, 0], headings[k, 1] = _tangent(nodes, 0, count - 1, k)
    room = int(slack / (spacing / SAMPLES_PER_NODE))
    problem = _Problem(nodes, headings, samples, part, bounds, spacing, slack, room)
    candidates = _Candidates(
        np.empty((count, _MAX_CANDIDATES), np.int64), np.empty((count, _MAX_CANDIDATES)), np.empty(count, np.int64)
    )
    steps_per_px = 1.0 / max(longest_step, spacing / SAMPLES_PER_NODE)
    for k in range(count):
        _find_candidates(k, problem, steps_per_px, candidates)
    back = np.empty((count, _MAX_CANDIDATES), dtype=np.int64)  # state of the former node; -1: hidden
    hidden_back = np.full(count, -1, dtype=np.int64)
    state = _accumulate_costs(problem, candidates, back, hidden_back)
    return _trace_back(state, candidates, back, hidden_back, assignment)


@kernel(read(int64, 1), read(int64, 1), int64, write(int64, 2))
def find_intervals(assignment: Ints, part: Ints, min_nodes: int, intervals: Ints) -> int:
    """Find the intervals of a route that follow one curve in one direction, without a gap or a leap.

    Parameters
    ----------
    assignment : (k,) int64
        As `find_route` writes it.
    part : (n,) int64
        Curve of each sample.
    min_nodes : int
        Least number of nodes of an interval.
    intervals : (k, 6) int64
        Written: the curve, the first and the last sample, the first and the last node, and twice the median over all
        nodes of the place of sample 0 along the nodes, in samples.

    Returns
    -------
    int
        Number of intervals.
    """
    count, node = 0, 0
    while node < len(assignment):
        if assignment[node] == 0:
            node += 1
            continue
        first, way = node, 0
        start = end = abs(assignment[node]) - 1
        node += 1
        while node < len(assignment) and assignment[node] != 0:
            i, sign = abs(assignment[node]) - 1, 1 if assignment[node] > 0 else -1
            if part[i] != part[start] or way not in (0, sign) or not 0 < (i - end) * sign <= _MAX_STEP:
                break
            end, way = i, sign
            node += 1
        if node - first < min_nodes:
            continue
        way = 1 if end >= start else -1
        origins = np.empty(node - first, dtype=np.int64)
        for k in range(first, node):
            origins[k - first] = SAMPLES_PER_NODE * k - way * (abs(assignment[k]) - 1)
        middle = nth_least(origins, (node - first) // 2) + nth_least(origins, (node - first - 1) // 2)
        intervals[count, 0], intervals[count, 1], intervals[count, 2] = part[start], start, end
        intervals[count, 3], intervals[count, 4], intervals[count, 5] = first, node - 1, middle
        count += 1
    return count
