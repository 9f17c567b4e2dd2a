"""Statistics of durations, in memory that does not grow with their number."""

from __future__ import annotations

import math

ACCURACY = 0.01
"""Relative error of a percentile, at most: half the width of a bin."""
_MIN_MS, _MAX_MS = 1e-4, 1e7
_LOG_RATIO = math.log1p(2.0 * ACCURACY)
_BINS = math.ceil(math.log(_MAX_MS / _MIN_MS) / _LOG_RATIO)


class LatencyHistogram:
    """Counts durations in bins whose width is 2 % of their value, from 0.1 microseconds to nearly three hours.

    Examples
    --------
    >>> histogram = LatencyHistogram()
    >>> for ms in (1.0, 2.0, 3.0):
    ...     histogram.add(ms)
    >>> round(histogram.percentile(50), 1)
    2.0
    """

    def __init__(self) -> None:
        self._counts = [0] * _BINS
        self.count = 0
        self.sum_ms = 0.0
        self.max_ms = 0.0

    def add(self, ms: float) -> None:
        """Count a duration, clipped to the range of the bins."""
        index = int(math.log(max(ms, _MIN_MS) / _MIN_MS) / _LOG_RATIO)
        self._counts[min(index, _BINS - 1)] += 1
        self.count += 1
        self.sum_ms += ms
        self.max_ms = max(self.max_ms, ms)

    def percentile(self, percent: float) -> float:
        """Return the least duration that at least `percent` of all do not exceed, ms, to within 1 %; NaN without any.

        Parameters
        ----------
        percent : float
            In 0..100.
        """
        rank = max(1, math.ceil(percent / 100.0 * self.count))
        seen = 0
        for index, count in enumerate(self._counts):
            seen += count
            if seen >= rank:
                return min(_MIN_MS * math.exp((index + 0.5) * _LOG_RATIO), self.max_ms)
        return math.nan
