"""The probability that a joint is right, and the gaps that are left open because they rather are not."""

from __future__ import annotations

import math

import numpy as np

from dloftbs.data.graph import branch_of
from dloftbs.linking.calibration import CROSSING, GAP
from dloftbs.linking.matched_ends import EndMatching

_MAX_LOG_ODDS = 50.0
"""Largest log-odds of a joint, nats.

Source: numerics; the exponential of more overflows, and beyond 37 the confidence is 1 to the last bit.
"""

EDGE_PX = 1.0
"""Addition to widths before they are compared, px.

Source: geometry; each of the two edges is known to half a pixel.
"""


def crossing_confidence(margin: float, cost: float, *, bounded: bool) -> float:
    """Return the probability that a joint through a junction is right.

    If bounded, its odds are at most those against the best alternative. A joint that costs more than this is as
    probable as that the alternative is wrong.
    """
    if margin < 0.0:
        return 1.0 - crossing_confidence(-margin, cost, bounded=bounded)
    none, per_margin, per_cost = CROSSING
    log_odds = none + per_margin * margin + per_cost * cost
    return _probability(min(log_odds, margin if bounded else math.inf))


class Gaps:
    """The confidence of gaps between ends of one matching; what lies behind an end is measured once.

    Parameters
    ----------
    matching : EndMatching
        Not to be changed as long as this is asked.
    width : float
        Width of the cables in the graph, px.
    """

    def __init__(self, matching: EndMatching, width: float) -> None:
        self._matching, self._width = matching, width
        self._sides: dict[int, tuple[int, float]] = {}

    def confidence(self, i: int, j: int, margin: float) -> float:
        """Return the probability that a gap between two ends, joined or open, is right.

        The margin is the gain over the best alternative, nats, negative where that costs less. The odds are at most
        those of the margin.
        """
        return _probability(min(gap_log_odds(margin, *self.describe(i, j)), margin))

    def describe(self, i: int, j: int) -> tuple[float, float]:
        """Return `seen` and `taper` of a gap between two ends, as `gap_log_odds` takes them."""
        (length, width), (other_length, other_width) = self._side(i), self._side(j)
        return math.log(max(length, other_length) / self._width), taper_of(width, other_width)

    def _side(self, end: int) -> tuple[int, float]:
        """Return the length in points of the cable behind an end, and the width of its first branch, px."""
        side = self._sides.get(end)
        if side is None:
            side = self._sides[end] = _length_from(self._matching, end), usual_width(self._matching, end)
        return side


def gap_log_odds(margin: float, seen: float, taper: float) -> float:
    """Return the log-odds of a gap by its margin, which knows its cost, and by what it joins.

    Parameters
    ----------
    margin : float
        nats.
    seen : float
        Logarithm of the length of the longer side, in widths: what is hardly longer than wide is rather whole.
    taper : float
        As `taper_of` measures it: cables do not change their width.
    """
    none, per_margin, per_seen, per_taper = GAP
    return none + per_margin * margin + per_seen * seen + per_taper * taper


def _length_from(matching: EndMatching, end: int) -> int:
    """Return the number of points of a cable from one end of a branch on, through that branch and all that follow."""
    spans = matching.branches.spans
    return max(sum(spans[branch_of(at)][1] - spans[branch_of(at)][0] for at in matching.chain(end)), 1)


def usual_width(matching: EndMatching, end: int) -> float:
    """Return the median width, px, of the branch at an end over its middle two thirds; masks get thin at gaps."""
    start, stop = matching.branches.spans[branch_of(end)]
    if start == stop:  # all its points lie in the junctions at its ends
        return 0.0
    aside = (stop - start) // 6
    return 2.0 * float(np.median(matching.branches.radius[start + aside : stop - aside]))


def taper_of(width: float, other: float) -> float:
    """Return how much two widths, px, differ: the absolute logarithm of their ratio, each a pixel wider."""
    return abs(math.log((width + EDGE_PX) / (other + EDGE_PX)))


def open_doubtful_gaps(matching: EndMatching, width: float, least: float) -> None:
    """Leave gaps open that are less probable than a least probability, each end with the other as its near joint.

    All are judged before the first one is opened, so that none depends on the order.

    Parameters
    ----------
    matching : EndMatching
        Changed.
    width : float
        Width of the cables, px.
    least : float
        In 0..1; at 0 all stay.
    """
    if least <= 0.0:
        return
    gaps = [(i, j) for i, j in enumerate(matching.partner) if j > i and not matching.is_crossing(i)]
    judged = Gaps(matching, width)
    doubtful = [i for i, j in gaps if judged.confidence(i, j, matching.margin[i]) < least]
    for i in doubtful:
        matching.leave_open(i)


def _probability(log_odds: float) -> float:
    return 1.0 / (1.0 + math.exp(-min(log_odds, _MAX_LOG_ODDS)))
