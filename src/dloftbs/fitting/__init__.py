"""Centre lines to cubic B-splines."""

from __future__ import annotations

from dloftbs.fitting.on_mask import keep_to_mask
from dloftbs.fitting.spline_fit import distinct_knots, fit, fit_with_knots

__all__ = ["distinct_knots", "fit", "fit_with_knots", "keep_to_mask"]
