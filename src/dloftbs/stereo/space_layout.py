"""Places of what all views show of an object along it, and its rough depth: what the fit in space sets out from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dloftbs.stereo.curve_parts import unrolled
from dloftbs.stereo.kernels.epipolar_paths import correspond
from dloftbs.stereo.space_fit import Sight
from dloftbs.stereo.view_curves import ViewCurve
from dloftbs.stereo.view_groups import Group, RigGeometry
from dloftbs.support.arrays import FloatArray


class Layout(NamedTuple):
    """An object before it is fitted.

    Parameters
    ----------
    nodes : numpy.ndarray, shape (n, 2)
        Rays of one view along the object, evenly spaced; of a loop, along one and a half turns.
    inverse_depths, weights : numpy.ndarray, shape (n,)
        Roughly, as `correspond` returns them.
    sights : list of Sight
    """

    nodes: FloatArray
    inverse_depths: FloatArray
    weights: FloatArray
    sights: list[Sight]


class _Partner(NamedTuple):
    """A curve of another view along the one of the first view, in its nodes."""

    view: int
    start: int
    inverse_depths: FloatArray
    weights: FloatArray
    at: FloatArray
    rows: FloatArray


def lay_out(group: Group, first: int, geometry: RigGeometry) -> Layout | None:
    """Return the layout of an object along its curve in one view, as far as another view shows it; None for none."""
    a = group.curves[first]
    if a.closed:
        return _lay_out_loop(group, first, geometry)
    partners = [_partner(a, own, first, view, geometry) for view, own in group.curves.items() if view != first]
    low = min(one.start for one in partners)
    high = max(one.start + len(one.weights) - 1 for one in partners)
    if high <= low:
        return None
    depths, weights = np.zeros(high - low + 1), np.zeros(high - low + 1)
    sights = [Sight(first, (a.places - low) / (high - low), a.rows)]
    for one in partners:
        own = slice(one.start - low, one.start - low + len(one.weights))
        depths[own] += one.weights * one.inverse_depths
        weights[own] += one.weights
        sights.append(Sight(one.view, (one.at - low) / (high - low), one.rows))
    return Layout(a.nodes[low : high + 1], _mean(depths, weights), weights, sights)


def _lay_out_loop(group: Group, first: int, geometry: RigGeometry) -> Layout | None:
    """Return the layout of a loop along one and a half turns, which comes again in the last third of them."""
    a = group.curves[first]
    turn = len(a.nodes) - 1
    depths, weights = np.zeros(turn), np.zeros(turn)
    sights = [_around(first, a.places, a.rows, turn)]
    for view, own in group.curves.items():
        if view == first:
            continue
        # Wherever its partner begins, three turns have a whole one of it in their midst.
        b = unrolled(own, turn, turn) if own.closed else own
        one = _partner(unrolled(a, turn, turn), b, first, view, geometry)
        at = (np.arange(len(one.weights)) + one.start) % turn
        np.add.at(depths, at, one.weights * one.inverse_depths)
        np.add.at(weights, at, one.weights)
        inside = (one.at >= turn) & (one.at < 2 * turn) if own.closed else one.at >= 0.0
        sights.append(_around(view, one.at[inside], one.rows[inside], turn))
    again = np.arange(-turn // 4, turn + turn // 4 + 1) % turn
    return Layout(a.nodes[again], _mean(depths, weights)[again], weights[again], sights)


def _partner(a: ViewCurve, b: ViewCurve, first: int, view: int, geometry: RigGeometry) -> _Partner:
    """Return where the second curve lies along the first one; what has no partner there is at -inf."""
    pose = geometry.steps[first][view]
    start, depths, weights, partners = correspond(
        a.nodes, b.nodes, a.widths, b.widths, pose.rotation, pose.shift, geometry.epipolar_std(first) ** 2
    )
    # Between two parts of a curve nobody knows where it is.
    known = a.shown[start : start + len(weights)] & b.shown[np.rint(partners).astype(np.intp)]
    order = np.argsort(partners, kind="stable")
    at = np.interp(b.places, partners[order], order + start, left=-np.inf, right=-np.inf)
    return _Partner(view, start, depths, weights * known, at, b.rows)


def _around(view: int, at: FloatArray, rows: FloatArray, turn: int) -> Sight:
    """Return what a view shows of a loop, at places in nodes, wherever it comes again in one and a half turns."""
    t = (at % turn + turn // 4) / (turn + 2 * (turn // 4))
    again = turn / (turn + 2 * (turn // 4))
    return Sight(view, np.concatenate((t - again, t, t + again)), np.concatenate((rows, rows, rows)))


def _mean(sums: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the weighted means whose sums are given, 0 where nothing has a weight."""
    return np.divide(sums, weights, out=np.zeros(len(sums)), where=weights > 0.0)
