"""Intervals of a curve's parameter."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from dloftbs.support.arrays import BoolArray, FloatArray

Spans = tuple[tuple[float, float], ...]


def inside(u: FloatArray, spans: Iterable[tuple[float, float]]) -> BoolArray:
    """Return which parameters (n,) lie in an interval, its bounds included."""
    found: BoolArray = np.zeros(len(u), np.bool_)
    for low, high in spans:
        found |= (low <= u) & (u <= high)
    return found


def outside(spans: Iterable[tuple[float, float]]) -> Spans:
    """Return the intervals of 0..1 that others leave, ascending; the others may overlap, in any order."""
    left, end = [], 0.0
    for low, high in [*sorted(spans), (1.0, 1.0)]:
        if low > end:
            left.append((end, low))
        end = max(end, high)
    return tuple(left)
