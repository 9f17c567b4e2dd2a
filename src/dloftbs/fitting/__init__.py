"""Centre lines to cubic B-splines."""

from __future__ import annotations

from dloftbs.fitting.seen_joints import mark_unseen_joints
from dloftbs.fitting.spline_fit import distinct_knots, fit, fit_with_knots

__all__ = ["distinct_knots", "fit", "fit_with_knots", "mark_unseen_joints"]
