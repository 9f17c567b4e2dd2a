"""Stage 5: graph to pairing: which ends belong together, through junctions, across gaps and along shared runs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.evidence import EvidenceMap
from dloftbs.graph import UNAVAILABLE, Graph, Pairing
from dloftbs.kernels.tracing import measure_radius
from dloftbs.linking.kernels import bending, branch_overlap, end_matching
from dloftbs.linking.kernels.wide_stretches import wide_reach
from dloftbs.mask_crop import MaskCrop
from dloftbs.prior import TemporalPrior

_ROUNDS = 4
PAST_BONUS = 0.6
"""Maximum discount for a joint that continues a curve that was seen before."""
UNCLEAR = 0.55
"""Ends that lack less than this to be joined are in doubt: the odds are below nine to one."""

_CHORD_REACH_PX = 4
_Ints = npt.NDArray[np.int64]
_Floats = npt.NDArray[np.float64]
_Passes = tuple[_Ints, _Ints, _Ints, _Floats]
# Off the price of a gap, per width that something hides: of drawn pictures 0 to 0.07 change less than .02.
_HIDDEN = 0.03
# Per width of ground in sight: two widths cost more than any two open ends. Half and twice that change less than .02.
_GROUND = 1.5


class _Ends(NamedTuple):
    """The ends of a graph, those of copies of shared runs among them.

    Parameters
    ----------
    nodes : numpy.ndarray, shape (n,)
        The junction at each.
    identity : numpy.ndarray, shape (n,)
        The end of the graph that each is.
    arms : numpy.ndarray, shape (n, 6)
    price : numpy.ndarray, shape (n,)
        Of leaving each open.
    """

    nodes: _Ints
    identity: _Ints
    arms: _Floats
    price: _Floats


def pair(
    patch: MaskCrop,
    graph: Graph,
    max_gap_widths: float,
    past: TemporalPrior | None = None,
    evidence: EvidenceMap | None = None,
) -> Pairing:
    """Join the ends of a graph so that the cables bend the least, and few ends stay open.

    Parameters
    ----------
    patch : MaskCrop
    graph : Graph
    max_gap_widths : float
        Longest gap that is bridged, in widths.
    past : TemporalPrior, optional
        Pairs of ends that continue each other along a curve that was seen before cost less.
    evidence : EvidenceMap, optional
        Image that decides the cost of a gap by the look of the stretch between its ends.

    Returns
    -------
    Pairing
    """
    mask = patch.posed(patch.pixels)
    passes = bending.junction_costs(graph.nodes, graph.spurs, graph.arms, graph.width, mask)
    copies, partial, saved, reach, raw = _find_shared(graph, mask, passes)
    original, nodes, spurs, arms, caps = np.arange(graph.runs), graph.nodes, graph.spurs, graph.arms, graph.caps
    identity = np.arange(2 * graph.runs)
    if len(copies):
        original = np.concatenate((original, copies))
        identity = (2 * original[:, None] + (0, 1)).ravel()
        nodes, arms, caps = nodes[identity], arms[identity], caps[identity]
        far = partial >= 0
        nodes[2 * graph.runs + 2 * np.flatnonzero(far) + 1 - partial[far] % 2] = UNAVAILABLE
        spurs = np.concatenate((spurs, np.zeros(len(copies), dtype=np.bool_)))
    points, radius, spans = _own_points(graph, copies, partial, reach)
    more = max(UNCLEAR, 0.0 if past is None else PAST_BONUS)
    rows, columns, costs, price = bending.pair_costs(
        nodes,
        identity,
        spurs,
        caps,
        arms,
        graph.width,
        mask,
        *passes,
        graph.bordering[identity],
        graph.corners[identity],
        max_gap_widths * graph.width,
        0.0 if evidence is None else 2.0 * bending.OPEN_CUT + _HIDDEN * max_gap_widths,
        more,
    )
    if evidence is not None:
        ends = _Ends(nodes, identity, arms, price)
        rows, columns, costs = _weigh_gaps(graph, ends, rows, columns, costs, evidence, more)
    bonus = np.zeros(len(rows))
    if past is not None and len(rows):
        bonus = PAST_BONUS * past.continuity(arms, rows, columns)
    nearly: list[tuple[float, float, int, int]] = []
    if len(rows):
        lacking = costs - bonus - price[rows] - price[columns]
        worth = lacking < 0.0
        if not worth.all():
            is_near = ~worth & (lacking < UNCLEAR) & (nodes[rows] < 0) & (nodes[columns] < 0)
            near = [given[is_near].tolist() for given in (lacking, costs, rows, columns)]
            nearly = sorted(zip(*near, strict=True))
            rows, columns, costs, bonus = rows[worth], columns[worth], costs[worth], bonus[worth]
    partner, cost, margin, other, overruled = end_matching.pair_ends(rows, columns, costs, bonus, price, identity)
    twin = {}
    for copy, (run, worth) in enumerate(zip(copies.tolist(), saved.tolist(), strict=True), start=graph.runs):
        twin[copy], twin[run] = run, copy
        for end in (2 * copy, 2 * copy + 1, 2 * run, 2 * run + 1):
            # Not to share the run would be another choice, too.
            if partner[end] >= 0:
                margin[end] = margin[partner[end]] = min(margin[end], worth)
    return Pairing(
        points,
        radius,
        original.tolist(),
        nodes.tolist(),
        price.tolist(),
        spans,
        spurs.tolist(),
        arms,
        partner.tolist(),
        cost.tolist(),
        margin.tolist(),
        other.tolist(),
        twin,
        raw,
        overruled,
        nearly,
    )


def _weigh_gaps(
    graph: Graph, ends: _Ends, rows: _Ints, columns: _Ints, costs: _Floats, evidence: EvidenceMap, more: float
) -> tuple[_Ints, _Ints, _Floats]:
    """Let pairs cost across gaps what the image says, and leave out what costs more than two open ends.

    Ground in sight makes a gap dear, and what tells nothing changes nothing. Where most of a gap shows something that
    hides it, or the cable itself, its ends are no cable's own, whatever they look like.

    Parameters
    ----------
    graph : Graph
    ends : Ends
    rows, columns : numpy.ndarray, shape (k,)
        The pairs, those through junctions among them.
    costs : numpy.ndarray, shape (k,)
    evidence : EvidenceMap
    more : float
        Largest extra cost of pairs over that of open ends.

    Returns
    -------
    rows, columns, costs
        Remaining pairs, in the same order.
    """
    gaps = np.flatnonzero((ends.nodes[rows] < 0) | (ends.nodes[rows] != ends.nodes[columns]))
    if len(gaps) == 0:
        return rows, columns, costs
    first, second, width = rows[gaps], columns[gaps], graph.width
    pairs = np.stack((ends.identity[first], ends.identity[second]), axis=1)
    ground, cable, neither = evidence.across(graph.points, graph.spans, graph.arms, pairs, width).T
    length = np.maximum(np.hypot(*(ends.arms[first, :2] - ends.arms[second, :2]).T) / width, 1e-9)
    hidden = np.minimum(cable + neither, length)
    open_price = ends.price[first] + ends.price[second]
    looks = np.maximum(2.0 * bending.OPEN_CUT - open_price, 0.0) * np.maximum(hidden - ground, 0.0) / length
    costs = costs.copy()
    costs[gaps] += _GROUND * ground - _HIDDEN * hidden - looks
    keep = np.ones(len(rows), dtype=np.bool_)
    keep[gaps] = costs[gaps] < open_price + more
    return rows[keep], columns[keep], costs[keep]


def _own_points(
    graph: Graph, copies: _Ints, partial: _Ints, reach: _Ints
) -> tuple[_Floats, _Floats, list[tuple[int, int]]]:
    """Return points, radius and spans with those of the copies behind."""
    spans = [(start, stop) for start, stop in graph.spans.tolist()]
    if len(copies) == 0:
        return graph.points, graph.radius, spans
    points, radius = [graph.points], [graph.radius]
    at = len(graph.points)
    for run, end in zip(copies.tolist(), partial.tolist(), strict=True):
        start, stop = spans[run]
        if end >= 0:
            start, stop = (start, start + int(reach[end])) if end % 2 == 0 else (stop - int(reach[end]), stop)
        points.append(graph.points[start:stop])
        radius.append(graph.radius[start:stop])
        spans.append((at, at + stop - start))
        at += stop - start
    return np.concatenate(points), np.concatenate(radius), spans


def _find_shared(
    graph: Graph, mask: npt.NDArray[np.uint8], passes: _Passes
) -> tuple[_Ints, _Ints, _Floats, _Ints, _Floats | None]:
    """Return the runs that two cables share.

    Parameters
    ----------
    graph : Graph
    mask : (H, W) uint8
    passes
        What `junction_costs` makes of the graph.

    Returns
    -------
    copies, partial : (c,) int64
        The runs, and for each the end from which it is shared in part, or -1.
    saved : (c,) float64
        Gain from sharing them.
    reach : (2 n,) int64
        As `wide_reach` makes it.
    raw : (m,) float64 or None
        Half the mask's width as it was measured for that; None where no run can be shared.
    """
    copies = partial = reach = np.empty(0, dtype=np.int64)
    saved_by = np.empty(0)
    if not branch_overlap.has_odd_junction(graph.nodes, graph.spurs):
        return copies, partial, saved_by, reach, None
    spans, width = graph.spans, graph.width
    # The width as it is at each pixel: what re-centring knows of it stops where two cables lie side by side.
    raw = measure_radius(mask, graph.pixels, graph.offsets, _CHORD_REACH_PX)
    reach, widths = wide_reach(graph.nodes, spans, raw, width)
    lengths = (spans[:, 1] - spans[:, 0]).astype(np.float64)
    first, members, *_ = passes
    price = np.where(np.repeat(graph.spurs, 2), 0.0, bending.OPEN_ARM)
    nodes: list[int] | None = None
    for _ in range(_ROUNDS):
        paths, inside, path_price = branch_overlap.list_paths(
            graph.nodes, graph.spurs, reach, lengths, widths, width, *passes, copies, partial
        )
        if len(paths) == 0:
            break
        sets, slots, changes = branch_overlap.changed_junctions(
            paths, inside, graph.nodes, first, members, copies, partial
        )
        totals = end_matching.least_costs(sets, slots, graph.nodes, price, *passes)
        before, after, path_of = changes.T
        saved = np.bincount(path_of, totals[before] - totals[after], len(paths)) - path_price
        nodes = graph.nodes.tolist() if nodes is None else nodes
        chosen = _choose(paths, saved, nodes)
        if not chosen:
            break
        more, more_partial, more_saved = [], [], []
        for p, ends in chosen:
            more += [end // 2 for end in ends]
            more_saved += [saved[p]] * len(ends)
            more_partial += [-1] * (len(ends) - 1) + [ends[-1] if inside[p] else -1]
        copies = np.concatenate((copies, more))
        partial = np.concatenate((partial, more_partial))
        saved_by = np.concatenate((saved_by, more_saved))
    return copies, partial, saved_by, reach, raw


def _choose(paths: _Ints, saved: _Floats, nodes: list[int]) -> list[tuple[int, list[int]]]:
    """Take the paths that save anything, the best first, as far as they do not touch each other's junctions."""
    chosen: list[tuple[int, list[int]]] = []
    touched: set[int] = set()
    worth = np.flatnonzero(saved > 0.0)
    for p in worth[np.argsort(-saved[worth], kind="stable")].tolist():
        ends = [end for end in paths[p].tolist() if end >= 0]
        on_it = {nodes[e] for end in ends for e in (end, end ^ 1) if nodes[e] >= 0}
        if not touched & on_it:
            touched |= on_it
            chosen.append((p, ends))
    return chosen
