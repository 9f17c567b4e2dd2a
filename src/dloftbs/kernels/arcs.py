"""The parameter of centre lines: the distance along them, normalised."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64

from dloftbs.kernels._compile import helper, kernel, read


@helper
def _write_arc(points: npt.NDArray[np.float64], closed: bool, parameter: npt.NDArray[np.float64]) -> None:
    n, dims = points.shape
    parameter[0] = 0.0
    for i in range(1, n):
        squared = 0.0
        for d in range(dims):
            squared += (points[i, d] - points[i - 1, d]) ** 2
        parameter[i] = parameter[i - 1] + np.sqrt(squared)
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
def arc_parameter(points: npt.NDArray[np.float64], closed: bool) -> npt.NDArray[np.float64]:
    """Return what `dloftbs.centerline.arc_parameter` returns, faster.

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


@kernel(read(float64, 2), read(int64, 1), int64)
def arc_parameters(
    points: npt.NDArray[np.float64], first: npt.NDArray[np.int64], n_open: int
) -> npt.NDArray[np.float64]:
    """Return what `arc_parameter` returns, for several lines.

    Parameters
    ----------
    points : (m, d) float64
        Line after line.
    first : (k + 1,) int64
        Where each line starts in these, and the end; each has one point or more.
    n_open : int
        The first so many lines have ends, the rest are loops.

    Returns
    -------
    (m,) float64
    """
    parameter = np.empty(len(points), dtype=np.float64)
    for k in range(len(first) - 1):
        _write_arc(points[first[k] : first[k + 1]], k >= n_open, parameter[first[k] : first[k + 1]])
    return parameter
