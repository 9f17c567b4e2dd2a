"""Cubic B-splines at evenly spaced parameters."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float64

from dloftbs.kernels.compiler import kernel, read, write
from dloftbs.kernels.shared.cubic import basis_functions

_ORDER = 4


@kernel(read(float64, 1), read(float64, 2), float64, float64, write(float64, 2))
def sample_cubic(
    knots: npt.NDArray[np.float64],
    control: npt.NDArray[np.float64],
    first: float,
    last: float,
    points: npt.NDArray[np.float64],
) -> float:
    """Evaluate a cubic B-spline at evenly spaced parameters, by the recursion of Cox and de Boor.

    Not checked: the base interval of the knots is 0 to 1, and `first` and `last` lie in it, in this order.

    Parameters
    ----------
    knots : (n + 4,) float64
    control : (n, d) float64
    first, last : float
        The first and the last ``u``.
    points : (m, d) float64
        Written; two or more.

    Returns
    -------
    float
        The length of the polygon through the points.
    """
    m, dims = points.shape
    highest = len(control) - 1
    span = _ORDER - 1
    length = 0.0
    for k in range(m):
        u = first + (last - first) * k / (m - 1)
        while span < highest and u >= knots[span + 1]:
            span += 1
        basis = basis_functions(knots, span, u)
        squared = 0.0
        for d in range(dims):
            total = 0.0
            for r in range(_ORDER):
                total += basis[r] * control[span - _ORDER + 1 + r, d]
            points[k, d] = total
            if k:
                squared += (total - points[k - 1, d]) ** 2
        length += math.sqrt(squared)
    return length
