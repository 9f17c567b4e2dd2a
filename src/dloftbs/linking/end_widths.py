"""Widths of branches at their ends, as evidence of which of them are one cable: its width changes little along it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dloftbs.data.graph import branch_of, is_start
from dloftbs.linking.matched_ends import Branches

_REACH_WIDTHS = 4.0
"""Length of a branch over which its width is fitted, widths.

Source: measured; two and six distinguish branches of recorded motion as well.
"""

_LEAST_WIDTHS = 3.0
"""Least length of a branch whose width counts, widths.

Source: by hand; a shorter one lies in the corners of what meets there.
"""

_DIFFERENCE = 0.045
"""Mean difference of the widths of a thick cable at two ends that are joined, a logarithm of their ratio.

Source: measured; 4,200 joints of two to four cables in recorded motion, 3 to 12 px wide.
"""


def gain_by_width(branches: Branches, before: Sequence[int], after: Sequence[int], width: float) -> float:
    """Return by how much widths are for it that two cables leave their shared branches the other way round, nats.

    Differences of one cable have a Laplace distribution, the wider the noisier the edges are. Nothing is known where a
    branch is short, or shared itself.

    Parameters
    ----------
    branches : Branches
    before, after : sequence of int
        The two ends at which the cables come in, and those at which they leave, in the order of the cables.
    width : float
        Width of the cables, px.
    """
    (a, b, c, d), noises = zip(*[_measure(branches, end, width) for end in (*before, *after)], strict=True)
    scale = _DIFFERENCE + sum(noises) / len(noises)
    gain = (abs(a - c) + abs(b - d) - abs(a - d) - abs(b - c)) / scale
    return 0.0 if math.isnan(gain) else gain


def _measure(branches: Branches, end: int, width: float) -> tuple[float, float]:
    """Return the logarithm of a branch's width at its end, px, by a line, and its deviation; NaN where not known."""
    branch = branch_of(end)
    start, stop = branches.spans[branch]
    if branch in branches.duplicate_of or stop - start < _LEAST_WIDTHS * width:
        return math.nan, math.nan
    reach = min(int(_REACH_WIDTHS * width), stop - start)
    widths = 2.0 * (
        branches.radius[start : start + reach] if is_start(end) else branches.radius[stop - reach : stop][::-1]
    )
    along = np.arange(len(widths)) - 0.5 * (len(widths) - 1)
    slope = float(along @ widths) / float(along @ along)
    at_end = max(float(widths.mean()) + slope * float(along[0]), float(widths.min()))
    return math.log(at_end), float((widths - widths.mean() - slope * along).std()) / at_end
