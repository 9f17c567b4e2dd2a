"""Curves of a view that are put together: the parts of one that is interrupted, and the turns of a loop."""

from __future__ import annotations

import math

import numpy as np

from dloftbs.stereo.view_curves import ViewCurve


def nodes_between(first: ViewCurve, second: ViewCurve) -> int:
    """Return the number of nodes in the gap between two curves, one after the other."""
    step = math.dist(first.nodes[-1], first.nodes[-2])
    return max(round(math.dist(first.nodes[-1], second.nodes[0]) / step) - 1, 0)


def joined(first: ViewCurve, second: ViewCurve) -> ViewCurve:
    """Return two curves, one after the other, with nodes on a straight line between them and no observations there."""
    start, end = first.nodes[-1], second.nodes[0]
    between = nodes_between(first, second)
    share = np.arange(1, between + 1)[:, None] / (between + 1)
    widths = np.interp(share.ravel(), (0.0, 1.0), (first.widths[-1], second.widths[0]))
    return ViewCurve(
        np.concatenate((first.nodes, start + share * (end - start), second.nodes)),
        np.concatenate((first.widths, widths, second.widths)),
        np.concatenate((first.shown, np.zeros(between, bool), second.shown)),
        np.concatenate((first.places, second.places + len(first.nodes) + between)),
        np.concatenate((first.rows, second.rows)),
        False,
        None,
    )


def unrolled(loop: ViewCurve, before: int, after: int) -> ViewCurve:
    """Return a loop as an open curve, with so many more nodes before its start and after its end."""
    turn = len(loop.nodes) - 1
    nodes = np.arange(-before, turn + after + 1) % turn
    turns = range(-math.ceil(before / turn), math.ceil(after / turn) + 1)
    places = np.concatenate([loop.places + number * turn for number in turns]) + before
    rows = np.concatenate([loop.rows] * len(turns))
    inside = (places >= 0.0) & (places <= len(nodes) - 1)
    return ViewCurve(
        loop.nodes[nodes], loop.widths[nodes], loop.shown[nodes], places[inside], rows[inside], False, loop.problem
    )
