"""Curves that were seen before, sampled, and which pairs of ends continue each other along them."""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import Bools, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.cubic import basis_functions
from dloftbs.kernels.shared.graph_ends import TANGENT_X, TANGENT_Y, X, Y
from dloftbs.kernels.shared.polyline import polyline_length

_NEAR_WIDTHS = 1.5  # farther from a curve, an end has nothing to do with it
_ALONG = 0.6  # least cosine between an end and the curve
_AHEAD_CHORDS, _AHEAD_WIDTHS = 1.6, 2.0  # a joint follows the curve for no longer
_MIN_SAMPLES = 8
_MAX_CELLS = 64  # to a side


@helper
def _along(points: Floats, start: int, stop: int, k: int) -> tuple[float, float]:
    """Return the way from the sample before one of a curve to that after it, as far as there are any."""
    low, high = max(k - 1, start), min(k + 1, stop - 1)
    return points[high, 0] - points[low, 0], points[high, 1] - points[low, 1]


@kernel(
    read(float64, 1), read(float64, 2), read(int64, 1), read(boolean, 1),
    read(float64, 2), read(float64, 1), float64, int64,
)  # fmt: skip
def sample_curves(
    knots: Floats,
    control: Floats,
    counts: Ints,
    closed: Bools,
    matrix: Floats,
    offset: Floats,
    step_px: float,
    most: int,
) -> tuple[Floats, Ints, Floats, Floats]:
    """Sample cubic curves in the image at evenly spaced ``u``, both ends included, in the orientation of a crop.

    Not checked: the knots fit the control points and span 0 to 1.

    Parameters
    ----------
    knots : (k,) float64
        All curves' knots, curve after curve.
    control : (n, 2) float64
        All curves' control points, px.
    counts : (c,) int64
        Number of control points of each curve.
    closed : (c,) bool
    matrix, offset : (2, 2), (2,) float64
        From the crop to the image, ``matrix @ p + offset``: a signed permutation.
    step_px : float
        From sample to sample, about.
    most : int
        Samples of a curve at most.

    Returns
    -------
    points : (m, 2) float64
        In the orientation of the crop.
    first : (c + 1,) int64
        Start of each curve's samples, and the end.
    steps, longest : (c,) float64
        From sample to sample, on average and at most, px.
    """
    n_curves = len(counts)
    first = np.zeros(n_curves + 1, dtype=np.int64)
    start = 0
    for c in range(n_curves):
        about = polyline_length(control[start : start + counts[c]])  # somewhat longer than the curve, and at hand
        count = min(max(np.ceil(about / step_px), float(_MIN_SAMPLES)), float(most))
        first[c + 1] = first[c] + int(count)
        start += counts[c]
    points = np.empty((first[n_curves], 2))
    steps, longest = np.empty(n_curves), np.zeros(n_curves)
    xx, xy, yx, yy = matrix[0, 0], matrix[0, 1], matrix[1, 0], matrix[1, 1]
    knot, start = 0, 0
    for c in range(n_curves):
        own_knots, own_control = knots[knot : knot + counts[c] + 4], control[start : start + counts[c]]
        own = points[first[c] : first[c + 1]]
        count, span = len(own), 3
        for i in range(count):
            u = i * (1.0 / (count - 1)) if i < count - 1 else 1.0
            if closed[c] and u == 1.0:
                u, span = 0.0, 3
            while span < counts[c] - 1 and u >= own_knots[span + 1]:
                span += 1
            basis = basis_functions(own_knots, span, u)
            x, y = 0.0, 0.0
            for k in range(4):
                x += own_control[span - 3 + k, 0] * basis[k]
                y += own_control[span - 3 + k, 1] * basis[k]
            x, y = x - offset[0], y - offset[1]
            own[i, 0], own[i, 1] = x * xx + y * yx, x * xy + y * yy
        total = 0.0
        for i in range(count):
            dx, dy = _along(own, 0, count, i)
            total += np.sqrt(dx * dx + dy * dy)
            if i > 0:
                dx, dy = own[i, 0] - own[i - 1, 0], own[i, 1] - own[i - 1, 1]
                longest[c] = max(longest[c], dx * dx + dy * dy)
        longest[c] = max(np.sqrt(longest[c]), 1e-9)
        steps[c] = total / (2 * (count - 1))
        knot += counts[c] + 4
        start += counts[c]
    return points, first, steps, longest


