"""Constants of the Gaussian distribution."""

from __future__ import annotations

MEDIAN_DEVIATION = 0.6745
"""Median of the absolute deviations from the mean, in standard deviations: the quantile of 3/4."""

MEAN_DEVIATION = 0.7979
"""Mean of the absolute deviations from the mean, in standard deviations: the root of 2 / pi."""
