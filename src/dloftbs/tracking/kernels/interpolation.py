"""Values at even parameters, interpolated in between."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import helper, kernel, read

_Floats = npt.NDArray[np.float64]


@helper
def _interpolate_at(samples: _Floats, u: float, into: _Floats) -> None:
    """Write the value (d,) at `u` of samples (m, d) at even parameters from 0 to 1, rounded as by `numpy.interp`."""
    last = len(samples) - 1
    step = 1.0 / last
    k = min(max(int(u * last), 0), last - 1)
    if u < k * step:  # rounded up, or down
        k = max(k - 1, 0)
    elif k + 1 < last and u >= (k + 1) * step:
        k += 1
    low, high = k * step, (k + 1) * step if k + 1 < last else 1.0
    for d in range(samples.shape[1]):
        if u <= 0.0:
            into[d] = samples[0, d]
        elif u >= 1.0:
            into[d] = samples[last, d]
        else:
            into[d] = (samples[k + 1, d] - samples[k, d]) / (high - low) * (u - low) + samples[k, d]


@kernel(read(float64, 2), read(float64, 1))
def interpolate(samples: _Floats, u: _Floats) -> _Floats:
    """Interpolate samples linearly.

    Parameters
    ----------
    samples : (m, d) float64
        At even parameters from 0 to 1; two or more.
    u : (k,) float64
        Beyond these, the values are those of the first and of the last sample.

    Returns
    -------
    (k, d) float64
    """
    values = np.empty((len(u), samples.shape[1]))
    for k in range(len(u)):
        _interpolate_at(samples, u[k], values[k])
    return values


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
    moved = np.empty((len(control), 2))
    places = np.cumsum(knots)
    for i in range(len(control)):
        u = (places[degree + i] - places[i]) / degree
        _interpolate_at(velocity, u % 1.0 if closed else u, moved[i])
        for d in range(2):
            moved[i, d] = control[i, d] + seconds * moved[i, d]
    return moved
