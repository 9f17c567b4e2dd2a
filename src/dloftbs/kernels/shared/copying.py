"""Numbers from one array into another, in loops: numba's assignment of an array takes a tenth of a second to compile.

It brings the message for shapes that do not fit along into each kernel, and what that takes of strings.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.kernels.compiler import helper, inlined

_Numbers = npt.NDArray[Any]


@inlined
def copy_to(target: _Numbers, source: _Numbers) -> None:
    """Write the numbers (n,) to the first places of another array; the two do not overlap."""
    for i in range(len(source)):
        target[i] = source[i]


@inlined
def copy_rows_to(target: _Numbers, source: _Numbers) -> None:
    """Write the rows (n, k) to the first rows of another array; the two do not overlap."""
    for i in range(len(source)):
        for k in range(source.shape[1]):
            target[i, k] = source[i, k]


@helper
def longer(values: _Numbers) -> _Numbers:
    """Return the same (n,) in an array that is twice as long."""
    twice = np.empty(2 * len(values), dtype=values.dtype)
    copy_to(twice, values)
    return twice


@helper
def longer_rows(values: _Numbers) -> _Numbers:
    """Return the same rows (n, k) in an array that has twice as many."""
    twice = np.empty((2 * len(values), values.shape[1]), dtype=values.dtype)
    copy_rows_to(twice, values)
    return twice
