"""Cubic B-splines at evenly spaced parameters."""

from __future__ import annotations

import math

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, kernel, read
from dloftbs.kernels.shared.cubic import basis_functions

_ORDER = 4


@kernel(read(float64, 1), read(float64, 2), float64, float64, int64)
def sample_cubic(knots: Floats, control: Floats, first: float, last: float, count: int) -> tuple[Floats, float]:
    """Evaluate a cubic B-spline at evenly spaced parameters, by the recursion of Cox and de Boor.

    Not checked: the base interval of the knots is 0 to 1, and `first` and `last` lie in it, in this order.

    Parameters
    ----------
    knots : (n + 4,) float64
    control : (n, d) float64
    first, last : float
        The first and the last ``u``.
    count : int
        Number of points, two or more.

    Returns
    -------
    points : (count, d) float64
    length : float
        Of the polygon through the points.
    """
    dims = control.shape[1]
    points = np.empty((count, dims))
    highest = len(control) - 1
    span = _ORDER - 1
    length = 0.0
    for k in range(count):
        u = first + (last - first) * k / (count - 1)
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
    return points, length
