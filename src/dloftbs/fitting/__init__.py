"""Centre lines to cubic B-splines, and where these cross."""

from __future__ import annotations

from dloftbs.fitting.crossings.curve_crossings import find_crossings
from dloftbs.fitting.on_mask import keep_to_mask
from dloftbs.fitting.spline_fit import distinct_knots, fit, fit_with_knots

__all__ = ["distinct_knots", "find_crossings", "fit", "fit_with_knots", "keep_to_mask"]
