"""Groups of things that hang together: a forest in which each thing points to its parent, and a root to itself."""

from __future__ import annotations

from dloftbs.kernels.compiler import Ints, inlined


@inlined
def find_root(parent: Ints, i: int) -> int:
    """Return the root of a thing's group, and halve the path to it."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@inlined
def unite(parent: Ints, i: int, j: int) -> None:
    """Make the groups of two things one, under the lower of their roots."""
    a, b = find_root(parent, i), find_root(parent, j)
    parent[max(a, b)] = min(a, b)