@helper
def _lay_grid(states: Floats, used: Bools, near: float) -> tuple[float, float, float, int, int, Ints, Ints]:
    """Sort ends into square cells no smaller than `near`, each into its own and the eight around it.

    Returns
    -------
    x0, y0, cell : float
        Corner of the first cell, and the side of all.
    columns, rows : int
    first : (columns * rows + 1,) int64
        Start of each cell's ends in the list, row by row.
    ends : (m,) int64
        Ascending in each cell.
    """
    x0 = y0 = np.inf
    x1 = y1 = -np.inf
    for end in range(len(states)):
        if used[end]:
            x0, x1 = min(x0, states[end, X]), max(x1, states[end, X])
            y0, y1 = min(y0, states[end, Y]), max(y1, states[end, Y])
    cell = max(near, max(x1 - x0, y1 - y0) / _MAX_CELLS)
    columns, rows = int((x1 - x0) / cell) + 3, int((y1 - y0) / cell) + 3
    x0, y0 = x0 - cell, y0 - cell
    first = np.zeros(columns * rows + 1, dtype=np.int64)
    ends = np.empty(0, dtype=np.int64)
    for turn in range(2):
        for end in range(len(states) - 1, -1, -1):
            if not used[end]:
                continue
            column, row = int((states[end, X] - x0) / cell), int((states[end, Y] - y0) / cell)
            for r in range(max(row - 1, 0), min(row + 2, rows)):
                for c in range(max(column - 1, 0), min(column + 2, columns)):
                    if turn == 0:
                        first[r * columns + c] += 1
                    else:
                        first[r * columns + c] -= 1
                        ends[first[r * columns + c]] = end
        if turn == 0:
            for k in range(columns * rows):
                first[k + 1] += first[k]
            ends = np.empty(first[columns * rows], dtype=np.int64)
    return x0, y0, cell, columns, rows, first, ends


@kernel(
    read(float64, 2), read(int64, 1), read(int64, 1), read(float64, 2), read(int64, 1),
    read(float64, 1), read(float64, 1), read(boolean, 1), read(float64, 1), float64,
)  # fmt: skip
def follow(
    states: Floats,
    rows: Ints,
    columns: Ints,
    points: Floats,
    first: Ints,
    steps: Floats,
    longest: Floats,
    closed: Bools,
    trust: Floats,
    width: float,
) -> Floats:
    """Return how well pairs of ends continue each other along one of several curves.

    Parameters
    ----------
    states : (n, 6) float64
        As `branch_ends.describe_ends` makes them.
    rows, columns : (k,) int64
        The pairs; one or more.
    points : (m, 2) float64
        Samples of all curves, one curve after the other, evenly spaced.
    first : (c + 1,) int64
        Start of each curve's samples.
    steps, longest : (c,) float64
        From sample to sample, on average and at most, px.
    closed : (c,) bool
    trust : (c,) float64
        In 0..1.
    width : float
        Of the cables, px.

    Returns
    -------
    (k,) float64
        From 0, not at all, to the curve's trust.
    """
    n, pairs, near = len(states), len(rows), _NEAR_WIDTHS * width
    result = np.zeros(pairs)
    used = np.zeros(n, dtype=np.bool_)
    for k in range(pairs):
        used[rows[k]] = used[columns[k]] = True
    x0, y0, side, across, down, cells, ends = _lay_grid(states, used, near)
    # Where on a curve each end lies, pointing onwards (0) and backwards (1), and how well, 0 where it does not.
    at = np.zeros((n, 2), dtype=np.int64)
    fit = np.zeros((n, 2))
    x1, y1 = x0 + across * side, y0 + down * side
    for c in range(len(steps)):
        count, found = first[c + 1] - first[c], False
        k = first[c] - 1
        while k < first[c + 1] - 1:
            k += 1
            beside = max(x0 - points[k, 0], points[k, 0] - x1, y0 - points[k, 1], points[k, 1] - y1)
            if beside > 0.0:
                # So many samples it takes at least to come back; as floats, since there is no integer for infinity.
                k += int(min(beside / longest[c], float(count)))
                continue
            column, row = np.floor((points[k, 0] - x0) / side), np.floor((points[k, 1] - y0) / side)
            if not (0.0 <= column < across and 0.0 <= row < down):
                continue
            cell = int(row) * across + int(column)
            if cells[cell] == cells[cell + 1]:
                continue
            tx, ty = _along(points, first[c], first[c + 1], k)
            length = max(np.hypot(tx, ty), 1e-9)
            tx, ty = tx / length, ty / length
            for entry in range(cells[cell], cells[cell + 1]):
                end = ends[entry]
                dx, dy = points[k, 0] - states[end, X], points[k, 1] - states[end, Y]
                if abs(dx) >= near or abs(dy) >= near:
                    continue
                along = states[end, TANGENT_X] * tx + states[end, TANGENT_Y] * ty
                if abs(along) < _ALONG:
                    continue
                value = (1.0 - np.sqrt(dx * dx + dy * dy) / near) * abs(along)
                way = 0 if along > 0.0 else 1
                if value > fit[end, way]:
                    fit[end, way], at[end, way] = value, k
                    found = True
        if not found:
            continue
        for k in range(pairs):
            i, j = rows[k], columns[k]
            for way in range(2):
                # One end points along the curve, the other against it, and lies ahead of it.
                value = min(fit[i, way], fit[j, 1 - way])
                if not value > 0.0:
                    continue
                chord = np.sqrt((states[i, X] - states[j, X]) ** 2 + (states[i, Y] - states[j, Y]) ** 2)
                most = _AHEAD_CHORDS * chord + _AHEAD_WIDTHS * width
                ahead = at[j, 1 - way] - at[i, way] if way == 0 else at[i, way] - at[j, 1 - way]
                if closed[c] and ahead < -count // 2:
                    ahead += count
                length = ahead * steps[c]
                if -width <= length <= most:
                    result[k] = max(result[k], trust[c] * value)
        fit[:] = 0.0
    return result
