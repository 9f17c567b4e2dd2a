"""Distances from the visible part of the truth: an end behind a hand or out of the image is nobody's fault."""

from __future__ import annotations

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.evaluation.curve_matching import CurveDistances
from dloftbs_lab.evaluation.runner.found import Found
from dloftbs_lab.evaluation.runner.known_frame import KnownFrame, SpaceLine
from dloftbs_lab.evaluation.runner.trace_pairs import compare_traces
from dloftbs_lab.evaluation.traces import Trace


def distances_of(found: Found, known: KnownFrame) -> tuple[CurveDistances, FloatArray]:
    """Return the L3 of every found curve from every true one: from its whole or its visible extent, the nearer one.

    Returns
    -------
    nearer : CurveDistances
    whole : numpy.ndarray, shape (true, found)
        The L3 from the whole curve in every case, as the paper defines it.
    """
    whole = compare_traces(found.traces, known.traces)
    l3, forward = whole.l3.copy(), whole.forward.copy()
    partly = [i for i, extent in enumerate(known.extents) if extent is not None]
    visible = compare_traces(found.traces, [extent for extent in known.extents if extent is not None])
    for row, i in enumerate(partly):
        nearer = visible.l3[row] < l3[i]
        l3[i, nearer], forward[i, nearer] = visible.l3[row, nearer], visible.forward[row, nearer]
    return CurveDistances(l3, forward), whole.l3


def in_space(found: Trace, length_m: float, true: SpaceLine) -> tuple[float, float]:
    """Return the L3 in metres, and the share by which the length is off, of a curve from a true line in space.

    From the whole or the visible extent of `true`, where the L3 is smaller.
    """
    l3 = compare_traces([found], true.traces).l3[:, 0].tolist()
    return min((error, abs(length_m - true_m) / true_m) for error, true_m in zip(l3, true.lengths_m, strict=True))
