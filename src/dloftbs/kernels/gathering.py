"""Spans of points, put one after the other to lines in the image."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float64, int64

from dloftbs.kernels._compile import kernel, read


@kernel(read(float64, 2), read(float64, 1), read(int64, 2), read(float64, 2), read(float64, 1))
def gather(
    points: npt.NDArray[np.float64],
    radius: npt.NDArray[np.float64],
    spans: npt.NDArray[np.int64],
    matrix: npt.NDArray[np.float64],
    offset: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Copy spans of points and their radius, some of them backwards, and turn the points into the image's.

    Parameters
    ----------
    points : (n, 2) float64
    radius : (n,) float64
    spans : (k, 3) int64
        First point, the one after the last, and the step: 1 or -1.
    matrix, offset : (2, 2), (2,) float64
        From the points to the image, ``matrix @ p + offset``.

    Returns
    -------
    points : (m, 2) float64
    radius : (m,) float64
    """
    total = 0
    for k in range(len(spans)):
        total += abs(spans[k, 1] - spans[k, 0])
    own_points = np.empty((total, 2))
    own_radius = np.empty(total)
    count = 0
    for k in range(len(spans)):
        for i in range(spans[k, 0], spans[k, 1], spans[k, 2]):
            x, y = points[i, 0], points[i, 1]
            own_points[count, 0] = x * matrix[0, 0] + y * matrix[0, 1] + offset[0]
            own_points[count, 1] = x * matrix[1, 0] + y * matrix[1, 1] + offset[1]
            own_radius[count] = radius[i]
            count += 1
    return own_points, own_radius


@kernel(read(float64, 1), read(int64, 1))
def medians(values: npt.NDArray[np.float64], first: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
    """Return the medians of several series.

    Parameters
    ----------
    values : (m,) float64
        Series after series.
    first : (k + 1,) int64
        Where each starts in these, and the end; each has one value or more.

    Returns
    -------
    (k,) float64
    """
    result = np.empty(len(first) - 1)
    for k in range(len(result)):
        result[k] = np.median(values[first[k] : first[k + 1]])
    return result
