"""For branches that two cables share: the side of each cable, their crossings and their ends."""

from __future__ import annotations

import numpy as np

from dloftbs.data.graph import (
    POSITION,
    UNAVAILABLE,
    Graph,
    branch_of,
    is_start,
    other_end,
    same_side,
    start_of,
    stop_of,
)
from dloftbs.linking.end_widths import gain_by_width
from dloftbs.linking.evidence_steps import MIN_GAIN, EvidenceSteps
from dloftbs.linking.kernels import parallel_runs as kernels
from dloftbs.linking.matched_ends import Branches, EndMatching
from dloftbs.linking.temporal_prior import TemporalPrior
from dloftbs.support.arrays import FloatArray

_MIN_EVIDENCE = 0.1
"""Evidence, half a logarithm of a ratio of residuals, above which a cable is moved to the other side of a bundle.

Source: by hand; below it the smoother of two axes is chance.
"""

_UNDER_WIDTHS = 2.0
"""Length beyond the end of a cable, as the width of the mask shows it, where it may still lie over the other, widths.

Source: by hand; at small angles two cables look like one before they end.
"""

_UNCLEAR = 2.8
"""Log-odds of crossing or touching above which the past does not count, nats.

Source: by hand; it is a factor of 2 between the root mean squared residuals.
"""

_MIN_LEAD = 0.3
"""Least advantage by the past, a difference of two sums of continuity, for an exchange.

Source: by hand; continuity of a link is in 0 to 1.
"""

_Series = list[tuple[int, int]]


def separate_parallel_runs(
    graph: Graph, matching: EndMatching, prior: TemporalPrior | None = None, steps: EvidenceSteps | None = None
) -> None:
    """Give each cable of shared branches its own offset axis, and join it with the cable that continues it.

    Widths and steps in depth and colour count as well as the mask, and the prior decides where all are unclear.
    Partners change where the cables cross otherwise than the duplicates were joined; points and radii of the shared
    branches change.

    Parameters
    ----------
    graph : Graph
    matching : EndMatching
        Changed.
    prior : TemporalPrior, optional
    steps : EvidenceSteps, optional
    """
    if not matching.branches.duplicate_of:
        return
    # Not smoothed: a smooth width does not show where one cable lies over the other.
    raw_radius = matching.branches.raw_radius
    assert raw_radius is not None  # shared branches were found by it
    for series in _all_series(matching):
        _separate(graph, matching, series, raw_radius, prior, steps)


def _all_series(matching: EndMatching) -> list[_Series]:
    """List the series of branches that the same two cables share, as the ends at which the two enter them."""
    found = []
    done: set[int] = set()
    for branch, duplicate in sorted(matching.branches.duplicate_of.items()):
        if branch not in done:
            done |= {branch, duplicate}
            back = _follow(matching, stop_of(branch), done)
            ahead = _follow(matching, start_of(branch), done)
            found.append(_reversed(back[1:]) + ahead)
    return found


def _follow(matching: EndMatching, end: int, done: set[int]) -> _Series:
    duplicate_of = matching.branches.duplicate_of
    series = [(end, same_side(duplicate_of[branch_of(end)], end))]
    while True:
        one, two = (matching.partner[other_end(e)] for e in series[-1])
        branch = branch_of(one)
        shared = one >= 0 and two >= 0 and duplicate_of.get(branch) == branch_of(two)
        if not shared or is_start(one) != is_start(two) or branch in done:
            return series
        done |= {branch, branch_of(two)}
        series.append((one, two))


def _reversed(series: _Series) -> _Series:
    return [(other_end(one), other_end(two)) for one, two in reversed(series)]


