"""Cubic B-splines at evenly spaced parameters."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float64

from dloftbs.kernels.compiler import kernel, read, write

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
    value = np.empty(_ORDER)
    length = 0.0
    for k in range(m):
        u = first + (last - first) * k / (m - 1)
        while span < highest and u >= knots[span + 1]:
            span += 1
        value[0] = 1.0
        for degree in range(1, _ORDER):
            carry = 0.0
            for r in range(degree):
                high, low = knots[span + r + 1], knots[span + r + 1 - degree]
                share = value[r] / (high - low) if high > low else 0.0
                value[r] = carry + (high - u) * share
                carry = (u - low) * share
            value[degree] = carry
        squared = 0.0
        for d in range(dims):
            total = 0.0
            for r in range(_ORDER):
                total += value[r] * control[span - _ORDER + 1 + r, d]
            points[k, d] = total
            if k:
                squared += (total - points[k - 1, d]) ** 2
        length += math.sqrt(squared)
    return length
