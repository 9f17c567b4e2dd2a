"""A family of cases: how one is drawn, and what must hold of it."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

SUITE_SEED = 0
"""The seed of the normal suite."""


@dataclass(frozen=True)
class Family:
    """Cases of one kind: first the fixed ones, each of which was a finding once, then those drawn from a seed.

    Parameters
    ----------
    name : str
    make : callable
        From a random generator to a case, which depends on nothing else.
    check : callable
        From a case and an empty folder to nothing; raises where something is wrong.
    cases : int
        How many are drawn in the normal suite.
    fixed : mapping of str to case
        By what they are.
    """

    name: str
    make: Callable[[np.random.Generator], Any]
    check: Callable[[Any, Path], None]
    cases: int
    fixed: Mapping[str, Any] = field(default_factory=dict)

    @property
    def suite_cases(self) -> int:
        """How many cases the normal suite runs."""
        return len(self.fixed) + self.cases

    def case(self, seed: int, number: int) -> Any:
        """Return a case by its number; the fixed ones come first and are the same for all seeds."""
        if number < len(self.fixed):
            return list(self.fixed.values())[number]
        return self.make(np.random.default_rng([seed, zlib.crc32(self.name.encode()), number]))