def _separate(
    graph: Graph,
    matching: EndMatching,
    series: _Series,
    raw_radius: FloatArray,
    prior: TemporalPrior | None,
    steps: EvidenceSteps | None,
) -> None:
    branches, partner, width = matching.branches, matching.partner, graph.width
    if _one_stops_at(branches, series[0]):  # the branch inside of which a cable ends comes last
        series = _reversed(series)
    ((exit_one, exit_two),) = _reversed(series[-1:])
    inside = _one_stops_at(branches, (exit_one, exit_two))
    before = [partner[end] for end in series[0]]
    after = [partner[exit_one], partner[exit_two]]
    if min(before) < 0:
        return
    stretches = [_stretch(graph, branches, ends) for ends in series]
    at = np.concatenate(stretches)
    if len(at) < 2:
        return
    middle = graph.points[at]
    shift, arc, separation = kernels.offset_axes(middle, raw_radius[at], width)
    positions = branches.end_states[:, POSITION]
    normal = _across(middle, 0)
    first_side = 1.0 if normal @ (positions[before[0]] - positions[before[1]]) >= 0.0 else -1.0
    leaves = not inside and min(after) >= 0
    last_side, continued = first_side, [middle[:0], middle[:0]]
    if leaves:
        last_side = 1.0 if _across(middle, -1) @ (positions[after[0]] - positions[after[1]]) >= 0.0 else -1.0
        continued = [_along(graph, branches, end) for end in after]
        if last_side != first_side:
            continued.reverse()
    shift = first_side * shift
    leading = [_along(graph, branches, end) for end in before]
    swapped, margin, weakest = kernels.find_swaps(
        middle + shift, middle - shift, arc, separation, leading[0], leading[1], continued[0], continued[1], width
    )
    if leaves and weakest >= 0:
        # The evidence of the mask is for exchanging the exits, or against it; so are widths, depth and colours.
        exchanged = (last_side != first_side) != swapped[-1]
        reach = int(kernels.WINDOW * width)  # pixels show too little of the width of a thin cable
        gain = gain_by_width(branches, before, after, reach) if reach >= kernels.MIN_WINDOW_PX else 0.0
        gain += 0.0 if steps is None else steps.gain(exit_one, exit_two)
        margin += (1.0 if exchanged else -1.0) * gain
        if margin < 0.0:
            swapped[weakest:] = ~swapped[weakest:]
            margin = -margin
    if leaves and prior is not None and margin < _UNCLEAR and weakest >= 0:
        # The cable that comes in on the first side leaves on it, unless the two swap sides.
        stays = (last_side == first_side) != swapped[-1]
        lead = _gain_of_swap(branches, prior, before, after if stays else after[::-1])
        if lead > _MIN_LEAD:
            swapped[weakest:] = ~swapped[weakest:]
            margin = -margin
    for end in (*before, *(after if leaves else ())):
        matching.limit_margin(end, margin)
    if leaves and (last_side != first_side) != swapped[-1]:
        matching.trade_places(exit_one, exit_two)
    sign = np.where(swapped[:-1], -1.0, 1.0)
    if inside and _other_one_stops(graph, matching, series, before, raw_radius, first_side * sign[-1], steps):
        matching.trade_places(series[0][0], series[0][1])
        sign = -sign
    _move(branches, series, stretches, sign[:, None] * shift, width)


def _one_stops_at(branches: Branches, ends: tuple[int, int]) -> bool:
    return UNAVAILABLE in (branches.nodes[ends[0]], branches.nodes[ends[1]])


def _gain_of_swap(branches: Branches, prior: TemporalPrior, before: list[int], after: list[int]) -> float:
    """Return the gain in continuity with the prior if two cables leave their shared branches the other way round."""
    rows, columns = np.array([*before, *before]), np.array([*after, *after[::-1]])
    same, same_2, other, other_2 = prior.continuity(branches.end_states, rows, columns).tolist()
    return float(other + other_2 - same - same_2)


