"""Lengths and directions of lines through points."""

from __future__ import annotations

import numpy as np

from dloftbs.kernels.compiler import Floats, helper


@helper
def polyline_length(points: Floats) -> float:
    """Return the length of the line through points (n, 2), px; through its control points, no B-spline is longer."""
    length = 0.0
    for i in range(1, len(points)):
        length += np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
    return length


@helper
def chord_direction(points: Floats, i: int, j: int) -> tuple[float, float]:
    """Return the unit vector from one of the points to another; (1, 0) where the two are the same."""
    dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
    norm = np.sqrt(dx * dx + dy * dy)
    if norm == 0.0:
        return 1.0, 0.0
    return dx / norm, dy / norm
