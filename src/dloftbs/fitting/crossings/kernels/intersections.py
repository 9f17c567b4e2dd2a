"""Intersections of curves with each other and themselves: chords are tested where their boxes meet."""

from __future__ import annotations

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.copying import longer_rows
from dloftbs.kernels.shared.cubic import point_and_slope
from dloftbs.kernels.shared.polyline import polyline_length

_CHUNK = 8
"""Number of chords that share a bounding box.

Source: bounds time.
"""


@kernel(read(float64, 1), read(float64, 2), read(int64, 1), read(float64, 1), int64)
def flatten(knots: Floats, control: Floats, counts: Ints, chords_px: Floats, most: int) -> tuple[Floats, Floats, Ints]:
    """Turn cubic curves in the image into chords at evenly spaced ``u``.

    Not checked: the knots fit the control points and span 0 to 1.

    Parameters
    ----------
    knots : (k,) float64
        All curves' knots, curve after curve.
    control : (n, 2) float64
        All curves' control points, px.
    counts : (c,) int64
        Number of control points of each curve.
    chords_px : (c,) float64
        Length that the chords of each curve should not exceed, on average.
    most : int
        Number of chords that no curve exceeds, however long it is.

    Returns
    -------
    points : (m, 2) float64
        Curve after curve, both ends of each included.
    u : (m,) float64
        The curve's parameter.
    first : (c + 1,) int64
        Start of each curve in these, and the end.
    """
    n_curves = len(counts)
    first = np.zeros(n_curves + 1, dtype=np.int64)
    start = 0
    for c in range(n_curves):
        length = polyline_length(control[start : start + counts[c]])
        chords = int(min(max(np.ceil(length / chords_px[c]), float(_CHUNK)), float(most)))
        first[c + 1] = first[c] + chords + 1
        start += counts[c]
    points = np.empty((first[n_curves], 2))
    u = np.empty(first[n_curves])
    knot, start = 0, 0
    for c in range(n_curves):
        own_knots = knots[knot : knot + counts[c] + 4]
        own_control = control[start : start + counts[c]]
        span = 3
        n = first[c + 1] - first[c]
        for i in range(n):
            p = first[c] + i
            u[p] = i / (n - 1)
            while span < counts[c] - 1 and u[p] >= own_knots[span + 1]:
                span += 1
            points[p, 0], points[p, 1], _, _ = point_and_slope(own_knots, own_control, span, u[p])
        knot += counts[c] + 4
        start += counts[c]
    return points, u, first


@kernel(read(float64, 2), read(int64, 1))
def measure_arcs(points: Floats, first: Ints) -> Floats:
    """Return the distance of each vertex of flattened curves from the start of its curve along the chords, px.

    Parameters
    ----------
    points, first
        As `flatten` returns them.

    Returns
    -------
    (m,) float64
    """
    arc = np.empty(len(points))
    for c in range(len(first) - 1):
        arc[first[c]] = 0.0
        for p in range(first[c] + 1, first[c + 1]):
            arc[p] = arc[p - 1] + np.hypot(points[p, 0] - points[p - 1, 0], points[p, 1] - points[p - 1, 1])
    return arc


@helper
def _bound(points: Floats, low: int, high: int, boxes: Floats, k: int) -> None:
    """Write the box (x0, y0, x1, y1) of the points ``low..high - 1``."""
    x0 = x1 = points[low, 0]
    y0 = y1 = points[low, 1]
    for i in range(low + 1, high):
        x, y = points[i, 0], points[i, 1]
        x0, x1 = min(x0, x), max(x1, x)
        y0, y1 = min(y0, y), max(y1, y)
    boxes[k, 0], boxes[k, 1], boxes[k, 2], boxes[k, 3] = x0, y0, x1, y1


@helper
def _apart(a: Floats, i: int, b: Floats, j: int) -> bool:
    """Return whether box `i` of the one array and box `j` of the other have nothing in common."""
    return a[i, 0] > b[j, 2] or b[j, 0] > a[i, 2] or a[i, 1] > b[j, 3] or b[j, 1] > a[i, 3]


@helper
def _runs_on(points: Floats, low: int, high: int) -> bool:
    """Return whether all chords from `low` to `high` go the same way as the whole, so that none meets another."""
    dx, dy = points[high, 0] - points[low, 0], points[high, 1] - points[low, 1]
    for i in range(low, high):
        if not (points[i + 1, 0] - points[i, 0]) * dx + (points[i + 1, 1] - points[i, 1]) * dy > 0.0:
            return False
    return True


@helper
def _side(dx: float, dy: float, px: float, py: float, sign: float) -> bool:
    """Return on which side of the direction (dx, dy) a point lies, seen from the direction's start.

    What lies on the line is decided as if the second chord were shifted by an infinitely small (e, e^2), so that curves
    that share points or whole chords cross as often as curves right beside them; `sign` is 1 for points of the second
    chord, -1 for those of the first.
    """
    cross = dx * py - dy * px
    if cross == 0.0:
        cross = -sign * dy if dy != 0.0 else sign * dx
    return cross > 0.0


