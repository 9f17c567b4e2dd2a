"""Widths of branches at their ends, as evidence of which of them are one cable: its width changes little along it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dloftbs.data.graph import branch_of, is_start
from dloftbs.linking.matched_ends import Branches

_DIFFERENCE = 0.045
"""Mean difference of the widths of a thick cable at two ends that are joined, a logarithm of their ratio.

Source: measured; 4,200 joints of two to four cables in recorded motion, 3 to 12 px wide.
"""


def gain_by_width(branches: Branches, before: Sequence[int], after: Sequence[int], reach: int) -> float:
    """Return the log-odds, by widths, that two cables leave their shared branches the other way round, nats.

    Differences of one cable have a Laplace distribution, the wider the noisier the edges are.

    Parameters
    ----------
    branches : Branches
    before, after : sequence of int
        The two ends at which the cables come in, and those at which they leave, in the order of the cables.
    reach : int
        Number of points of a branch over which its width is fitted, at least 2. Nothing is known of a shorter branch,
        nor of a shared one.
    """
    (a, b, c, d), deviations = zip(*[_measure(branches, end, reach) for end in (*before, *after)], strict=True)
    scale = _DIFFERENCE + sum(deviations) / len(deviations)
    gain = (abs(a - c) + abs(b - d) - abs(a - d) - abs(b - c)) / scale
    return 0.0 if math.isnan(gain) else gain


def _measure(branches: Branches, end: int, reach: int) -> tuple[float, float]:
    """Return the logarithm of a branch's width at its end, px, by a line, and the deviation from it; NaN if unknown."""
    branch = branch_of(end)
    start, stop = branches.spans[branch]
    if branch in branches.duplicate_of or stop - start < reach:
        return math.nan, math.nan
    radius = branches.radius[start : start + reach] if is_start(end) else branches.radius[stop - reach : stop][::-1]
    widths, along = 2.0 * radius, np.arange(reach) - 0.5 * (reach - 1)
    slope = float(along @ widths) / float(along @ along)
    at_end = max(float(widths.mean()) + slope * float(along[0]), float(widths.min()))
    return math.log(at_end), float((widths - widths.mean() - slope * along).std()) / at_end
