"""The numbers of branch ends, and the columns that describe them; for Python, too.

Branch ``b`` of a graph has the end ``2 b`` at its first point and ``2 b + 1`` at its last one. The functions take one
number or an array of them.
"""

from __future__ import annotations

from typing import TypeVar

from dloftbs.kernels.compiler import Ints, inlined

Number = TypeVar("Number", int, Ints)

FREE = -1
"""In the place of a junction: an end that touches none."""
UNAVAILABLE = -2
"""In the place of a junction: an end that cannot be joined."""

FORBIDDEN = 1e6
"""Cost of a pair of ends that cannot be joined: more than to leave all ends of a match open."""

X, Y, TANGENT_X, TANGENT_Y, CURVATURE, HAS_CURVATURE = range(6)
"""Columns of end states: position, px; outward unit tangent; curvature along it, 1 / px; 1 where that was measured."""


@inlined
def other_end(end: Number) -> Number:
    """Return the other end of the same branch."""
    return end ^ 1


@inlined
def branch_of(end: Number) -> Number:
    """Return the branch of an end."""
    return end >> 1


@inlined
def is_start(end: int) -> bool:
    """Return whether an end lies at the first point of its branch."""
    return (end & 1) == 0


@inlined
def inward(end: int) -> int:
    """Return the step from point to point that leads from an end into its branch: 1 or -1."""
    return 1 - 2 * (end & 1)


@inlined
def start_of(branch: Number) -> Number:
    """Return the end at the first point of a branch."""
    return branch << 1


@inlined
def stop_of(branch: Number) -> Number:
    """Return the end at the last point of a branch."""
    return (branch << 1) | 1


@inlined
def same_side(branch: Number, end: Number) -> Number:
    """Return the end of a branch that lies at its first point if the given end does, else that at its last point."""
    return (branch << 1) | (end & 1)
