"""Values at even parameters, interpolated in between, places beyond the ends, and how they move."""

from __future__ import annotations

import math

import numpy as np
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import Floats, helper, kernel, read


@helper
def value_at(samples: Floats, place: float, d: int) -> float:
    """Return a coordinate between samples (m, ...) by their index; beyond the ends, it is that of the end."""
    place = min(max(place, 0.0), len(samples) - 1.0)
    k = min(int(place), len(samples) - 2)
    share = place - k
    return samples[k, d] * (1.0 - share) + samples[k + 1, d] * share


@kernel(read(float64, 2), read(float64, 1))
def interpolate(samples: Floats, u: Floats) -> Floats:
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
        for d in range(samples.shape[1]):
            values[k, d] = value_at(samples, u[k] * (len(samples) - 1), d)
    return values


@kernel(read(float64, 2), read(float64, 1), float64)
def extend_ends(points: Floats, distances: Floats, unit: float) -> Floats:
    """Return places straight on beyond the first point of a curve, then beyond the last.

    Parameters
    ----------
    points : (n, 2) float64
        Along the curve; two or more.
    distances : (k,) float64
        Of the places from the end.
    unit : float
        That of the distances, px.

    Returns
    -------
    (2 k, 2) float64
        The points themselves if their neighbours coincide with them.
    """
    count, last = len(distances), len(points) - 1
    places = np.empty((2 * count, 2))
    for side, end, before in ((0, 0, 1), (1, last, last - 1)):
        x, y = points[end, 0] - points[before, 0], points[end, 1] - points[before, 1]
        length = math.sqrt(x * x + y * y)
        for k in range(count):
            far = unit * distances[k] / length if length > 0.0 else 0.0
            at = k + side * count
            places[at, 0], places[at, 1] = points[end, 0] + far * x, points[end, 1] + far * y
    return places


@kernel(read(float64, 2), read(float64, 2), read(float64, 2), float64, float64)
def filter_velocity(velocity: Floats, before: Floats, after: Floats, dt: float, gain: float) -> Floats:
    """Update velocities by the step of their samples.

    Parameters
    ----------
    velocity : (m, d) float64
        A second.
    before, after : (m, d) float64
        The samples.
    dt : float
        Time of the step, s.
    gain : float
        Weight of its velocity; the former one has the rest.

    Returns
    -------
    (m, d) float64
    """
    result: Floats = (1.0 - gain) * velocity + (gain / dt) * (after - before)
    return result


@kernel(read(float64, 1), read(float64, 2), read(float64, 2), float64, int64, boolean)
def move_control_points(
    knots: Floats, control: Floats, velocity: Floats, seconds: float, degree: int, closed: bool
) -> Floats:
    """Move each control point by the velocity of the curve where that point weighs most, its Greville parameter.

    Parameters
    ----------
    knots : (n + degree + 1,) float64
    control : (n, d) float64
        In the plane or in space, px or m.
    velocity : (m, d) float64
        Of samples at even parameters from 0 to 1, a second.
    seconds : float
    degree : int
    closed : bool

    Returns
    -------
    (n, d) float64
    """
    moved = np.empty(control.shape)
    places = np.cumsum(knots)
    for i in range(len(control)):
        u = (places[degree + i] - places[i]) / degree
        place = (u % 1.0 if closed else u) * (len(velocity) - 1)
        for d in range(control.shape[1]):
            moved[i, d] = control[i, d] + seconds * value_at(velocity, place, d)
    return moved
