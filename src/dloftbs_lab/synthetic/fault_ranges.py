"""Base of the faults of masks, and checks of the numbers that say how bad they get: each fault has a range."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, ClassVar, TypeVar

import numpy as np
import numpy.typing as npt

from dloftbs.data.curve import BSplineCurve
from dloftbs.errors import InputError

Mask = npt.NDArray[np.bool_]
F = TypeVar("F", bound="Faults")


class Faults(ABC):
    """Faults of masks; a subclass is a dataclass of their amounts, and names those that are lengths and ranges of them.

    What happens to a mask depends on the ``key``, a sequence of int such as seed and index: the same one gives the same
    result. Curves are the true centre lines, px, and sizes ``(H, W)``.
    """

    name: str
    """For the names of sequences."""
    _LENGTHS: ClassVar[tuple[str, ...]]
    _RANGES: ClassVar[tuple[str, ...]]

    def scaled(self: F, factor: float) -> F:
        """Return the same for an image `factor` times as large: lengths are scaled, counts and shares are not."""
        lengths: dict[str, Any] = {name: tuple(end * factor for end in getattr(self, name)) for name in self._RANGES}
        lengths |= {name: getattr(self, name) * factor for name in self._LENGTHS}
        return replace(self, **lengths)  # type: ignore[type-var]  # all of them are dataclasses

    @property
    @abstractmethod
    def hides(self) -> bool:
        """Whether a part of a cable may be missing."""

    @abstractmethod
    def hidden(self, curves: Sequence[BSplineCurve], size: tuple[int, int], key: Sequence[int]) -> Mask:
        """Return where cables are missing, shape (H, W)."""

    def apply(self, mask: npt.ArrayLike, curves: Sequence[BSplineCurve], key: Sequence[int]) -> Mask:
        """Return a mask (H, W), of which any non-zero is cable, with the faults; `mask` is left as it is."""
        seen = np.array(mask, dtype=bool)
        if self.hides:
            seen &= ~self.hidden(curves, (seen.shape[0], seen.shape[1]), key)
        return self._spoil(seen, curves, key)

    @abstractmethod
    def _spoil(self, seen: Mask, curves: Sequence[BSplineCurve], key: Sequence[int]) -> Mask:
        """Return what shows (H, W), in place or not, with all other faults."""


def check_amounts(faults: object, names: Iterable[str], most: float = math.inf) -> None:
    """Let only finite numbers from 0 to `most` pass.

    Raises
    ------
    InputError
        If an attribute of these names is another one.
    """
    for name in names:
        value = getattr(faults, name)
        if not (math.isfinite(value) and 0.0 <= value <= most):
            allowed = "that is not negative" if math.isinf(most) else f"in 0..{most:g}"
            raise InputError(f"{name} must be a number {allowed}, got {value}")


def check_lengths(faults: object, names: Iterable[str], below_px: float = math.inf) -> None:
    """Let only positive numbers below a length pass.

    Raises
    ------
    InputError
        If an attribute of these names is another one.
    """
    for name in names:
        value = getattr(faults, name)
        if not 0.0 < value < below_px:
            limit = "" if math.isinf(below_px) else f" and below {below_px:g}"
            raise InputError(f"{name} must be positive{limit}, got {value}")


def check_ranges(faults: object, names: Iterable[str], below_px: float = math.inf) -> None:
    """Let only pairs of positive numbers below a length pass, the lower one first.

    Raises
    ------
    InputError
        If an attribute of these names is another pair.
    """
    for name in names:
        low, high = getattr(faults, name)
        if not 0.0 < low <= high < below_px:
            limit = "" if math.isinf(below_px) else f" below {below_px:g}"
            raise InputError(f"{name} must be a positive range{limit}, low before high, got {(low, high)}")
