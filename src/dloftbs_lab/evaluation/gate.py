"""The largest distance at which two things can be the same."""

from __future__ import annotations

import math

from dloftbs.support.arrays import LARGEST
from dloftbs.support.values import check_number


def check_gate(name: str, gate: object) -> float:
    """Return a distance of at least 0, which may be infinite.

    Raises
    ------
    InputError
        If it is negative or no number.
    """
    endless = isinstance(gate, float) and gate == math.inf
    return math.inf if endless else check_number(name, gate, 0.0, LARGEST)
