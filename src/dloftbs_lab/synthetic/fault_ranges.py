"""Checks of the numbers that say how bad masks get: each fault of a class of them has a range."""

from __future__ import annotations

import math
from collections.abc import Iterable

from dloftbs.errors import InputError


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
