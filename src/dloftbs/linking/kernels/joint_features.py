"""Features of a joint between two ends, and of an end that stays open: rows of named columns.

Every column has a weight: what it takes from the log-odds of the joint, or of the open end, nats a unit. Columns of end
states: see `graph_ends`.
"""

from __future__ import annotations

import numpy as np
from numba import float64, int64

from dloftbs.kernels.compiler import Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.graph_ends import CURVATURE, HAS_CURVATURE, TANGENT_X, TANGENT_Y, X, Y
from dloftbs.linking.kernels.weights import JOINT

(LINK_TURN, LINK_SWERVE, GAP_ENERGY, GAP_LENGTH, GAP_ROUND, DEPTH_SWERVE, OTHER_COLOUR, GAP_SEEN) = range(8)
"""Columns of a joint: the turn and the swerve of a link through a junction, rad^2; the bend of a gap over its length,
rad^2 a width; its length, widths; the roundness of its ends, if it is no break of the mask; how unlike a cable's its
swerve towards the camera or away from it is, as depth shows it, nats; 1 if the cables before both ends differ clearly
in colour; what image and depth say for a gap, nats."""

OPEN_JUNCTION, OPEN_KINK, OPEN_FREE = range(3)
"""Columns of an end that stays open: 1 at a junction; 1 at a sharp turn where nothing else meets; 1 for a free end."""

_BREAK_WIDTHS = 4.0
"""Length up to which a gap may be a break of the mask, whose ends have any shape, widths; one twice as long is none.

Source: by hand; the longest of `broken` among the drawn edge cases.
"""

_TIP_WIDTHS = 0.5
"""How far beside each other two ends of one cable may lie before a gap, widths.

Source: geometry; what cuts a cable at a slant leaves a tip at its edge, half a width from the axis.
"""

_MIN_TIP_PX = 1.0
"""The same, px, for a cable of less than two.

Source: geometry; each of the two ends is known to half a pixel.
"""

_MIN_WIDTH_PX = 3.0
"""Width, px, as of which a cable counts that is thinner where a gap may be a break of its mask.

Source: published; the square of the opening, which breaks what is thinner.
"""

_EXTRAPOLATED_SHARE = 0.7
"""Share of the branch ends' own curvature that is extrapolated.

Source: by hand; a fitted curvature is noisy, and cables unbend.
"""

_EXTRAPOLATED_WIDTHS = 3.0
"""Length over which that curvature is extrapolated, widths.

Source: by hand.
"""

_UNKNOWN_BEND = 0.25
"""Bend assumed for a branch end without a direction, rad^2.

Source: by hand; that of a turn of 1 rad.
"""


@helper
def _bend_parts(states: Floats, i: int, j: int, cx: float, cy: float, width: float) -> tuple[float, float, float]:
    """Measure the bend of a curve along a chord from one end into another, in two parts, and its length.

    For the angles a and b of the two directions against the chord, the curve of least bending energy has
    ``4 (a^2 - a b + b^2) / length`` (a cubic, small angles), which is split here into the part of the turn a + b and
    that of the swerve (a - b) / 2. A turn that continues the ends' own curvature is free.

    Returns
    -------
    turn, swerve : float
        ``turn^2 / 4`` and ``3 swerve^2``, rad^2.
    length : float
        px.
    """
    length = np.sqrt(cx * cx + cy * cy)
    ix, iy, jx, jy = states[i, TANGENT_X], states[i, TANGENT_Y], -states[j, TANGENT_X], -states[j, TANGENT_Y]
    if (ix == 0.0 and iy == 0.0) or (jx == 0.0 and jy == 0.0):
        return _UNKNOWN_BEND, 0.0, length
    if length < 1.0:
        turn = np.arctan2(ix * jy - iy * jx, ix * jx + iy * jy)
        return 0.25 * turn * turn, 0.0, length
    a = np.arctan2(ix * cy - iy * cx, ix * cx + iy * cy)
    b = np.arctan2(cx * jy - cy * jx, cx * jx + cy * jy)
    turn, swerve = a + b, 0.5 * (a - b)
    known = max(states[i, HAS_CURVATURE] + states[j, HAS_CURVATURE], 1.0)
    curvature = (
        states[i, HAS_CURVATURE] * states[i, CURVATURE] - states[j, HAS_CURVATURE] * states[j, CURVATURE]
    ) / known
    extrapolated = _EXTRAPOLATED_SHARE * min(length, _EXTRAPOLATED_WIDTHS * width) * curvature
    # A curve that turns less than extrapolated is not charged for the difference.
    turn = max(turn - max(extrapolated, 0.0), 0.0) if turn > 0.0 else min(turn - min(extrapolated, 0.0), 0.0)
    return 0.25 * turn * turn, 3.0 * swerve * swerve, length


