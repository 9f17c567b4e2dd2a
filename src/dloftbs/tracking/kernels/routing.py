"""The way of a remembered curve through what one frame shows: point by point, seen somewhere or hidden."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float64, int64

from dloftbs.kernels.compiler import helper, kernel, read, write

SAMPLES_PER_NODE = 4
"""Samples of a frame's curves from one node of the remembered one to the next."""

_MAX_CANDIDATES = 64  # samples near a node that are looked at: the cheapest
_MIN_COSINE = 0.5  # of the angle between a node's heading and a sample's, at least
_ALONG_WEIGHT = 0.25  # of a distance along the curve counts: how far a cable has slid is known the least
_TURN_COST = 1.0  # price of a right angle between the headings, by that of being out of reach
_SLIP_COST = (0.6, 0.15, 0.0, 0.15, 0.6)  # prices of going on by 2 to 6 samples from node to node
_SWITCH_COST = 2.0  # price of going on along another curve
_HIDE_AT_END_COST, _HIDE_INSIDE_COST = 0.3, 3.0  # of being hidden from where a curve ends on, and from anywhere else
_MAX_BRIDGE, _MAX_BRIDGE_CHANGE = (
    1.15,
    0.5,
)  # how far the ends of what is hidden may lie apart, and from where they were, by its length
_MAX_STEP = 6  # samples from node to node, at most
_PRUNE_COST = 8.0  # what costs so much more than the cheapest state of a node is not followed


@helper
def _write_tangent(
    points: npt.NDArray[np.float64], first: int, last: int, i: int, into: npt.NDArray[np.float64]
) -> None:
    """Write the unit tangent at a point of a curve that lies from `first` to `last`; 0 where it stands still."""
    before, after = max(i - 1, first), min(i + 1, last)
    x, y = points[after, 0] - points[before, 0], points[after, 1] - points[before, 1]
    size = math.sqrt(x * x + y * y)
    into[0], into[1] = (x / size, y / size) if size > 0.0 else (0.0, 0.0)


@helper
def _find_candidates(
    x: float,
    y: float,
    heading: npt.NDArray[np.float64],
    reach: float,
    step: float,
    samples: npt.NDArray[np.float64],
    tangents: npt.NDArray[np.float64],
    bounds: npt.NDArray[np.int64],
    nearby: npt.NDArray[np.int64],
    extra: npt.NDArray[np.float64],
    found: npt.NDArray[np.int64],
    price: npt.NDArray[np.float64],
) -> int:
    """Write the samples that a node may be, negative where it runs backwards, and their prices; return how many."""
    count, towards_x, towards_y = 0, heading[0], heading[1]
    for p in nearby:
        i, last = bounds[p, 0], bounds[p, 1]
        while i <= last:
            dx, dy = samples[i, 0] - x, samples[i, 1] - y
            far = math.sqrt(dx * dx + dy * dy)
            if far > reach:
                # Samples lie a step apart at most; compared as floats, since there is no integer for infinity.
                i += int(max(1.0, min((far - reach) / step, last + 1.0 - i)))
                continue
            if tangents[i, 0] == math.inf:
                _write_tangent(samples, bounds[p, 0], last, i, tangents[i])
            cosine = tangents[i, 0] * towards_x + tangents[i, 1] * towards_y
            if abs(cosine) >= _MIN_COSINE:
                along = dx * towards_x + dy * towards_y
                squared = dx * dx + dy * dy - (1.0 - _ALONG_WEIGHT) * along * along
                cost = squared / (reach * reach) + _TURN_COST * (1.0 - abs(cosine)) + extra[i]
                at = count if count < _MAX_CANDIDATES else int(np.argmax(price))
                if count < _MAX_CANDIDATES or cost < price[at]:
                    found[at] = i + 1 if cosine > 0.0 else -(i + 1)
                    price[at] = cost
                    count = min(count + 1, _MAX_CANDIDATES)
            i += 1
    return count


