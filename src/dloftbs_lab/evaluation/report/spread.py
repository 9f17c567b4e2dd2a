"""Figures with their intervals: bootstrap over scenes, since the frames of one scene are no sample."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from dloftbs.support.arrays import FloatArray, frozen
from dloftbs_lab.evaluation.report.table import Cell, Estimate
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Part

RESAMPLES = 1000
"""Number of bootstrap samples of an interval."""
COVERAGE = 0.95
"""Share of the bootstrap samples that an interval holds."""
_SEED = 0

NOTE = (
    f"In brackets: {COVERAGE:.0%} interval, percentiles of {RESAMPLES} bootstrap samples of whole scenes, over which "
    "the figure is taken again. Frames of one scene, and the same scene with other noise, are drawn together. If "
    "all scenes agree, the interval has no width. Of n scenes without a failure, the true rate is below 3 / n."
)
"""Note on intervals, for readers of tables."""

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Sample(Generic[T]):
    """Items, such as frames or sequences, with the scene that each belongs to.

    Parameters
    ----------
    items : tuple
    scenes : tuple of hashable
        One for each item; those of equal scenes are resampled together.
    """

    items: tuple[T, ...]
    scenes: tuple[Hashable, ...]

    def __len__(self) -> int:
        return len(self.items)

    @property
    def count(self) -> int:
        """Number of different scenes."""
        return len(self._numbering[0])

    def total(self, value: Callable[[T], float]) -> float:
        """Return the sum over all items, without an interval: it grows with the number of scenes."""
        return sum(map(value, self.items))

    def mean(self, value: Callable[[T], float | None], factor: float = 1.0) -> Estimate | float | None:
        """Return the mean of those that exist times a factor, with its interval; None where none does."""
        return self.ratio(lambda item: value(item) or 0.0, lambda item: float(value(item) is not None), factor)

    def ratio(
        self, top: Callable[[T], float], bottom: Callable[[T], float], factor: float = 1.0, offset: float = 0.0
    ) -> Estimate | float | None:
        """Return ``offset + factor * sum(top) / sum(bottom)`` with its interval; None where the second sum is 0.

        Without an interval where there is one scene alone.
        """
        tops, bottoms = (self._sums(of) for of in (top, bottom))
        if not bottoms.sum():
            return None
        value = offset + factor * float(tops.sum() / bottoms.sum())
        if self.count < 2:
            return value
        drawn_tops, drawn_bottoms = (draws(self.count) @ sums for sums in (tops, bottoms))
        known = drawn_bottoms > 0.0
        return _estimate(value, offset + factor * drawn_tops[known] / drawn_bottoms[known])

    def quantile(self, value: Callable[[T], float | None], share: float = 0.5) -> Estimate | float | None:
        """Return the value below which a share of those that exist lies, with its interval; None where none does."""
        pairs = sorted((known, i) for i, item in enumerate(self.items) if (known := value(item)) is not None)
        if not pairs:
            return None
        values = np.array([known for known, _ in pairs])
        result = float(values[min(int(share * len(values)), len(values) - 1)])
        if self.count < 2:
            return result
        weights = draws(self.count)[:, self._numbering[1][[i for _, i in pairs]]].cumsum(axis=1)
        drawn = weights[:, -1] > 0.0
        below = weights[drawn] <= np.floor(share * weights[drawn, -1:])
        return _estimate(result, values[below.sum(axis=1).clip(max=len(values) - 1)])

    @cached_property
    def _numbering(self) -> tuple[dict[Hashable, int], npt.NDArray[np.intp]]:
        """Numbers of the scenes as they come up first, and the number of each item's scene."""
        numbers = {scene: number for number, scene in enumerate(dict.fromkeys(self.scenes))}
        return numbers, np.array([numbers[scene] for scene in self.scenes], np.intp)

    def _sums(self, value: Callable[[T], float]) -> FloatArray:
        """Return the sum over each scene, shape (scenes,)."""
        values = np.array([float(value(item)) for item in self.items])
        return np.bincount(self._numbering[1], values, self.count).astype(np.float64)


def frames_of(parts: Iterable[Part]) -> Sample[FrameRow]:
    """Return the frames of all parts with their scenes."""
    rows = [row for part in parts for row in part.rows]
    return Sample(tuple(rows), tuple(row.scene for row in rows))


def sequences_of(parts: Sequence[Part]) -> Sample[Part]:
    """Return the parts with the scenes of their sequences."""
    return Sample(tuple(parts), tuple(part.scene for part in parts))


def grouped(
    parts: Iterable[Part],
    group: Mapping[str, Callable[[Part], Cell]],
    figures: Mapping[str, Callable[[Sample[T]], Cell]],
    sample: Callable[[Sequence[Part]], Sample[T]],
) -> tuple[tuple[str, ...], tuple[tuple[Cell, ...], ...]]:
    """Return the columns of a table and its rows: one for each group of parts, as they come up first.

    Parameters
    ----------
    parts : iterable of Part
    group, figures : mapping of str to callable
        From the title of a column to what stands in it: what the parts of a group have in common, and its figures.
    sample : callable
        From the parts of a group to what the figures are of.
    """
    groups: dict[tuple[Cell, ...], list[Part]] = {}
    for part in parts:
        groups.setdefault(tuple(of(part) for of in group.values()), []).append(part)
    samples = {names: sample(of_group) for names, of_group in groups.items()}
    rows = tuple((*names, *(figure(one) for figure in figures.values())) for names, one in samples.items())
    return (*group, *figures), rows


@functools.cache
def draws(scenes: int) -> FloatArray:
    """Return how often each bootstrap sample has each scene, shape (RESAMPLES, scenes): the same in every run."""
    rng = np.random.default_rng([_SEED, scenes])
    return frozen(rng.multinomial(scenes, np.full(scenes, 1.0 / scenes), RESAMPLES).astype(np.float64))


def _estimate(value: float, drawn: FloatArray) -> Estimate | float:
    if not len(drawn):
        return value
    # An order statistic of what was drawn, so that endless errors have no mean.
    low, high = np.quantile(drawn, ((1.0 - COVERAGE) / 2.0, (1.0 + COVERAGE) / 2.0), method="nearest").tolist()
    return Estimate(value, min(low, value), max(high, value)) if math.isfinite(value) else value