@helper
def bend_between(states: Floats, i: int, j: int, width: float) -> tuple[float, float]:
    """Measure the bend of a curve across a gap from one end into another, rad^2, and its length, px.

    How far the two lie beside each other, across their mean direction, counts for less: tips may lie off the axis.
    """
    cx, cy = states[j, X] - states[i, X], states[j, Y] - states[i, Y]
    turn, swerve, length = _bend_parts(states, i, j, cx, cy, width)
    mx, my = states[i, TANGENT_X] - states[j, TANGENT_X], states[i, TANGENT_Y] - states[j, TANGENT_Y]
    norm = np.sqrt(mx * mx + my * my)
    if norm == 0.0:
        return turn + swerve, length
    mx, my = mx / norm, my / norm
    aside = mx * cy - my * cx
    tip = max(_TIP_WIDTHS * width, _MIN_TIP_PX)
    less = min(max(aside, -tip), tip)
    tip_turn, tip_swerve, _ = _bend_parts(states, i, j, cx + my * less, cy - mx * less, width)
    return min(turn + swerve, tip_turn + tip_swerve), length


@helper
def describe_link(states: Floats, i: int, j: int, width: float, row: Floats) -> None:
    """Write the columns of a link between two ends at one junction."""
    cx, cy = states[j, X] - states[i, X], states[j, Y] - states[i, Y]
    row[:] = 0.0
    row[LINK_TURN], row[LINK_SWERVE], _ = _bend_parts(states, i, j, cx, cy, width)


@helper
def describe_gap(states: Floats, i: int, j: int, width: float, roundness: float, row: Floats) -> None:
    """Write the columns of a gap between two free ends whose roundness is given in sum."""
    bend, length = bend_between(states, i, j, width)
    row[:] = 0.0
    longer = min(max(length / (_BREAK_WIDTHS * max(width, _MIN_WIDTH_PX)) - 1.0, 0.0), 1.0)
    row[GAP_ENERGY] = bend * width / max(length, width)
    row[GAP_LENGTH], row[GAP_ROUND] = length / width, roundness * longer


@helper
def price(row: Floats, weights: Floats) -> float:
    """Return the cost of a joint or an open end, nats."""
    cost = 0.0
    for k in range(len(row)):
        cost += weights[k] * row[k]
    return cost


@kernel(read(float64, 2), read(float64, 1))
def prices(rows: Floats, weights: Floats) -> Floats:
    """Return the costs of joints or open ends: a product of a matrix, the same to the last bit wherever a row stands.

    Parameters
    ----------
    rows : (k, columns) float64
    weights : (columns,) float64

    Returns
    -------
    (k,) float64
        nats.
    """
    costs = np.empty(len(rows))
    for k in range(len(rows)):
        costs[k] = price(rows[k], weights)
    return costs


@kernel(read(float64, 2), read(int64, 2), read(int64, 1), read(float64, 1), float64)
def describe_pairs(states: Floats, pairs: Ints, nodes: Ints, roundness: Floats, width: float) -> Floats:
    """Return the columns of joints between pairs of ends: links at one junction, else gaps of any length.

    Parameters
    ----------
    states : (n, 6) float64
    pairs : (k, 2) int64
    nodes : (n,) int64
        The junction at each end, negative where there is none.
    roundness : (n,) float64
        Of each end.
    width : float
        px.

    Returns
    -------
    (k, columns) float64
    """
    joints = np.empty((len(pairs), len(JOINT)))
    for k in range(len(pairs)):
        i, j = pairs[k]
        if nodes[i] >= 0 and nodes[i] == nodes[j]:
            describe_link(states, i, j, width, joints[k])
        else:
            describe_gap(states, i, j, width, roundness[i] + roundness[j], joints[k])
    return joints