@helper
def _reachable_boxes(
    nodes: npt.NDArray[np.float64], reach: npt.NDArray[np.float64], boxes: npt.NDArray[np.float64]
) -> npt.NDArray[np.int64]:
    """Return the numbers of the boxes that some node may reach."""
    most = reach.max()
    left, right = nodes[:, 0].min() - most, nodes[:, 0].max() + most
    top, bottom = nodes[:, 1].min() - most, nodes[:, 1].max() + most
    result = np.empty(len(boxes), dtype=np.int64)
    count = 0
    for p in range(len(boxes)):
        if boxes[p, 0] <= right and boxes[p, 1] >= left and boxes[p, 2] <= bottom and boxes[p, 3] >= top:
            result[count] = p
            count += 1
    return result[:count]


@kernel(read(float64, 2), read(int64, 2), write(float64, 2))
def bounding_boxes(
    samples: npt.NDArray[np.float64], bounds: npt.NDArray[np.int64], boxes: npt.NDArray[np.float64]
) -> float:
    """Find the boxes around curves.

    Parameters
    ----------
    samples : (n, 2) float64
        Along the curves, one after the other.
    bounds : (p, 2) int64
        First and last sample of each curve.
    boxes : (p, 4) float64
        Written: least and greatest x, least and greatest y of each curve.

    Returns
    -------
    float
        The longest distance from sample to sample of a curve.
    """
    longest = 0.0
    for p in range(len(bounds)):
        boxes[p, 0] = boxes[p, 2] = math.inf
        boxes[p, 1] = boxes[p, 3] = -math.inf
        for i in range(bounds[p, 0], bounds[p, 1] + 1):
            x, y = samples[i, 0], samples[i, 1]
            boxes[p, 0], boxes[p, 1] = min(boxes[p, 0], x), max(boxes[p, 1], x)
            boxes[p, 2], boxes[p, 3] = min(boxes[p, 2], y), max(boxes[p, 3], y)
            if i > bounds[p, 0]:
                longest = max(longest, math.hypot(x - samples[i - 1, 0], y - samples[i - 1, 1]))
    return longest


