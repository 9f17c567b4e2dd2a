"""Stage 5, for runs that two cables share: on which side each of them lies, where they cross, and which goes on."""

from __future__ import annotations

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.graph import UNAVAILABLE, Graph, Pairing
from dloftbs.linking.kernels import parallel_runs as kernels
from dloftbs.prior import TemporalPrior

_REACH_WIDTHS, _LEAST_REACH_PX = 3.0, 24
_LEAST_EVIDENCE = 0.1
_UNCLEAR = 0.7  # of the evidence for crossing or touching; past that, what was seen before does not count
_LEAST_LEAD = 0.3
_NOTHING: FloatArray = np.empty((0, 2))

_Series = list[tuple[int, int]]


def settle_lanes(graph: Graph, pairing: Pairing, past: TemporalPrior | None = None) -> None:
    """Give each cable of a shared run its own side of it, and join it with what goes on there.

    Where that is not clear, `past` decides, what was seen before.

    Changes `pairing`: partners, where the cables cross otherwise than the copies were joined, and the points and radii
    of the shared runs.
    """
    if not pairing.twin:
        return
    # The width as it is at each pixel: smoothed, it would not show where two cables are one over the other.
    raw = pairing.raw
    assert raw is not None  # pairing needed it to find what is shared
    for series in _all_series(pairing):
        _settle(graph, pairing, series, raw, past)


def _all_series(pairing: Pairing) -> list[_Series]:
    """List the runs that the same two cables share one after the other, as the ends at which the two enter them."""
    found = []
    done: set[int] = set()
    for run in sorted(pairing.twin):
        if run not in done:
            done |= {run, pairing.twin[run]}
            back = _follow(pairing, 2 * run + 1, done)
            ahead = _follow(pairing, 2 * run, done)
            found.append([(one ^ 1, two ^ 1) for one, two in back[:0:-1]] + ahead)
    return found


