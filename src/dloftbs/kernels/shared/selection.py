"""Values by their rank, without a sort: numba's takes half a second to compile for each kind of array."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.kernels.compiler import helper
from dloftbs.kernels.shared.copying import copy_to


@helper
def nth_least(values: npt.NDArray[Any], n: int) -> Any:
    """Return the value that would stand at place `n` if they were in order, and bring it there (Hoare, 1961).

    Those before it are no greater and those behind it no less. Not checked: ``0 <= n < len(values)``, none is NaN.
    """
    low, high = 0, len(values) - 1
    while low < high:
        pivot = values[(low + high) >> 1]
        i, j = low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while pivot < values[j]:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if n <= j:
            high = j
        elif n >= i:
            low = i
        else:
            break
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