@kernel(
    read(float64, 2),
    read(float64, 1),
    read(float64, 1),
    read(float64, 2),
    write(float64, 2),
    read(int64, 1),
    read(int64, 2),
    read(float64, 2),
    float64,
    read(float64, 1),
    float64,
    float64,
    write(int64, 1),
)
def find_route(
    nodes: npt.NDArray[np.float64],
    reach: npt.NDArray[np.float64],
    unseen: npt.NDArray[np.float64],
    samples: npt.NDArray[np.float64],
    tangents: npt.NDArray[np.float64],
    part: npt.NDArray[np.int64],
    bounds: npt.NDArray[np.int64],
    boxes: npt.NDArray[np.float64],
    longest: float,
    extra: npt.NDArray[np.float64],
    spacing: float,
    slack: float,
    at: npt.NDArray[np.int64],
) -> float:
    """Find the cheapest way of a curve's nodes through a frame's curves, by dynamic programming.

    A node is a sample that lies near and runs its way, or hidden. The next one goes on along the same curve, or for a
    price along another one that passes there. What is hidden ends where its length lets it.

    Parameters
    ----------
    nodes : (k, 2) float64
        Predicted points of the remembered curve, evenly spaced; two or more.
    reach : (k,) float64
        Largest distance from each.
    unseen : (k,) float64
        Price of each being hidden; a sample at the limit of its reach costs 1.
    samples : (n, 2) float64
        Along the frame's curves, one after the other, `SAMPLES_PER_NODE` times as dense as the nodes.
    tangents : (n, 2) float64
        Unit tangents at the samples, infinite where they are not known yet; written where they are asked for.
    part : (n,) int64
        Curve that each is of: 0, 1, ...
    bounds : (p, 2) int64
        First and last sample of each curve.
    boxes : (p, 4) float64
        As `bounding_boxes` writes them.
    longest : float
        From sample to sample of a curve: a short curve's samples lie closer together.
    extra : (n,) float64
        Added to the price of each.
    spacing : float
        From node to node.
    slack : float
        Distance from the end of a curve within which a sample is at it.
    at : (k,) int64
        Written: one more than the index of the sample that the node is, negative where the curve runs the other way,
        0 where it is hidden.

    Returns
    -------
    float
        The mean price of the nodes that are seen; infinite where none is.
    """
    count = len(nodes)
    step = spacing / SAMPLES_PER_NODE
    room = int(slack / step)
    nearby = _reachable_boxes(nodes, reach, boxes)
    heading = np.empty((count, 2))
    found = np.empty((count, _MAX_CANDIDATES), dtype=np.int64)
    price = np.empty((count, _MAX_CANDIDATES))
    value = np.empty((count, _MAX_CANDIDATES))
    back = np.empty((count, _MAX_CANDIDATES), dtype=np.int64)  # -1: hidden before
    size = np.empty(count, dtype=np.int64)
    place = np.full(len(samples), -1, dtype=np.int64)  # of each sample among those that the node before may be
    dark = np.empty(count)  # the cheapest way that is hidden at a node, where it comes from, and where it was seen
    dark_back = np.full(count, -1, dtype=np.int64)
    seen_at = np.full(count, -1, dtype=np.int64)
    seen_as = np.zeros(count, dtype=np.int64)
    longest = max(longest, step)
    for k in range(count):
        x, y = nodes[k, 0], nodes[k, 1]
        _write_tangent(nodes, 0, count - 1, k, heading[k])
        size[k] = _find_candidates(
            x, y, heading[k], reach[k], longest, samples, tangents, bounds, nearby, extra, found[k], price[k]
        )
    for c in range(size[0]):
        i = abs(found[0, c]) - 1
        first, last = bounds[part[i], 0], bounds[part[i], 1]
        before = i - first if found[0, c] > 0 else last - i
        value[0, c] = price[0, c] + (_HIDE_AT_END_COST if before <= room else _HIDE_INSIDE_COST)
    dark[0] = unseen[0]
    for k in range(1, count):
        cheapest = math.inf
        for p in range(size[k - 1]):
            cheapest = min(cheapest, value[k - 1, p])
            place[abs(found[k - 1, p]) - 1] = p
        most = min(dark[k - 1], cheapest) + _PRUNE_COST
        for c in range(size[k]):
            signed = found[k, c]
            i = abs(signed) - 1
            way = 1 if signed > 0 else -1
            first, last = bounds[part[i], 0], bounds[part[i], 1]
            before = i - first if way > 0 else last - i
            least, source = math.inf, -1
            for gone in range(2, min(before, 6) + 1):
                p = place[i - way * gone]
                if p >= 0 and value[k - 1, p] <= most and way * found[k - 1, p] > 0:
                    cost = value[k - 1, p] + _SLIP_COST[gone - 2]
                    if cost < least or (cost == least and p < source):
                        least, source = cost, p
            cost = dark[k - 1] + (_HIDE_AT_END_COST if before <= room else _HIDE_INSIDE_COST)
            if cost < least:
                fits, a = True, seen_at[k - 1]
                if a >= 0:
                    j = abs(seen_as[k - 1]) - 1
                    dx, dy = samples[i, 0] - samples[j, 0], samples[i, 1] - samples[j, 1]
                    hidden = (k - a) * spacing
                    fits = math.sqrt(dx * dx + dy * dy) <= _MAX_BRIDGE * hidden + slack
                    dx -= nodes[k, 0] - nodes[a, 0]
                    dy -= nodes[k, 1] - nodes[a, 1]
                    fits &= math.sqrt(dx * dx + dy * dy) <= _MAX_BRIDGE_CHANGE * hidden + slack
                    # Nothing is seen twice.
                    fits &= part[i] != part[j] or way * seen_as[k - 1] < 0 or way * (i - j) > 0
                if fits:
                    least, source = cost, -1
            for p in range(size[k - 1] if cheapest + _SWITCH_COST <= least else 0):
                cost = value[k - 1, p] + _SWITCH_COST
                if cost > least or value[k - 1, p] > most or (cost == least and 0 <= source <= p):
                    continue
                other = found[k - 1, p]
                j = abs(other) - 1
                if part[i] == part[j] and way * other > 0 and 2 <= way * (i - j) <= 6:
                    continue
                dx, dy = samples[i, 0] - samples[j, 0], samples[i, 1] - samples[j, 1]
                far = dx * dx + dy * dy
                ahead = dx * heading[k, 0] + dy * heading[k, 1]
                if far <= (1.75 * spacing) ** 2 and ahead >= 0.2 * spacing:
                    least, source = cost, p
            value[k, c], back[k, c] = least + price[k, c], source
        for p in range(size[k - 1]):
            place[abs(found[k - 1, p]) - 1] = -1
        dark[k], seen_at[k], seen_as[k] = dark[k - 1] + unseen[k], seen_at[k - 1], seen_as[k - 1]
        for p in range(size[k - 1]):
            i = abs(found[k - 1, p]) - 1
            first, last = bounds[part[i], 0], bounds[part[i], 1]
            after = last - i if found[k - 1, p] > 0 else i - first
            cost = value[k - 1, p] + (_HIDE_AT_END_COST if after <= room else _HIDE_INSIDE_COST) + unseen[k]
            if cost < dark[k]:
                dark[k], dark_back[k], seen_at[k], seen_as[k] = cost, p, k - 1, found[k - 1, p]
    state, least = -1, dark[count - 1]
    for c in range(size[count - 1]):
        i = abs(found[count - 1, c]) - 1
        first, last = bounds[part[i], 0], bounds[part[i], 1]
        after = last - i if found[count - 1, c] > 0 else i - first
        cost = value[count - 1, c] + (_HIDE_AT_END_COST if after <= room else _HIDE_INSIDE_COST)
        if cost < least:
            state, least = c, cost
    total, seen = 0.0, 0
    for k in range(count - 1, -1, -1):
        if state < 0:
            at[k] = 0
            state = dark_back[k]
        else:
            at[k] = found[k, state]
            total += price[k, state]
            seen += 1
            state = back[k, state]
    return total / seen if seen else math.inf


