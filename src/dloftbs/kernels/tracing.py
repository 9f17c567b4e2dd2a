"""From skeleton pixels to runs without branches, and how wide the mask is along them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float64, int32, int64, uint8

from dloftbs.kernels.compiler import Bools, Bytes, Floats, Ints, helper, inlined, kernel, read, write
from dloftbs.kernels.shared.polyline import chord_direction

RADIUS_SPACING = 4
"""Pixels of a run from one measured radius to the next."""

_CHORD_REACH_PX = 4
"""Number of points to either side over which the direction across a run is measured for its width, px.

Source: by hand; long enough for a staircase, short enough for a bend.
"""

_NEAR = 2  # marks what touches a branch point in the grid, beside the 1, while a kernel runs


@inlined
def _at(grid: Bytes, row: int, column: int) -> int:
    """Return 1 for foreground, 0 for background; unsigned indices spare numba's test for negative ones."""
    return np.int64(grid[np.uint64(row), np.uint64(column)] & 1)


@inlined
def _around(grid: Bytes, row: int, column: int) -> tuple[int, int, int]:
    """Return the number of foreground neighbours, and the sums of the ways to them, down and to the right."""
    north_west, south_east = _at(grid, row - 1, column - 1), _at(grid, row + 1, column + 1)
    north_east, south_west = _at(grid, row - 1, column + 1), _at(grid, row + 1, column - 1)
    north, south = _at(grid, row - 1, column), _at(grid, row + 1, column)
    west, east = _at(grid, row, column - 1), _at(grid, row, column + 1)
    above, below = north_west + north + north_east, south_west + south + south_east
    return above + west + east + below, below - above, north_east + east + south_east - north_west - west - south_west


@helper
def _first_way(grid: Bytes, row: int, column: int) -> tuple[int, int]:
    """Return the way down and to the right to the first neighbour, sides before corners."""
    for dr, dc in ((-1, 0), (0, -1), (0, 1), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1)):
        if _at(grid, row + dr, column + dc) != 0:
            return dr, dc
    return 0, 0


@kernel(write(uint8, 2), read(int32, 2), read(uint8, 1))
def trace(grid: Bytes, pixels_rc: npt.NDArray[np.int32], degrees: Bytes) -> tuple[Floats, Ints, int]:
    """Leave out the branch points; walk pixel by pixel from every endpoint to the other end, then around every loop.

    Starts are taken in the order of `pixels_rc`. Not checked: the outermost rows and columns of the grid are 0, and the
    list is complete.

    Parameters
    ----------
    grid : (H, W) uint8
        0 and 1; 0 and 1 again afterwards.
    pixels_rc : (n, 2) int32
        Its foreground.
    degrees : (n,) uint8
        The number of neighbours of each; what has more than two is a branch point.

    Returns
    -------
    points : (m, 2) float64
        ``(x, y)``, that is column and row, run after run; all pixels but the branch points.
    offsets : (runs + 1,) int64
        Start of each run in `points`, and the end.
    n_open : int
        The first `n_open` runs have ends, the rest are loops.
    """
    n = len(pixels_rc)
    branches = 0
    for i in range(n):
        if degrees[i] > 2:
            branches += 1
            row, column = pixels_rc[i, 0], pixels_rc[i, 1]
            grid[row, column] = 0
            for r in range(row - 1, row + 2):
                for c in range(column - 1, column + 2):
                    grid[r, c] |= _NEAR * (grid[r, c] & 1)
    points = np.empty((n, 2), dtype=np.float64)
    offsets = np.empty(n + 1, dtype=np.int64)
    offsets[0] = 0
    runs = 0
    n_open = 0
    count = 0
    for sweep in range(2):
        for i in range(n):
            row, column = np.int64(pixels_rc[i, 0]), np.int64(pixels_rc[i, 1])
            state = grid[np.uint64(row), np.uint64(column)]
            if state == 0 or (sweep == 0 and degrees[i] == 2 and state == 1):  # the second has both neighbours still
                continue
            left, down, right = _around(grid, row, column)
            if sweep == 0 and left > 1:
                continue
            if left > 1:  # a loop starts with the first of two ways: sides before corners
                down, right = _first_way(grid, row, column)
            while True:
                grid[np.uint64(row), np.uint64(column)] = 0
                points[count, 0] = column
                points[count, 1] = row
                count += 1
                if left == 0:
                    break
                row += down
                column += right
                left, down, right = _around(grid, row, column)
            runs += 1
            offsets[runs] = count
        if sweep == 0:
            n_open = runs
            if count == n - branches:  # there is no loop
                break
    for i in range(n):
        grid[np.uint64(pixels_rc[i, 0]), np.uint64(pixels_rc[i, 1])] = 1
    return points[:count], offsets[: runs + 1], n_open


