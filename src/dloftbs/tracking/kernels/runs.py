"""Runs of samples of which the same holds."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean

from dloftbs.kernels.compiler import kernel, read


@kernel(read(boolean, 1))
def find_runs(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """Find the runs of values that are True.

    Parameters
    ----------
    mask : (n,) bool

    Returns
    -------
    (k, 2) int64
        The first index of each, and the one after the last.
    """
    runs, count = np.empty((len(mask) // 2 + 1, 2), dtype=np.int64), 0
    for i in range(len(mask)):
        if mask[i]:
            if i == 0 or not mask[i - 1]:
                runs[count, 0] = i
                count += 1
            runs[count - 1, 1] = i + 1
    return runs[:count]
