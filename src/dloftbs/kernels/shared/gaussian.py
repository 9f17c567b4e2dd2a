"""Constants of the Gaussian distribution."""

from __future__ import annotations

MEDIAN_DEVIATION = 0.6745
"""Median of the absolute deviations from the mean, in standard deviations: the quantile of 3/4."""