@kernel(read(float64, 2), write(float64, 2))
def interpolate_evenly(samples: npt.NDArray[np.float64], nodes: npt.NDArray[np.float64]) -> None:
    """Write what lies between samples, at evenly spaced places from the first to the last.

    Parameters
    ----------
    samples : (m, d) float64
        Evenly spaced; two or more.
    nodes : (k, d) float64
        Written; two or more.
    """
    last, count = len(samples) - 1, len(nodes)
    gap, step, i = 1.0 / last, 1.0 / (count - 1), 0
    for k in range(count):
        u = k * step if k < count - 1 else 1.0
        while i < last - 1 and (i + 1) * gap <= u:
            i += 1
        low, high = i * gap, (i + 1) * gap if i + 1 < last else 1.0
        for d in range(nodes.shape[1]):
            if u >= 1.0:
                nodes[k, d] = samples[last, d]
            else:
                nodes[k, d] = (samples[i + 1, d] - samples[i, d]) / (high - low) * (u - low) + samples[i, d]


@kernel(read(int64, 1), read(int64, 1), int64, write(int64, 2))
def find_intervals(
    at: npt.NDArray[np.int64], part: npt.NDArray[np.int64], fewest: int, runs: npt.NDArray[np.int64]
) -> int:
    """Find what of a way goes on along one curve in one direction, without a gap or a leap.

    Parameters
    ----------
    at : (k,) int64
        As `find_route` writes it.
    part : (n,) int64
        Curve that each sample is of.
    fewest : int
        Nodes of a run.
    runs : (k, 6) int64
        Written: the curve, the first and the last sample, the first and the last node, and twice the median over all
        nodes of where sample 0 would lie along the nodes, in samples.

    Returns
    -------
    int
        How many there are.
    """
    count, node = 0, 0
    while node < len(at):
        if at[node] == 0:
            node += 1
            continue
        first, way = node, 0
        start = end = abs(at[node]) - 1
        node += 1
        while node < len(at) and at[node] != 0:
            i, sign = abs(at[node]) - 1, 1 if at[node] > 0 else -1
            if part[i] != part[start] or way not in (0, sign) or not 0 < (i - end) * sign <= _MAX_STEP:
                break
            end, way = i, sign
            node += 1
        if node - first < fewest:
            continue
        way = 1 if end >= start else -1
        origins = np.empty(node - first, dtype=np.int64)
        for k in range(first, node):
            origins[k - first] = SAMPLES_PER_NODE * k - way * (abs(at[k]) - 1)
        origins.sort()
        middle = origins[(node - first) // 2] + origins[(node - first - 1) // 2]
        runs[count, 0], runs[count, 1], runs[count, 2] = part[start], start, end
        runs[count, 3], runs[count, 4], runs[count, 5] = first, node - 1, middle
        count += 1
    return count
