"""Distances of many points from the nearest of others, where most of them have one nearby."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float64, intp

from dloftbs.kernels.compiler import kernel, read, write


@kernel(
    read(float64, 2, "C"),
    read(float64, 2, "C"),
    read(intp, 1, "C"),
    float64,
    float64,
    float64,
    intp,
    write(float64, 1, "C"),
)
def measure_nearest(
    points: npt.NDArray[np.float64],
    others: npt.NDArray[np.float64],
    first: npt.NDArray[np.intp],
    left: float,
    top: float,
    cell: float,
    columns: int,
    distances: npt.NDArray[np.float64],
) -> None:
    """Measure the distance of each point from the nearest of others, as long as that is at most two cells away.

    Not checked: every one of the others lies in the grid.

    Parameters
    ----------
    points : (n, 2) float64
    others : (m, 2) float64
        Cell by cell.
    first : (cells + 1,) intp
        Of a grid, row by row: where the points of each cell begin in `others`.
    left, top, cell : float
        First corner of the grid, and the length of a cell's sides.
    columns : int
        Of the grid.
    distances : (n,) float64
        Is set; infinite where nothing is near enough.
    """
    rows = (len(first) - 1) // columns
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        column, row = math.floor((x - left) / cell), math.floor((y - top) / cell)
        best = math.inf
        # All within `reach` cells lie in the square of as many cells around the point's own.
        for reach in range(1, 3):
            if best <= ((reach - 1) * cell) ** 2:
                break
            for r in range(max(row - reach, 0), min(row + reach, rows - 1) + 1):
                low, high = max(column - reach, 0), min(column + reach, columns - 1)
                if low > high:
                    continue
                for j in range(first[r * columns + low], first[r * columns + high + 1]):
                    dx, dy = x - others[j, 0], y - others[j, 1]
                    best = min(best, dx * dx + dy * dy)
        distances[i] = math.sqrt(best) if best <= (2.0 * cell) ** 2 else math.inf
