"""Curves that were seen before, sampled, and which pairs of ends continue each other along them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64

from dloftbs.kernels._compile import helper, kernel, read

_NEAR_WIDTHS = 1.5  # farther from a curve, an end has nothing to do with it
_ALONG = 0.6  # least cosine between an end and the curve
_AHEAD_CHORDS, _AHEAD_WIDTHS = 1.6, 2.0  # a joint follows the curve for no longer
_LEAST_SAMPLES = 8
_CHUNK = 16  # samples that share a box


@helper
def _evaluate_basis(
    knots: npt.NDArray[np.float64],
    span: int,
    u: float,
    degree: int,
    before: npt.NDArray[np.float64],
    values: npt.NDArray[np.float64],
) -> None:
    """Write the basis functions of one knot span, in the order of operations that scipy has, too."""
    values[0] = 1.0
    for j in range(1, degree + 1):
        for n in range(j):
            before[n] = values[n]
        values[0] = 0.0
        for n in range(1, j + 1):
            high, low = knots[span + n], knots[span + n - j]
            if high == low:
                values[n] = 0.0
                continue
            share = before[n - 1] / (high - low)
            values[n - 1] += share * (high - u)
            values[n] = share * (u - low)


@helper
def _sample(
    knots: npt.NDArray[np.float64],
    control: npt.NDArray[np.float64],
    degree: int,
    closed: bool,
    points: npt.NDArray[np.float64],
) -> None:
    """Write points of a curve at evenly spaced parameters from 0 to 1."""
    count, n = len(points), len(control)
    before, values = np.empty(degree + 1), np.empty(degree + 1)
    step = 1.0 / (count - 1)
    span = degree
    for i in range(count):
        u = i * step if i < count - 1 else 1.0
        if closed and u == 1.0:
            u, span = 0.0, degree
        while span < n - 1 and u >= knots[span + 1]:
            span += 1
        _evaluate_basis(knots, span, u, degree, before, values)
        for axis in range(2):
            value = 0.0
            for a in range(degree + 1):
                value += control[span - degree + a, axis] * values[a]
            points[i, axis] = value


@helper
def _direct(points: npt.NDArray[np.float64], tangents: npt.NDArray[np.float64]) -> float:
    """Write the directions of a series of points, of length 1, and return the mean way from point to point."""
    count = len(points)
    inner, ends = 0.0, 0.0
    for i in range(count):
        low, high = max(i - 1, 0), min(i + 1, count - 1)
        dx, dy = points[high, 0] - points[low, 0], points[high, 1] - points[low, 1]
        length = np.hypot(dx, dy)
        if 0 < i < count - 1:
            inner += length
        else:
            ends += length
        length = max(length, 1e-9)
        tangents[i, 0], tangents[i, 1] = dx / length, dy / length
    return float((inner + ends) / (2 * (count - 1)))


@kernel(
    read(float64, 1), read(float64, 2), read(int64, 1), read(int64, 1), read(boolean, 1),
    read(float64, 2), read(float64, 1), float64, int64,
)  # fmt: skip
def sample_curves(
    knots: npt.NDArray[np.float64],
    control: npt.NDArray[np.float64],
    counts: npt.NDArray[np.int64],
    degrees: npt.NDArray[np.int64],
    closed: npt.NDArray[np.bool_],
    matrix: npt.NDArray[np.float64],
    offset: npt.NDArray[np.float64],
    step_px: float,
    most: int,
) -> tuple[
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.int64],
    npt.NDArray[np.float64],
]:
    """Sample curves in the image at evenly spaced ``u``, both ends included, and turn the samples into a pose.

    Not checked: the knots fit the control points and span 0 to 1.

    Parameters
    ----------
    knots : (k,) float64
        All curves' knots, curve after curve.
    control : (n, 2) float64
        All curves' control points, px.
    counts, degrees : (c,) int64
        Number of control points and degree of each curve.
    closed : (c,) bool
    matrix, offset : (2, 2), (2,) float64
        From the pose to the image, ``matrix @ p + offset``: a signed permutation.
    step_px : float
        From sample to sample, about.
    most : int
        Samples of a curve at most.

    Returns
    -------
    points, tangents : (m, 2) float64
        In the pose; tangents have length 1.
    first : (c + 1,) int64
        Where the samples of each curve start, and the end.
    steps : (c,) float64
        From sample to sample, px.
    """
    n_curves = len(counts)
    first = np.zeros(n_curves + 1, dtype=np.int64)
    start = 0
    for c in range(n_curves):
        about = 0.0  # the polygon of the control points is somewhat longer than the curve, and at hand
        for i in range(start + 1, start + counts[c]):
            about += np.hypot(control[i, 0] - control[i - 1, 0], control[i, 1] - control[i - 1, 1])
        count = min(max(np.ceil(about / step_px), float(_LEAST_SAMPLES)), float(most))
        first[c + 1] = first[c] + int(count)
        start += counts[c]
    points, tangents = np.empty((first[n_curves], 2)), np.empty((first[n_curves], 2))
    steps = np.empty(n_curves)
    knot, start = 0, 0
    for c in range(n_curves):
        own = points[first[c] : first[c + 1]]
        own_knots = knots[knot : knot + counts[c] + degrees[c] + 1]
        _sample(own_knots, control[start : start + counts[c]], degrees[c], closed[c], own)
        for i in range(len(own)):
            x, y = own[i, 0] - offset[0], own[i, 1] - offset[1]
            own[i, 0], own[i, 1] = x * matrix[0, 0] + y * matrix[1, 0], x * matrix[0, 1] + y * matrix[1, 1]
        steps[c] = _direct(own, tangents[first[c] : first[c + 1]])
        knot += counts[c] + degrees[c] + 1
        start += counts[c]
    return points, tangents, first, steps


@helper
def _bound(points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the boxes (x0, y0, x1, y1) of chunks of points."""
    n = len(points)
    boxes = np.empty(((n + _CHUNK - 1) // _CHUNK, 4))
    for k in range(len(boxes)):
        x0 = y0 = np.inf
        x1 = y1 = -np.inf
        for i in range(k * _CHUNK, min((k + 1) * _CHUNK, n)):
            x0, x1 = min(x0, points[i, 0]), max(x1, points[i, 0])
            y0, y1 = min(y0, points[i, 1]), max(y1, points[i, 1])
        boxes[k, 0], boxes[k, 1], boxes[k, 2], boxes[k, 3] = x0, y0, x1, y1
    return boxes


@helper
def _place(
    arms: npt.NDArray[np.float64],
    end: int,
    points: npt.NDArray[np.float64],
    tangents: npt.NDArray[np.float64],
    boxes: npt.NDArray[np.float64],
    start: int,
    stop: int,
    near: float,
    at: npt.NDArray[np.int64],
    fit: npt.NDArray[np.float64],
) -> None:
    """Write where on a curve an end lies, pointing onwards (0) and backwards (1), and how well, 0 where it does not."""
    fit[0] = fit[1] = 0.0
    x, y, along_x, along_y = arms[end, 0], arms[end, 1], arms[end, 2], arms[end, 3]
    for chunk in range(start // _CHUNK, (stop - 1) // _CHUNK + 1):
        if boxes[chunk, 0] - x >= near or x - boxes[chunk, 2] >= near:
            continue
        if boxes[chunk, 1] - y >= near or y - boxes[chunk, 3] >= near:
            continue
        for k in range(max(chunk * _CHUNK, start), min((chunk + 1) * _CHUNK, stop)):
            dx, dy = points[k, 0] - x, points[k, 1] - y
            if abs(dx) >= near or abs(dy) >= near:
                continue
            along = along_x * tangents[k, 0] + along_y * tangents[k, 1]
            if abs(along) < _ALONG:
                continue
            value = (1.0 - np.sqrt(dx * dx + dy * dy) / near) * abs(along)
            way = 0 if along > 0.0 else 1
            if value > fit[way]:
                fit[way], at[way] = value, k


@kernel(
    read(float64, 2), read(int64, 1), read(int64, 1), read(float64, 2), read(float64, 2), read(int64, 1),
    read(float64, 1), read(boolean, 1), read(float64, 1), float64,
)  # fmt: skip
def follow(
    arms: npt.NDArray[np.float64],
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    points: npt.NDArray[np.float64],
    tangents: npt.NDArray[np.float64],
    first: npt.NDArray[np.int64],
    steps: npt.NDArray[np.float64],
    closed: npt.NDArray[np.bool_],
    trust: npt.NDArray[np.float64],
    width: float,
) -> npt.NDArray[np.float64]:
    """Return how well pairs of ends continue each other along one of several curves.

    Parameters
    ----------
    arms : (n, 6) float64
        As `arms.locate_arms` makes them.
    rows, columns : (k,) int64
        The pairs.
    points, tangents : (m, 2) float64
        Samples of all curves, one curve after the other, evenly spaced, and the directions there, of length 1.
    first : (c + 1,) int64
        Where the samples of each curve start.
    steps : (c,) float64
        From sample to sample, px.
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
    n, pairs = len(arms), len(rows)
    result = np.zeros(pairs)
    used = np.zeros(n, dtype=np.bool_)
    for k in range(pairs):
        used[rows[k]] = used[columns[k]] = True
    at = np.zeros((n, 2), dtype=np.int64)
    fit = np.zeros((n, 2))
    boxes, near = _bound(points), _NEAR_WIDTHS * width
    for c in range(len(steps)):
        count = first[c + 1] - first[c]
        for end in range(n):
            if used[end]:
                _place(arms, end, points, tangents, boxes, first[c], first[c + 1], near, at[end], fit[end])
        for k in range(pairs):
            i, j = rows[k], columns[k]
            for way in range(2):
                # One end points along the curve, the other against it, and lies ahead of it.
                value = min(fit[i, way], fit[j, 1 - way])
                if not value > 0.0:
                    continue
                chord = np.sqrt((arms[i, 0] - arms[j, 0]) ** 2 + (arms[i, 1] - arms[j, 1]) ** 2)
                most = _AHEAD_CHORDS * chord + _AHEAD_WIDTHS * width
                ahead = at[j, 1 - way] - at[i, way] if way == 0 else at[i, way] - at[j, 1 - way]
                if closed[c] and ahead < -count // 2:
                    ahead += count
                length = ahead * steps[c]
                if -width <= length <= most:
                    result[k] = max(result[k], trust[c] * value)
    return result
