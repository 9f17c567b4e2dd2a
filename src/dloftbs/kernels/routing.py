"""The way of a remembered curve through what one frame shows: point by point, seen somewhere or hidden."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float64, int64

from dloftbs.kernels._compile import helper, kernel, read, write

STEPS = 4
"""Samples of a frame's curves from one node of the remembered one to the next."""

_MOST = 64  # samples near a node that are looked at: the cheapest
_COS = 0.5  # of the angle between a node's heading and a sample's, at least
_ALONG = 0.25  # of a distance along the curve counts: how far a cable has slid is known the least
_TURNED = 1.0  # price of a right angle between the headings, by that of being out of reach
_SLIP = (0.6, 0.15, 0.0, 0.15, 0.6)  # prices of going on by 2 to 6 samples from node to node
_SWITCH = 2.0  # price of going on along another curve
_LEAVE, _BREAK = 0.3, 3.0  # of being hidden from where a curve ends on, and from anywhere else
_LONGER, _BENT = 1.15, 0.5  # how far the ends of what is hidden may lie apart, and from where they were, by its length
_FAR_COST = 8.0  # what costs so much more than the cheapest state of a node is not followed


@helper
def _directions(points: npt.NDArray[np.float64], part: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
    """Return the unit tangents (n, 2) along curves that lie one after the other; `part` is each sample's curve."""
    n = len(points)
    result = np.zeros((n, 2))
    for i in range(n):
        before = i - 1 if i > 0 and part[i - 1] == part[i] else i
        after = i + 1 if i + 1 < n and part[i + 1] == part[i] else i
        x, y = points[after, 0] - points[before, 0], points[after, 1] - points[before, 1]
        size = math.sqrt(x * x + y * y)
        if size > 0.0:
            result[i, 0], result[i, 1] = x / size, y / size
    return result


@helper
def _near(
    x: float,
    y: float,
    heading: npt.NDArray[np.float64],
    reach: float,
    step: float,
    samples: npt.NDArray[np.float64],
    tangents: npt.NDArray[np.float64],
    part: npt.NDArray[np.int64],
    bounds: npt.NDArray[np.int64],
    extra: npt.NDArray[np.float64],
    found: npt.NDArray[np.int64],
    price: npt.NDArray[np.float64],
) -> int:
    """Write the samples that a node may be, negative where it runs backwards, and their prices; return how many."""
    n, count, i = len(samples), 0, 0
    while i < n:
        dx, dy = samples[i, 0] - x, samples[i, 1] - y
        far = math.sqrt(dx * dx + dy * dy)
        if far > reach:
            i = min(i + max(1, int((far - reach) / step)), bounds[part[i], 1] + 1)  # samples lie a step apart at most
            continue
        cosine = tangents[i, 0] * heading[0] + tangents[i, 1] * heading[1]
        if abs(cosine) >= _COS:
            along = dx * heading[0] + dy * heading[1]
            squared = dx * dx + dy * dy - (1.0 - _ALONG) * along * along
            cost = squared / (reach * reach) + _TURNED * (1.0 - abs(cosine)) + extra[i]
            at = count if count < _MOST else int(np.argmax(price))
            if count < _MOST or cost < price[at]:
                found[at] = i + 1 if cosine > 0.0 else -(i + 1)
                price[at] = cost
                count = min(count + 1, _MOST)
        i += 1
    return count


@kernel(
    read(float64, 2),
    read(float64, 1),
    read(float64, 1),
    read(float64, 2),
    read(int64, 1),
    read(int64, 2),
    read(float64, 1),
    float64,
    float64,
    write(int64, 1),
)
def route(
    nodes: npt.NDArray[np.float64],
    reach: npt.NDArray[np.float64],
    unseen: npt.NDArray[np.float64],
    samples: npt.NDArray[np.float64],
    part: npt.NDArray[np.int64],
    bounds: npt.NDArray[np.int64],
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
        Where the remembered curve is expected, evenly spaced; two or more.
    reach : (k,) float64
        How far from each it may be.
    unseen : (k,) float64
        Price of each being hidden; a sample at the limit of its reach costs 1.
    samples : (n, 2) float64
        Along the frame's curves, one after the other, `STEPS` times as dense as the nodes.
    part : (n,) int64
        Which curve each is of: 0, 1, ...
    bounds : (p, 2) int64
        First and last sample of each curve.
    extra : (n,) float64
        Added to the price of each.
    spacing : float
        From node to node.
    slack : float
        What is nearer than this to the end of a curve is at it.
    at : (k,) int64
        Written: one more than the index of the sample that the node is, negative where the curve runs the other way,
        0 where it is hidden.

    Returns
    -------
    float
        The mean price of the nodes that are seen; infinite where none is.
    """
    count = len(nodes)
    order = np.zeros(count, dtype=np.int64)
    headings = _directions(nodes, order)
    tangents = _directions(samples, part)
    step = spacing / STEPS
    room = int(slack / step)
    found = np.zeros((count, _MOST), dtype=np.int64)
    price = np.zeros((count, _MOST))
    value = np.full((count, _MOST), math.inf)
    back = np.full((count, _MOST), -1, dtype=np.int64)  # -1: hidden before
    size = np.zeros(count, dtype=np.int64)
    dark = np.empty(count)  # the cheapest way that is hidden at a node, where it comes from, and where it was seen
    dark_back = np.full(count, -1, dtype=np.int64)
    seen_at = np.full(count, -1, dtype=np.int64)
    seen_as = np.zeros(count, dtype=np.int64)
    longest = step  # from sample to sample: a short curve's nodes are denser
    for i in range(1, len(samples)):
        if part[i] == part[i - 1]:
            longest = max(longest, math.hypot(samples[i, 0] - samples[i - 1, 0], samples[i, 1] - samples[i - 1, 1]))
    for k in range(count):
        x, y = nodes[k, 0], nodes[k, 1]
        size[k] = _near(
            x, y, headings[k], reach[k], longest, samples, tangents, part, bounds, extra, found[k], price[k]
        )
    for c in range(size[0]):
        i = abs(found[0, c]) - 1
        first, last = bounds[part[i], 0], bounds[part[i], 1]
        before = i - first if found[0, c] > 0 else last - i
        value[0, c] = price[0, c] + (_LEAVE if before <= room else _BREAK)
    dark[0] = unseen[0]
    for k in range(1, count):
        best = dark[k - 1]
        for p in range(size[k - 1]):
            best = min(best, value[k - 1, p])
        for c in range(size[k]):
            signed = found[k, c]
            i = abs(signed) - 1
            way = 1 if signed > 0 else -1
            first, last = bounds[part[i], 0], bounds[part[i], 1]
            before = i - first if way > 0 else last - i
            for p in range(size[k - 1]):
                cost = value[k - 1, p]
                if cost > best + _FAR_COST or cost >= value[k, c]:
                    continue
                other = found[k - 1, p]
                j = abs(other) - 1
                gone = way * (i - j)
                if part[i] == part[j] and way * other > 0 and 2 <= gone <= 6:
                    cost += _SLIP[gone - 2]
                else:
                    dx, dy = samples[i, 0] - samples[j, 0], samples[i, 1] - samples[j, 1]
                    far = dx * dx + dy * dy
                    ahead = dx * headings[k, 0] + dy * headings[k, 1]
                    if far > (1.75 * spacing) ** 2 or ahead < 0.2 * spacing:
                        continue
                    cost += _SWITCH
                if cost < value[k, c]:
                    value[k, c], back[k, c] = cost, p
            cost = dark[k - 1] + (_LEAVE if before <= room else _BREAK)
            if cost < value[k, c]:
                fits, a = True, seen_at[k - 1]
                if a >= 0:
                    j = abs(seen_as[k - 1]) - 1
                    dx, dy = samples[i, 0] - samples[j, 0], samples[i, 1] - samples[j, 1]
                    hidden = (k - a) * spacing
                    fits = math.sqrt(dx * dx + dy * dy) <= _LONGER * hidden + slack
                    dx -= nodes[k, 0] - nodes[a, 0]
                    dy -= nodes[k, 1] - nodes[a, 1]
                    fits &= math.sqrt(dx * dx + dy * dy) <= _BENT * hidden + slack
                    # Nothing is seen twice.
                    fits &= part[i] != part[j] or way * seen_as[k - 1] < 0 or way * (i - j) > 0
                if fits:
                    value[k, c], back[k, c] = cost, -1
            value[k, c] += price[k, c]
        dark[k], seen_at[k], seen_as[k] = dark[k - 1] + unseen[k], seen_at[k - 1], seen_as[k - 1]
        for p in range(size[k - 1]):
            i = abs(found[k - 1, p]) - 1
            first, last = bounds[part[i], 0], bounds[part[i], 1]
            after = last - i if found[k - 1, p] > 0 else i - first
            cost = value[k - 1, p] + (_LEAVE if after <= room else _BREAK) + unseen[k]
            if cost < dark[k]:
                dark[k], dark_back[k], seen_at[k], seen_as[k] = cost, p, k - 1, found[k - 1, p]
    state, least = -1, dark[count - 1]
    for c in range(size[count - 1]):
        i = abs(found[count - 1, c]) - 1
        first, last = bounds[part[i], 0], bounds[part[i], 1]
        after = last - i if found[count - 1, c] > 0 else i - first
        cost = value[count - 1, c] + (_LEAVE if after <= room else _BREAK)
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
