"""Timing functions against each other, so that a busy machine slows all of them alike."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from time import perf_counter

import numpy as np
import numpy.typing as npt


def interleaved(functions: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, npt.NDArray[np.float64]]:
    """Call each function once a round, in turn, after two calls that are not counted.

    Returns
    -------
    dict of str to numpy.ndarray, shape (rounds,)
        Milliseconds.
    """
    times = {name: np.empty(rounds) for name in functions}
    for turn in range(-2, rounds):
        for name, function in functions.items():
            start = perf_counter()
            function()
            if turn >= 0:
                times[name][turn] = 1e3 * (perf_counter() - start)
    return times


def row(name: str, milliseconds: npt.NDArray[np.float64], *references: float) -> str:
    """Return a table's row: p50, p99, and p50 as a share of each reference."""
    p50, p99 = np.percentile(milliseconds, (50, 99))
    shares = "".join(f"{p50 / reference:>11.3f}" for reference in references)
    return f"{name:<34}{p50:>9.3f}{p99:>9.3f}{shares}"
