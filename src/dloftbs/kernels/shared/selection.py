"""Values by their rank, without a sort: numba's takes half a second to compile for each kind of array."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.kernels.compiler import helper
from dloftbs.kernels.shared.copying import copy_to


@helper
def nth_least(values: npt.NDArray[Any], n: int) -> Any:
    """Return the value that would stand at place `n` if they were in order, and bring it there.

    Those before it are no greater and those behind it no less. Values are moved whether they are less or not (Lomuto's
    partition): a jump that nobody can guess takes longer than that. Not checked: ``0 <= n < len(values)``, none is NaN.
    """
    low, high = 0, len(values) - 1
    while low < high:
        a, b, c = values[low], values[(low + high) >> 1], values[high]
        pivot = max(min(a, b), min(max(a, b), c))
        less = low
        for i in range(low, high + 1):
            value = values[i]
            values[i] = values[less]
            values[less] = value
            less += value < pivot
        if n < less:
            high = less - 1
            continue
        up_to = less
        for i in range(less, high + 1):
            value = values[i]
            values[i] = values[up_to]
            values[up_to] = value
            up_to += value <= pivot
        if n < up_to:
            break
        low = max(up_to, low + 1)  # it ends whatever the values are
    return values[n]


@helper
def count_up_to(values: npt.NDArray[Any], most: float) -> int:
    """Return how many of ascending values are no greater than one: `numpy.searchsorted` from the right."""
    low, high = 0, len(values)
    while low < high:
        middle = (low + high) >> 1
        if values[middle] <= most:
            low = middle + 1
        else:
            high = middle
    return low


@helper
def median_of(values: npt.NDArray[np.float64]) -> float:
    """Return the median of values (n,), none of which is NaN; NaN of none. `few.median` is faster for a dozen."""
    count = len(values)
    if count == 0:
        return np.nan
    own = np.empty(count)
    copy_to(own, values)
    upper = nth_least(own, count // 2)
    if count % 2 == 1:
        return upper
    lower = own[0]
    for i in range(1, count // 2):
        lower = max(lower, own[i])
    return 0.5 * (lower + upper)


@helper
def falling_order(values: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Return the indices of values (n,) from the greatest to the least, of equals the first one first (merge sort)."""
    n = len(values)
    order, merged = np.arange(n), np.empty(n, dtype=np.int64)
    size = 1
    while size < n:
        for low in range(0, n, 2 * size):
            middle, high = min(low + size, n), min(low + 2 * size, n)
            i, j = low, middle
            for k in range(low, high):
                if i < middle and (j == high or values[order[i]] >= values[order[j]]):
                    merged[k] = order[i]
                    i += 1
                else:
                    merged[k] = order[j]
                    j += 1
        order, merged = merged, order
        size *= 2
    return order
