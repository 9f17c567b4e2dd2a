"""Normal equations of a cubic spline in space, by bands of twelve: three coordinates of four basis functions."""

from __future__ import annotations

import math

from dloftbs.kernels.compiler import Floats, helper

ORDER = 4
"""Number of basis functions of a cubic that are not zero in a knot span.

Source: by definition.
"""

BAND = 3 * ORDER
"""Number of bands of the normal equations: three coordinates of each.

Source: by definition.
"""

Four = tuple[float, float, float, float]


@helper
def span_of(n: int, t: float) -> int:
    """Return the knot span that a parameter lies in, of evenly spaced knots."""
    return ORDER - 1 + min(max(int(t * (n - ORDER + 1)), 0), n - ORDER)


@helper
def basis_and_slopes(knots: Floats, span: int, t: float) -> tuple[Four, Four]:
    """Return the four basis functions of a span and their derivatives."""
    a, b, c = knots[span - 2], knots[span - 1], knots[span]
    d, e, f = knots[span + 1], knots[span + 2], knots[span + 3]
    line = 1.0 / (d - c)
    second, first = (t - c) * line, (d - t) * line
    share = first / (d - b)
    quadratic_0, carry = (d - t) * share, (t - b) * share
    share = second / (e - c)
    quadratic_1, quadratic_2 = carry + (e - t) * share, (t - c) * share
    left, middle, right = quadratic_0 / (d - a), quadratic_1 / (e - b), quadratic_2 / (f - c)
    values = ((d - t) * left, (t - a) * left + (e - t) * middle, (t - b) * middle + (f - t) * right, (t - c) * right)
    return values, (-3.0 * left, 3.0 * (left - middle), 3.0 * (middle - right), 3.0 * right)


@helper
def cholesky(band: Floats) -> bool:
    """Replace a matrix by its Cholesky factor; band[i, k] is the entry at (i + k, i). False if it is not positive."""
    n = len(band)
    for i in range(n):
        if not band[i, 0] > 0.0:
            return False
        pivot = math.sqrt(band[i, 0])
        band[i, 0] = pivot
        reach = min(BAND, n - i)
        for k in range(1, reach):
            band[i, k] /= pivot
        for k in range(1, reach):
            value = band[i, k]
            if value != 0.0:
                for j in range(k, reach):
                    band[i + k, j - k] -= value * band[i, j]
    return True


@helper
def solve(factor: Floats, right: Floats) -> None:
    """Replace the right side (n,) by the solution."""
    n = len(right)
    for i in range(n):
        right[i] /= factor[i, 0]
        for k in range(1, min(BAND, n - i)):
            right[i + k] -= factor[i, k] * right[i]
    for i in range(n - 1, -1, -1):
        for k in range(1, min(BAND, n - i)):
            right[i] -= factor[i, k] * right[i + k]
        right[i] /= factor[i, 0]


@helper
def add_prior(band: Floats, right: Floats, control: Floats, roughness: Floats, weight: float) -> None:
    """Add the prior to the normal equations."""
    n = len(control)
    for i in range(n):
        for k in range(min(ORDER, n - i)):
            value = weight * roughness[i, k]
            for d in range(3):
                band[3 * i + d, 3 * k] += value
                right[3 * i + d] -= value * control[i + k, d]
                if k > 0:
                    right[3 * (i + k) + d] -= value * control[i, d]


@helper
def add_square(band: Floats, low: int, basis: Four, square: tuple[float, float, float, float, float, float]) -> None:
    """Add a symmetric matrix (xx, xy, xz, yy, yz, zz), times the products of four basis functions, to the equations."""
    xx, xy, xz, yy, yz, zz = square
    for r in range(ORDER):
        row = 3 * (low + r)
        own = basis[r] * basis[r]
        band[row, 0] += own * xx
        band[row, 1] += own * xy
        band[row, 2] += own * xz
        band[row + 1, 0] += own * yy
        band[row + 1, 1] += own * yz
        band[row + 2, 0] += own * zz
        for s in range(r + 1, ORDER):
            both, k = basis[r] * basis[s], 3 * (s - r)
            band[row, k] += both * xx
            band[row, k + 1] += both * xy
            band[row, k + 2] += both * xz
            band[row + 1, k - 1] += both * xy
            band[row + 1, k] += both * yy
            band[row + 1, k + 1] += both * yz
            band[row + 2, k - 2] += both * xz
            band[row + 2, k - 1] += both * yz
            band[row + 2, k] += both * zz


@helper
def add_row(right: Floats, low: int, basis: Four, value: float, gradient: tuple[float, float, float]) -> None:
    """Add a gradient, times a value and four basis functions, to a vector over the control points' coordinates."""
    for r in range(ORDER):
        for d in range(3):
            right[3 * (low + r) + d] += value * basis[r] * gradient[d]


@helper
def combine(control: Floats, low: int, basis: Four) -> tuple[float, float, float]:
    """Return the sum of four control points, weighted by basis functions."""
    x = y = z = 0.0
    for r in range(ORDER):
        x += basis[r] * control[low + r, 0]
        y += basis[r] * control[low + r, 1]
        z += basis[r] * control[low + r, 2]
    return x, y, z
