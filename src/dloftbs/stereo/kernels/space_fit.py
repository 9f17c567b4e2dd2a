"""One cubic B-spline in space through curves in several views, by Gauss's and Newton's method.

Each observation is a point of a curve in a view with the normal of the curve there; its residual is how far the
projection of the spline's point lies beside the curve. Where the point lies along the curve is found anew in each step.
What the observations leave open, along epipolar lines and where a view shows nothing, is decided by the prior: second
derivatives by arc length are white noise, as of a smoothing spline.
"""

from __future__ import annotations

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, Ints, helper, kernel, read, write
from dloftbs.stereo.kernels.band_equations import (
    ORDER,
    Four,
    add_prior,
    add_row,
    add_square,
    basis_and_slopes,
    cholesky,
    combine,
    solve,
    span_of,
)
from dloftbs.stereo.kernels.observations import DEPTH, WEIGHT, Three, gradient_of, see, see_step

_GAUGE = 0.1
"""Weight of a point's motion along the spline, as a share of that across it.

Source: numerics; such motion changes no residual, so that any weight keeps the equations regular.
"""

_FARTHEST_STEP = 0.5
"""Largest step of an observation along the spline, knot spans.

Source: numerics; steps are right to first order within a span.
"""

_SETTLED_M = 1e-4
"""Largest move of a control point in a step after which no more is needed, metres.

Source: by hand; a tenth of a millimetre, of which a curve moves by less.
"""


@helper
def _weigh(row: Floats, seen: Three, most: float, residual: Floats) -> tuple[float, float]:
    """Write the residual of an observation, and return its weight and that of rays along the curve."""
    if row[DEPTH] > 0.0:
        residual[0] = 1.0 / seen[2] - row[DEPTH]
        return row[WEIGHT], 0.0
    residual[0] = row[2] * (seen[0] - row[0]) + row[3] * (seen[1] - row[1])
    weight = row[WEIGHT]
    if abs(residual[0]) > most:
        weight *= most / abs(residual[0])
    return weight, _GAUGE * weight


@helper
def _add_observation(
    band: Floats, low: int, basis: Four, gradient: Three, tangent: Three, weight: float, along: float
) -> None:
    """Add an observation, and how much a point resists motion along the spline, to the normal matrix."""
    gx, gy, gz = gradient
    tx, ty, tz = tangent
    speed = tx * tx + ty * ty + tz * tz
    gauge = along / speed if speed > 0.0 else 0.0
    square = (
        weight * gx * gx + gauge * tx * tx,
        weight * gx * gy + gauge * tx * ty,
        weight * gx * gz + gauge * tx * tz,
        weight * gy * gy + gauge * ty * ty,
        weight * gy * gz + gauge * ty * tz,
        weight * gz * gz + gauge * tz * tz,
    )
    add_square(band, low, basis, square)


@helper
def _step_along(turn: Floats, row: Floats, seen: Three, tangent: Three) -> float:
    """Return by how much of its parameter a point lies from where an observation is nearest to the spline."""
    slope_x, slope_y = see_step(turn, seen, tangent)
    squared = slope_x * slope_x + slope_y * slope_y
    if squared > 0.0:
        return -((seen[0] - row[0]) * slope_x + (seen[1] - row[1]) * slope_y) / squared
    return 0.0


@kernel(
    write(float64, 2, "C"), read(float64, 1, "C"), write(float64, 1, "C"), read(float64, 2, "C"),
    read(int64, 1, "C"), read(float64, 3, "C"), read(float64, 2, "C"),
    read(float64, 2, "C"), float64, float64, int64,
    write(float64, 1, "C"), write(float64, 1, "C"), write(float64, 2, "C"),
)  # fmt: skip
def fit_views(
    control: Floats,
    knots: Floats,
    t: Floats,
    rows: Floats,
    views: Ints,
    rotations: Floats,
    shifts: Floats,
    roughness: Floats,
    prior: float,
    most: float,
    iterations: int,
    residuals: Floats,
    depths: Floats,
    band: Floats,
) -> bool:
    """Fit a spline in space to curves in several views, from a spline nearby.

    Parameters
    ----------
    control : (n, 3) float64
        Comes with the start and is overwritten, in the frame that the poses are in.
    knots : (n + 4,) float64
        As for `start_curve`.
    t : (m,) float64
        Place of each observation on the spline; comes with the start and is overwritten.
    rows : (m, 8) float64
        The observations; see `dloftbs.stereo.kernels.observations`.
    views : (m,) int64
        The view of each.
    rotations : (k, 3, 3) float64
    shifts : (k, 3) float64
        To the frames of the views.
    roughness : (n, 4) float64
        As for `start_curve`.
    prior : float
        Weight of the roughness.
    most : float
        Largest residual across a curve that counts in full, of rays; larger ones count as their root (Huber).
    iterations : int
        At the most.
    residuals : (m,) float64
        Written: those before the last step, of rays, or metres of what has a depth.
    depths : (m,) float64
        Written: along z of each observation's view, metres, before the last step.
    band : (3 n, 12) float64
        Written: the Cholesky factor of the normal matrix.

    Returns
    -------
    bool
        False if the spline leads behind a camera, or the equations have no solution.
    """
    n, m = len(control), len(t)
    right = np.empty(3 * n)
    farthest = _FARTHEST_STEP / (n - ORDER + 1)
    for _ in range(iterations):
        band[:] = 0.0
        right[:] = 0.0
        add_prior(band, right, control, roughness, prior)
        for i in range(m):
            span = span_of(n, t[i])
            basis, slopes = basis_and_slopes(knots, span, t[i])
            low = span - ORDER + 1
            tangent = combine(control, low, slopes)
            turn = rotations[views[i]]
            seen = see(turn, shifts[views[i]], combine(control, low, basis))
            if not seen[2] > 0.0:
                return False
            depths[i] = 1.0 / seen[2]
            weight, along = _weigh(rows[i], seen, most, residuals[i : i + 1])
            gradient = gradient_of(turn, rows[i], seen)
            _add_observation(band, low, basis, gradient, tangent, weight, along * seen[2] * seen[2])
            add_row(right, low, basis, -weight * residuals[i], gradient)
            step = _step_along(turn, rows[i], seen, tangent)
            t[i] = min(max(t[i] + min(max(step, -farthest), farthest), 0.0), 1.0)
        if not cholesky(band):
            return False
        solve(band, right)
        for i in range(n):
            for d in range(3):
                control[i, d] += right[3 * i + d]
        if np.abs(right).max() < _SETTLED_M:
            break
    return True
