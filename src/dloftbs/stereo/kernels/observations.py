"""Observations of a point in space: how far its projection lies beside a curve in a view, or how far away it is.

An observation is a row: the ray x and y without the lens, the unit normal of the curve there, one over the variance
across it, half the width of the mask, whether it is clear, the depth, and one standard deviation of an error across it
that all rows of an object in a view share. A row with a depth has no normal, and its variance is that of the depth; a
row without one has a depth of 0.
"""

from __future__ import annotations

import numpy as np

from dloftbs.kernels.compiler import Floats, helper

WEIGHT, RADIUS, CLEAR, DEPTH, SHARED, COLUMNS = 4, 5, 6, 7, 8, 9
"""Index of each column of a row behind the ray and the normal, and the number of columns.

Source: by definition.
"""

Three = tuple[float, float, float]


@helper
def half_widths(rows: Floats) -> Floats:
    """Return half the width of what each observation shows over its depth along z, (m,); 0 where there is a depth.

    A mask is stretched away from the image's middle. The border is a plane through the camera, whose distance from a
    point of the axis is half the width.
    """
    off_axis = rows[:, 0] * rows[:, 2] + rows[:, 1] * rows[:, 3]
    return rows[:, RADIUS] / np.sqrt(1.0 + off_axis * off_axis)


@helper
def see(turn: Floats, shift: Floats, point: Three) -> Three:
    """Return the ray x and y of a point in a view, and one over its depth there; behind it that is not positive."""
    x, y, z = point
    inverse = 1.0 / (turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z + shift[2])
    seen_x = (turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z + shift[0]) * inverse
    seen_y = (turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z + shift[1]) * inverse
    return seen_x, seen_y, inverse


@helper
def see_step(turn: Floats, seen: Three, step: Three) -> tuple[float, float]:
    """Return how a ray moves with its point."""
    x, y, z = step
    step_z = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z
    step_x = (turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z - seen[0] * step_z) * seen[2]
    step_y = (turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z - seen[1] * step_z) * seen[2]
    return step_x, step_y


@helper
def gradient_of(turn: Floats, row: Floats, seen: Three) -> Three:
    """Return the derivative of an observation by the point in space."""
    if row[DEPTH] > 0.0:
        return turn[2, 0], turn[2, 1], turn[2, 2]
    nx, ny, inverse = row[2], row[3], seen[2]
    along = nx * seen[0] + ny * seen[1]
    return (
        (nx * turn[0, 0] + ny * turn[1, 0] - along * turn[2, 0]) * inverse,
        (nx * turn[0, 1] + ny * turn[1, 1] - along * turn[2, 1]) * inverse,
        (nx * turn[0, 2] + ny * turn[1, 2] - along * turn[2, 2]) * inverse,
    )