@helper
def _reach(mask: Bytes, x: float, y: float, dx: float, dy: float) -> float:
    """Return how far the mask goes from a point along a unit vector, to half a pixel."""
    t, most = 1.0, float(mask.shape[0] + mask.shape[1])  # the margin around the mask ends it before
    # Coordinates are not negative: this rounds.
    while t < most and mask[int(y + t * dy + 0.5), int(x + t * dx + 0.5)] != 0:
        t += 1.0
    t -= 0.5
    inside = mask[int(y + t * dy + 0.5), int(x + t * dx + 0.5)] != 0
    return t + 0.25 if inside else t - 0.25  # the edge lies within the next or the last half step


@kernel(read(uint8, 2), read(float64, 2), read(int64, 1))
def measure_radius(mask: Bytes, points: Floats, offsets: Ints) -> Floats:
    """Measure half the mask's width across the runs, at every fourth of their points and linearly in between.

    Not checked: the outermost rows and columns of the mask are 0, and the points lie inside.

    Parameters
    ----------
    mask : (H, W) uint8
    points : (n, 2) float64
        ``(x, y)``, run after run.
    offsets : (runs + 1,) int64
        Start of each run in `points`, and the end.

    Returns
    -------
    (n,) float64
        Pixels.
    """
    radius = np.empty(len(points), dtype=np.float64)
    for run in range(len(offsets) - 1):
        first, last = offsets[run], offsets[run + 1] - 1
        measured = first
        for i in range(first, last + 1):
            if (i - first) % RADIUS_SPACING != 0 and i != last:
                continue
            before, after = max(i - _CHORD_REACH_PX, first), min(i + _CHORD_REACH_PX, last)
            dx, dy = chord_direction(points, before, after)
            x, y = points[i, 0], points[i, 1]
            radius[i] = 0.5 * (_reach(mask, x, y, -dy, dx) + _reach(mask, x, y, dy, -dx))
            for j in range(measured + 1, i):
                radius[j] = radius[measured] + (radius[i] - radius[measured]) * (j - measured) / (i - measured)
            measured = i
    return radius


@kernel(read(uint8, 2), read(float64, 2), read(float64, 2))
def are_covered(mask: Bytes, starts: Floats, ends: Floats) -> Bools:
    """Return whether straight lines run over foreground only, looked at every half pixel.

    Parameters
    ----------
    mask : (H, W) uint8
    starts, ends : (n, 2) float64
        ``(x, y)`` inside the mask.

    Returns
    -------
    (n,) bool
    """
    covered = np.ones(len(starts), dtype=np.bool_)
    for line in range(len(starts)):
        x, y = starts[line]
        dx, dy = ends[line, 0] - x, ends[line, 1] - y
        steps = int(2.0 * np.sqrt(dx * dx + dy * dy)) + 1
        for i in range(steps + 1):
            if mask[int(y + dy * i / steps + 0.5), int(x + dx * i / steps + 0.5)] == 0:
                covered[line] = False
                break
    return covered
