"""Rough curve in space along the rays of one view, from which the fit sets out."""

from __future__ import annotations

import math

import numpy as np
from numba import float64

from dloftbs.kernels.compiler import Floats, helper, kernel, read
from dloftbs.stereo.kernels.band_equations import BAND, ORDER, add_prior, basis_and_slopes, cholesky, solve, span_of


@helper
def _fit_points(points: Floats, weights: Floats, knots: Floats, roughness: Floats, prior: float) -> Floats:
    """Fit a smooth spline to points at even parameters, and return its control points (n, 3)."""
    n, m = len(knots) - ORDER, len(points)
    band, right, control = np.zeros((3 * n, BAND)), np.zeros(3 * n), np.zeros((n, 3))
    add_prior(band, right, control, roughness, prior)
    for i in range(m):
        at = i / (m - 1)
        span = span_of(n, at)
        basis, _ = basis_and_slopes(knots, span, at)
        low = span - ORDER + 1
        for r in range(ORDER):
            for d in range(3):
                value = weights[i] * basis[r]
                right[3 * (low + r) + d] += value * points[i, d]
                for s in range(r, ORDER):
                    band[3 * (low + r) + d, 3 * (s - r)] += value * basis[s]
    if cholesky(band):
        solve(band, right)
    return right.reshape(n, 3)


@kernel(
    read(float64, 2, "C"), read(float64, 1, "C"), read(float64, 1, "C"), float64, float64, float64,
    read(float64, 1, "C"), read(float64, 2, "C"), read(float64, 1, "C"), read(float64, 2, "C"),
)  # fmt: skip
def start_curve(
    nodes: Floats,
    inverse_depths: Floats,
    weights: Floats,
    scale: float,
    bending: float,
    least_share: float,
    depth_knots: Floats,
    depth_roughness: Floats,
    knots: Floats,
    roughness: Floats,
) -> tuple[Floats, float]:
    """Fit a spline in space to points on rays, at depths whose inverses are made smooth first.

    Parameters
    ----------
    nodes : (m, 2) float64
        Rays (x, y, 1), evenly spaced along the curve.
    inverse_depths, weights : (m,) float64
        As `triangulate_path` returns them.
    scale : float
        Factor of the weights.
    bending : float
        Spectral density of the second derivative by arc length, 1 / m.
    least_share : float
        Least inverse depth, as a share of the mean.
    depth_knots, depth_roughness, knots, roughness
        Knots of the inverse depth and of the spline, each end four times, else evenly spaced, and the integrals of the
        products of their basis functions' second derivatives, by bands.

    Returns
    -------
    control : (n, 3) float64
    length : float
        Of the polygon through the points, metres; 0 where they lie behind the camera.
    """
    m, n = len(nodes), len(depth_knots) - ORDER
    total = mean = length = 0.0
    for i in range(m):
        total += weights[i]
        mean += weights[i] * inverse_depths[i]
        if i > 0:
            length += math.hypot(nodes[i, 0] - nodes[i - 1, 0], nodes[i, 1] - nodes[i - 1, 1])
    if not (total > 0.0 and mean > 0.0 and length > 0.0):
        return np.zeros((len(knots) - ORDER, 3)), 0.0
    mean /= total
    columns, scaled = np.zeros((m, 3)), weights * scale
    columns[:, 0] = inverse_depths
    # What bends in space bends as much in depth, whose inverse falls with the square; a length has the depth in it.
    smooth = _fit_points(columns, scaled, depth_knots, depth_roughness, 1.0 / (bending * length**3 * mean))
    length = 0.0
    for i in range(m):
        at = i / (m - 1)
        span = span_of(n, at)
        basis, _ = basis_and_slopes(depth_knots, span, at)
        inverse = 0.0
        for r in range(ORDER):
            inverse += basis[r] * smooth[span - ORDER + 1 + r, 0]
        depth = 1.0 / max(inverse, least_share * mean)
        columns[i, 0], columns[i, 1], columns[i, 2] = nodes[i, 0] * depth, nodes[i, 1] * depth, depth
        if i > 0:
            dx, dy, dz = columns[i, 0] - columns[i - 1, 0], columns[i, 1] - columns[i - 1, 1], depth - columns[i - 1, 2]
            length += math.sqrt(dx * dx + dy * dy + dz * dz)
    # A rough point is as uncertain as half the distance to the next.
    scaled[:] = (2.0 * m / length) ** 2
    return _fit_points(columns, scaled, knots, roughness, 1.0 / (bending * length**3)), length