@helper
def _meet(points: Floats, i: int, j: int, shares: Floats) -> bool:
    """Return whether chord `i` crosses chord `j`, and write how far along each."""
    ax, ay, bx, by = points[i, 0], points[i, 1], points[j, 0], points[j, 1]
    cx, cy, dx, dy = points[i + 1, 0], points[i + 1, 1], points[j + 1, 0], points[j + 1, 1]
    if max(ax, cx) < min(bx, dx) or max(bx, dx) < min(ax, cx):
        return False
    if max(ay, cy) < min(by, dy) or max(by, dy) < min(ay, cy):
        return False
    px, py, qx, qy = cx - ax, cy - ay, dx - bx, dy - by
    if _side(px, py, bx - ax, by - ay, 1.0) == _side(px, py, dx - ax, dy - ay, 1.0):
        return False
    if _side(qx, qy, ax - bx, ay - by, -1.0) == _side(qx, qy, cx - bx, cy - by, -1.0):
        return False
    cross = px * qy - py * qx
    shares[0] = shares[1] = 0.5
    if cross != 0.0:
        shares[0] = min(max(((bx - ax) * qy - (by - ay) * qx) / cross, 0.0), 1.0)
        shares[1] = min(max(((bx - ax) * py - (by - ay) * px) / cross, 0.0), 1.0)
    return True


@helper
def _meets_box(points: Floats, i: int, boxes: Floats, k: int) -> bool:
    """Return whether the box of chord `i` and box `k` have anything in common."""
    ax, ay, bx, by = points[i, 0], points[i, 1], points[i + 1, 0], points[i + 1, 1]
    if (ax < boxes[k, 0] and bx < boxes[k, 0]) or (ax > boxes[k, 2] and bx > boxes[k, 2]):
        return False
    return not ((ay < boxes[k, 1] and by < boxes[k, 1]) or (ay > boxes[k, 3] and by > boxes[k, 3]))


@helper
def _cut(points: Floats, first: Ints) -> tuple[Ints, Ints, Floats, Floats]:
    """Cut curves into chunks of chords.

    Returns where each curve's chunks start, and the end; the first chord of each chunk and the end of its chords; the
    boxes of the chunks; and those of the curves.
    """
    n_curves = len(first) - 1
    starts = np.zeros(n_curves + 1, dtype=np.int64)
    for c in range(n_curves):
        starts[c + 1] = starts[c] + (first[c + 1] - first[c] - 2) // _CHUNK + 1
    spans = np.empty((starts[n_curves], 2), dtype=np.int64)
    boxes = np.empty((starts[n_curves], 4))
    whole = np.empty((n_curves, 4))
    for c in range(n_curves):
        _bound(points, first[c], first[c + 1], whole, c)
        for k in range(starts[c], starts[c + 1]):
            spans[k, 0] = first[c] + (k - starts[c]) * _CHUNK
            spans[k, 1] = min(spans[k, 0] + _CHUNK, first[c + 1] - 1)
            _bound(points, spans[k, 0], spans[k, 1] + 1, boxes, k)
    return starts, spans, boxes, whole


@helper
def _near_chunks(points: Floats, starts: Ints, spans: Ints, boxes: Floats, whole: Floats) -> Ints:
    """Return the pairs of chunks that may meet, (m, 2); those of the same two curves together."""
    pairs = np.empty((64, 2), dtype=np.int64)
    count = 0
    for a in range(len(whole)):
        for b in range(a, len(whole)):
            if _apart(whole, a, whole, b):
                continue
            for k in range(starts[a], starts[a + 1]):
                if _apart(boxes, k, whole, b):
                    continue
                for m in range(k if a == b else starts[b], starts[b + 1]):
                    if _apart(boxes, k, boxes, m):
                        continue
                    if a == b and m <= k + 1 and _runs_on(points, spans[k, 0], spans[m, 1]):
                        continue
                    if count == len(pairs):
                        pairs = longer_rows(pairs)
                    pairs[count, 0], pairs[count, 1] = k, m
                    count += 1
    return pairs[:count]


@kernel(read(float64, 2), read(int64, 1))
def intersect(points: Floats, first: Ints) -> tuple[Ints, Floats]:
    """Find where chords cross; neighbouring ones of a curve do not.

    Parameters
    ----------
    points, first
        As `flatten` returns them.

    Returns
    -------
    chords : (m, 2) int64
        The two chords, by the index of their first point, the lower one first; those of the same two curves together.
    shares : (m, 2) float64
        Place along each of them, 0 to 1.
    """
    chords = np.empty((16, 2), dtype=np.int64)
    shares = np.empty((16, 2))
    place = np.empty(2)
    count = 0
    starts, spans, boxes, whole = _cut(points, first)
    pairs = _near_chunks(points, starts, spans, boxes, whole)
    for p in range(len(pairs)):
        k, m = pairs[p]
        for i in range(spans[k, 0], spans[k, 1]):
            if not _meets_box(points, i, boxes, m):
                continue
            for j in range(max(spans[m, 0], i + 2), spans[m, 1]):
                if not _meet(points, i, j, place):
                    continue
                if count == len(chords):
                    chords = longer_rows(chords)
                    shares = longer_rows(shares)
                chords[count, 0], chords[count, 1] = i, j
                shares[count, 0], shares[count, 1] = place[0], place[1]
                count += 1
    return chords[:count], shares[:count]
