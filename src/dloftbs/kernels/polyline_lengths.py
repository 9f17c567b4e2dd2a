"""Centre lines: spans of points put together, and the parameter along them, which is the distance, normalised."""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.selection import median_of


@helper
def _add_up_steps(points: Floats, lengths: Floats) -> None:
    n, dims = points.shape
    lengths[0] = 0.0
    for i in range(1, n):
        squared = 0.0
        for d in range(dims):
            squared += (points[i, d] - points[i - 1, d]) ** 2
        lengths[i] = lengths[i - 1] + np.sqrt(squared)


@helper
def _write_arc(points: Floats, closed: bool, parameter: Floats) -> None:
    n, dims = points.shape
    _add_up_steps(points, parameter)
    total = parameter[n - 1]
    if closed:
        squared = 0.0
        for d in range(dims):
            squared += (points[0, d] - points[n - 1, d]) ** 2
        total += np.sqrt(squared)
    if total > 0.0:
        for i in range(n):
            parameter[i] /= total


@kernel(read(float64, 2), boolean)
def arc_parameter(points: Floats, closed: bool) -> Floats:
    """Return what `dloftbs.data.centerline.arc_parameter` returns, faster.

    Parameters
    ----------
    points : (n, d) float64
        One or more.
    closed : bool

    Returns
    -------
    (n,) float64
    """
    parameter = np.empty(len(points), dtype=np.float64)
    _write_arc(points, closed, parameter)
    return parameter


@kernel(read(float64, 2))
def arc_lengths(points: Floats) -> Floats:
    """Return the length of the polygon through points up to each of them.

    Parameters
    ----------
    points : (n, d) float64
        One or more.

    Returns
    -------
    (n,) float64
    """
    lengths = np.empty(len(points), dtype=np.float64)
    _add_up_steps(points, lengths)
    return lengths


@kernel(
    read(float64, 2), read(float64, 1), read(int64, 2), read(int64, 1), int64,
    read(float64, 2), read(float64, 2), read(float64, 1),
)  # fmt: skip
def lay_out(
    points: Floats,
    radius: Floats,
    spans: Ints,
    first: Ints,
    n_open: int,
    end_states: Floats,
    matrix: Floats,
    offset: Floats,
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Put spans of points together to lines, some of them backwards, and turn all into the image's coordinates.

    Parameters
    ----------
    points : (n, 2) float64
    radius : (n,) float64
    spans : (k, 3) int64
        First point, the one after the last, and the step: 1 or -1; line after line.
    first : (c + 1,) int64
        Start of each line among the points of all lines, and the end; each has one point or more.
    n_open : int
        Number of lines with ends; the rest are loops.
    end_states : (e, 2 or more) float64
        States of branch ends: position ``(x, y)`` first; further columns are not read.
    matrix, offset : (2, 2), (2,) float64
        From the points to the image, ``matrix @ p + offset``.

    Returns
    -------
    points : (m, 2) float64
        Of all lines.
    radius : (m,) float64
    u : (m,) float64
        As `arc_parameter` makes it of each line.
    widths : (c,) float64
        Twice the median radius.
    places : (e, 2) float64
        Positions of the ends in the image.
    """
    total = first[len(first) - 1]
    own_points, own_radius, u = np.empty((total, 2)), np.empty(total), np.empty(total)
    places = np.empty((len(end_states), 2))
    xx, xy, yx, yy = matrix[0, 0], matrix[0, 1], matrix[1, 0], matrix[1, 1]
    count = 0
    for k in range(len(spans)):
        for i in range(spans[k, 0], spans[k, 1], spans[k, 2]):
            x, y = points[i, 0], points[i, 1]
            own_points[count, 0], own_points[count, 1] = x * xx + y * xy + offset[0], x * yx + y * yy + offset[1]
            own_radius[count] = radius[i]
            count += 1
    for i in range(len(end_states)):
        x, y = end_states[i, 0], end_states[i, 1]
        places[i, 0], places[i, 1] = x * xx + y * xy + offset[0], x * yx + y * yy + offset[1]
    widths = np.empty(len(first) - 1)
    for c in range(len(widths)):
        start, stop = first[c], first[c + 1]
        _write_arc(own_points[start:stop], c >= n_open, u[start:stop])
        widths[c] = 2.0 * median_of(own_radius[start:stop])
    return own_points, own_radius, u, widths, places