def _follow(pairing: Pairing, end: int, done: set[int]) -> _Series:
    series = [(end, 2 * pairing.twin[end // 2] + end % 2)]
    while True:
        one, two = (pairing.partner[e ^ 1] for e in series[-1])
        shared = one >= 0 and two >= 0 and pairing.twin.get(one // 2) == two // 2
        if not shared or (one ^ two) & 1 or one // 2 in done:
            return series
        done |= {one // 2, two // 2}
        series.append((one, two))


def _settle(graph: Graph, pairing: Pairing, series: _Series, raw: FloatArray, past: TemporalPrior | None) -> None:
    nodes, partner, width = pairing.nodes, pairing.partner, graph.width
    if UNAVAILABLE in (nodes[series[0][0]], nodes[series[0][1]]):  # where a cable ends inside comes last
        series = [(one ^ 1, two ^ 1) for one, two in reversed(series)]
    last = series[-1]
    inside = UNAVAILABLE in (nodes[last[0] ^ 1], nodes[last[1] ^ 1])
    before = [partner[end] for end in series[0]]
    after = [partner[end ^ 1] for end in last]
    if min(before) < 0:
        return
    stretches = [_stretch(graph, pairing, ends) for ends in series]
    at = np.concatenate(stretches)
    if len(at) < 2:
        return
    way = graph.points[at]
    shift, arc, separation = kernels.lay_lanes(way, raw[at], width)
    arms = pairing.arms[:, :2]
    normal = _across(way, 0)
    first_side = 1.0 if normal @ (arms[before[0]] - arms[before[1]]) >= 0.0 else -1.0
    leaves = not inside and min(after) >= 0
    last_side = first_side
    ways_out = [_NOTHING, _NOTHING]
    if leaves:
        last_side = 1.0 if _across(way, -1) @ (arms[after[0]] - arms[after[1]]) >= 0.0 else -1.0
        ways_out = [_along(graph, pairing, end) for end in after]
        if last_side != first_side:
            ways_out.reverse()
    shift = first_side * shift
    ways_in = [_along(graph, pairing, end) for end in before]
    changed, margin, weakest = kernels.follow_lanes(
        way + shift, way - shift, arc, separation, ways_in[0], ways_in[1], ways_out[0], ways_out[1], width
    )
    if leaves and past is not None and margin < _UNCLEAR and weakest >= 0:
        # What comes from the first side leaves on it, if it does not change lanes.
        stays = (last_side == first_side) != changed[-1]
        lead = _lead(pairing, past, before, after if stays else after[::-1])
        if lead > _LEAST_LEAD:
            changed[weakest:] = ~changed[weakest:]
            pairing.overruled, margin = max(pairing.overruled, margin), 0.0
    for end in (*before, *(after if leaves else ())):
        pairing.margin[end] = pairing.margin[partner[end]] = min(pairing.margin[end], margin)
    if leaves and (last_side != first_side) != changed[-1]:
        pairing.exchange(last[0] ^ 1, last[1] ^ 1)
    sign = np.where(changed[:-1], -1.0, 1.0)
    if inside and _ends_in_the_other_lane(graph, pairing, last, raw, first_side * sign[-1]):
        pairing.exchange(series[0][0], series[0][1])
        sign = -sign
    _move(pairing, series, stretches, sign[:, None] * shift, width)


def _lead(pairing: Pairing, past: TemporalPrior, before: list[int], after: list[int]) -> float:
    """Return the gain, by the past, of two cables leaving a run the other way round."""
    rows, columns = np.array([*before, *before]), np.array([*after, *after[::-1]])
    same, same_2, other, other_2 = past.continuity(pairing.arms, rows, columns).tolist()
    return float(other + other_2 - same - same_2)


def _stretch(graph: Graph, pairing: Pairing, ends: tuple[int, int]) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return the points of the graph that both copies of a run have, in the order in which they are passed."""
    start, stop = graph.spans[pairing.original[ends[0] // 2]].tolist()
    shorter = min(b - a for a, b in (pairing.spans[end // 2] for end in ends))
    forwards = ends[0] % 2 == 0
    if UNAVAILABLE in (pairing.nodes[ends[0] ^ 1], pairing.nodes[ends[1] ^ 1]):
        start, stop = (start, start + shorter) if forwards else (stop - shorter, stop)
    return np.arange(start, stop) if forwards else np.arange(stop - 1, start - 1, -1)


def _along(graph: Graph, pairing: Pairing, end: int) -> FloatArray:
    """Return how a run goes on from one of its ends."""
    start, stop = pairing.spans[end // 2]
    most = max(int(_REACH_WIDTHS * graph.width) + 4, _LEAST_REACH_PX)
    if end % 2 == 0:
        return pairing.points[start : min(start + most, stop)]
    return pairing.points[max(stop - most, start) : stop][::-1]


def _across(way: FloatArray, at: int) -> FloatArray:
    """Return the normal at the first or the last point, on the side to which x turns into y."""
    few = way[:8] if at == 0 else way[-8:]
    dx, dy = few[-1] - few[0]
    return np.array([-dy, dx])


def _ends_in_the_other_lane(
    graph: Graph, pairing: Pairing, ends: tuple[int, int], raw: FloatArray, side: float
) -> bool:
    """Tell whether, where one of two cables ends, the lane that goes on is not that of the copy that goes on.

    Parameters
    ----------
    graph, pairing
    ends : (int, int)
        At which the two enter the run.
    raw : numpy.ndarray, shape (m,)
    side : float
        1 where the first of the two lies on the side to which x turns into y, -1 on the other.
    """
    goes_on = 0 if pairing.nodes[ends[1] ^ 1] == UNAVAILABLE else 1
    start, stop = graph.spans[pairing.original[ends[0] // 2]].tolist()
    at = np.arange(start, stop) if ends[0] % 2 == 0 else np.arange(stop - 1, start - 1, -1)
    a, b = pairing.spans[ends[1 - goes_on] // 2]
    way = graph.points[at]
    shift, _, _ = kernels.lay_lanes(way, raw[at], graph.width)
    evidence = kernels.surviving_lane(way, shift, b - a, graph.width)
    lies = side if goes_on == 0 else -side
    return abs(evidence) > _LEAST_EVIDENCE and (evidence > 0.0) != (lies > 0.0)


def _move(
    pairing: Pairing,
    series: _Series,
    stretches: list[np.ndarray[tuple[int], np.dtype[np.int64]]],
    shift: FloatArray,
    width: float,
) -> None:
    """Move the points of the two copies apart, in place: where there are copies, the graph has points of its own."""
    points, radius = pairing.points, pairing.radius
    done = 0
    for ends, stretch in zip(series, stretches, strict=True):
        by = shift[done : done + len(stretch)]
        done += len(stretch)
        for end, sign in zip(ends, (1.0, -1.0), strict=True):
            start, stop = pairing.spans[end // 2]
            own = slice(start, start + len(by)) if end % 2 == 0 else slice(stop - len(by), stop)
            points[own] += sign * (by if end % 2 == 0 else by[::-1])
            radius[own] = 0.5 * width
