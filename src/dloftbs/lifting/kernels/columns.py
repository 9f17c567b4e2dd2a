"""Few values in each of many columns, in order: all columns take the same steps, and nothing waits for a guess."""

from __future__ import annotations

import numpy as np

from dloftbs.kernels.compiler import Floats, Ints, helper

MAX_ROWS = 16
"""Largest number of values in a column.

Source: by definition; a power of two, for which Batcher's network is made.
"""


def _network() -> Ints:
    """Return the pairs (k, 2) that Batcher's odd-even mergesort compares."""
    pairs = []
    run = 1
    while run < MAX_ROWS:
        reach = run
        while reach >= 1:
            pairs += [
                (low, low + reach)
                for start in range(reach % run, MAX_ROWS - reach, 2 * reach)
                for low in range(start, start + reach)
                if low // (2 * run) == (low + reach) // (2 * run)
            ]
            reach //= 2
        run *= 2
    return np.array(pairs, dtype=np.int64)


_NETWORK = _network()


@helper
def sort_columns(values: Floats) -> None:
    """Sort each column of values (k, n), in place; none is NaN, and there are no more than `MAX_ROWS` rows."""
    for k in range(len(_NETWORK)):
        if _NETWORK[k, 1] >= len(values):  # rows that are not there hold infinity, and nothing changes places with it
            continue
        low, high = values[_NETWORK[k, 0]], values[_NETWORK[k, 1]]
        for i in range(values.shape[1]):
            a, b = low[i], high[i]
            low[i] = a if a < b else b
            high[i] = b if a < b else a


@helper
def medians_of_columns(values: Floats) -> Floats:
    """Return the median of each column of values (k, n), infinity counting as no value; NaN of none. Sorts them."""
    sort_columns(values)
    medians = np.empty(values.shape[1])
    for i in range(values.shape[1]):
        count = 0
        for k in range(len(values)):
            count += values[k, i] < np.inf
        medians[i] = 0.5 * (values[(count - 1) // 2, i] + values[count // 2, i]) if count > 0 else np.nan
    return medians
