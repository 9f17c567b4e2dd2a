"""Ramps: from full to nothing in a straight line, so that no threshold makes a jump."""

from __future__ import annotations

from dloftbs.kernels.compiler import inlined


@inlined
def ramp_down(value: float, full: float, none: float) -> float:
    """Return 1 up to `full`, 0 from `none` on, and linearly in between."""
    return min(max((none - value) / (none - full), 0.0), 1.0)