def _stretch(graph: Graph, branches: Branches, ends: tuple[int, int]) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return the points of the graph that both duplicates of a branch have, in the order of the route."""
    start, stop = graph.spans[branches.branch_id[branch_of(ends[0])]].tolist()
    shorter = min(b - a for a, b in (branches.spans[branch_of(end)] for end in ends))
    forwards = is_start(ends[0])
    if _one_stops_at(branches, (other_end(ends[0]), other_end(ends[1]))):
        start, stop = (start, start + shorter) if forwards else (stop - shorter, stop)
    return np.arange(start, stop) if forwards else np.arange(stop - 1, start - 1, -1)


def _along(graph: Graph, branches: Branches, end: int) -> FloatArray:
    """Return the points of a branch next to one of its ends, from there on."""
    start, stop = branches.spans[branch_of(end)]
    most = max(int(kernels.WINDOW * graph.width) + 4, kernels.MIN_WINDOW_PX)
    if is_start(end):
        return branches.points[start : min(start + most, stop)]
    return branches.points[max(stop - most, start) : stop][::-1]


def _across(middle: FloatArray, at: int) -> FloatArray:
    """Return the normal at the first or the last point, on the side to which x turns into y."""
    few = middle[:8] if at == 0 else middle[-8:]
    dx, dy = few[-1] - few[0]
    return np.array([-dy, dx])


def _other_one_stops(
    graph: Graph,
    matching: EndMatching,
    series: _Series,
    before: list[int],
    raw_radius: FloatArray,
    side: float,
    steps: EvidenceSteps | None,
) -> bool:
    """Return whether of two cables that share branches the one that seems to run on ends, and the other one runs on.

    Both enter the branches by the same end, so that the matching cannot decide. Depth and colours do where they show
    it.

    Parameters
    ----------
    graph, matching
    series : list of (int, int)
        The ends at which both enter the branches; in the last one of these, one of them ends.
    before : list of int
        Where each comes from.
    raw_radius : numpy.ndarray, shape (m,)
    side : float
        1 where the first of the two lies at last on the side to which x turns into y, -1 on the other.
    steps : EvidenceSteps, optional
    """
    branches, nodes, width = matching.branches, matching.branches.nodes, graph.width
    ends = series[-1]
    running = 0 if nodes[other_end(ends[1])] == UNAVAILABLE else 1
    onward = matching.partner[other_end(ends[running])]
    start, stop = graph.spans[branches.branch_id[branch_of(ends[0])]].tolist()
    forwards = is_start(ends[0])
    at = np.arange(start, stop) if forwards else np.arange(stop - 1, start - 1, -1)
    first, last = branches.spans[branch_of(ends[1 - running])]
    shared = last - first
    if steps is not None:
        skipped = min(int(_UNDER_WIDTHS * width), (len(at) - shared) // 2)
        lone = shared + skipped
        length = sum(branches.spans[branch_of(end)][1] - branches.spans[branch_of(end)][0] for end, _ in series[:-1])
        gain = steps.gain_of_second(
            [before[running], before[1 - running]],
            (start + lone, stop) if forwards else (start, stop - lone),
            forwards,
            length + lone,
        )
        if abs(gain) >= MIN_GAIN:
            return gain > 0.0
    middle = graph.points[at]
    shift, _, _ = kernels.offset_axes(middle, raw_radius[at], width)
    if onward >= 0:
        further = _along(graph, branches, onward)
        middle, shift = np.concatenate((middle, further)), np.concatenate((shift, np.zeros_like(further)))
    evidence = kernels.continuing_axis(middle, shift, shared, width)
    lies = side if running == 0 else -side
    return abs(evidence) > _MIN_EVIDENCE and (evidence > 0.0) != (lies > 0.0)


def _move(
    branches: Branches,
    series: _Series,
    stretches: list[np.ndarray[tuple[int], np.dtype[np.int64]]],
    shift: FloatArray,
    width: float,
) -> None:
    """Move the points of the two duplicates apart, in place: with duplicates, the graph has points of its own."""
    done = 0
    for ends, stretch in zip(series, stretches, strict=True):
        by = shift[done : done + len(stretch)]
        done += len(stretch)
        for end, sign in zip(ends, (1.0, -1.0), strict=True):
            branches.shift(end, sign * by, 0.5 * width)
