"""Curves that move along with the velocities of their samples."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import kernel, read

_Floats = npt.NDArray[np.float64]


@kernel(read(float64, 1), read(float64, 2), read(float64, 2), float64, int64, boolean)
def move_control_points(
    knots: _Floats, control: _Floats, velocity: _Floats, seconds: float, degree: int, closed: bool
) -> _Floats:
    """Move each control point by the velocity of the curve where that point weighs most, its Greville parameter.

    Parameters
    ----------
    knots : (n + degree + 1,) float64
    control : (n, 2) float64
        px.
    velocity : (m, 2) float64
        Of samples at even parameters from 0 to 1, px a second.
    seconds : float
    degree : int
    closed : bool

    Returns
    -------
    (n, 2) float64
    """
    n, last = len(control), len(velocity) - 1
    moved = np.empty((n, 2))
    places = np.cumsum(knots)
    step = 1.0 / last
    for i in range(n):
        u = (places[degree + i] - places[i]) / degree
        u = u % 1.0 if closed else min(max(u, 0.0), 1.0)
        k = min(int(u * last), last - 1)
        if u < k * step:  # rounded up, or down
            k -= 1
        elif k + 1 < last and u >= (k + 1) * step:
            k += 1
        low, high = k * step, (k + 1) * step if k + 1 < last else 1.0
        for d in range(2):
            slope = (velocity[k + 1, d] - velocity[k, d]) / (high - low)
            at = velocity[last, d] if u >= 1.0 else slope * (u - low) + velocity[k, d]
            moved[i, d] = control[i, d] + seconds * at
    return moved
