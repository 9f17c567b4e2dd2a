"""A few numbers in order, by insertion: for a dozen or so that is faster than any other way."""

from __future__ import annotations

import numpy as np

from dloftbs.kernels.compiler import Floats, inlined


@inlined
def insert(value: float, few: Floats, count: int) -> None:
    """Insert a value into the first `count` of `few`, which are in order; there is room for one more."""
    k = count
    while k > 0 and few[k - 1] > value:
        few[k] = few[k - 1]
        k -= 1
    few[k] = value


@inlined
def middle(few: Floats, count: int) -> float:
    """Return the median of the first `count` of `few`, which are in order; NaN of none."""
    return 0.5 * (few[(count - 1) // 2] + few[count // 2]) if count > 0 else np.nan


@inlined
def median(values: Floats, few: Floats) -> float:
    """Return the median of a few values, none of them NaN; NaN of none. There is room for them in `few`."""
    for k in range(len(values)):
        insert(values[k], few, k)
    return middle(few, len(values))
