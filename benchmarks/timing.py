"""Timing functions against each other, so that a busy machine slows all of them alike, and the tables of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from time import perf_counter

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

_NAME = 34
_UNSTEADY = 2.0
UNSTEADY = f"  ! p99 is above {_UNSTEADY:g} times the median"
"""What the mark says; below any table that has one."""


def interleaved(functions: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, Floats]:
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


class Table:
    """Rows of times, printed as they come: p50, p99, and p50 as a ratio to that of each reference.

    Parameters
    ----------
    title : str
    references : dict of str to numpy.ndarray
        Times, by the name of their column.
    whole : numpy.ndarray, optional
        Times of what the rows are parts of: there is a column of shares in them then.
    """

    def __init__(self, title: str, references: Mapping[str, Floats], whole: Floats | None = None) -> None:
        self._references = {name: float(np.median(times)) for name, times in references.items()}
        self._whole = whole
        self._unsteady = False
        share = "" if whole is None else f"{'share':>8}"
        ratios = "".join(f"{'/ ' + name:>10}" for name in references)
        print(f"{title:<{_NAME}}{'p50 ms':>9}{'p99 ms':>9}{share}{ratios}")

    def row(self, name: str, milliseconds: Floats, *, part: bool = False) -> None:
        """Print a row; `part` says whether it is one of the whole, and not beside it."""
        p50, p99 = np.percentile(milliseconds, (50, 99))
        unsteady = p99 > _UNSTEADY * p50
        self._unsteady |= bool(unsteady)
        share = "" if self._whole is None else f"{_percent(milliseconds, self._whole) if part else '':>8}"
        ratios = "".join(f"{p50 / reference:>10.3f}" for reference in self._references.values())
        print(f"{name:<{_NAME}}{p50:>9.3f}{p99:>9.3f}{share}{ratios}{' !' if unsteady else ''}", flush=True)

    def end(self) -> None:
        """Explain the mark where there is one."""
        if self._unsteady:
            print(UNSTEADY)
        print()


def _percent(part: Floats, whole: Floats) -> str:
    """Return the share of sums, so that all parts add up to the whole."""
    return f"{100.0 * part.sum() / whole.sum():.1f} %"
