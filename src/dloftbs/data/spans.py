"""Intervals of a curve's parameter."""

from __future__ import annotations

from collections.abc import Iterable

Spans = tuple[tuple[float, float], ...]


def outside(spans: Iterable[tuple[float, float]]) -> Spans:
    """Return the intervals of 0..1 that others leave, ascending; the others may overlap, in any order."""
    left, end = [], 0.0
    for low, high in [*sorted(spans), (1.0, 1.0)]:
        if low > end:
            left.append((end, low))
        end = max(end, high)
    return tuple(left)
