"""Matching of found with true curves in one frame, with the missing and the redundant ones.

Nothing found is a value and not an error: a frame without curves has a mean of NaN and counts of the missing and the
redundant ones. Whoever averages over frames must sum the counts, too, or failures vanish from the table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from dloftbs.errors import InputError
from dloftbs.support.arrays import BoolArray, FloatArray, frozen
from dloftbs.support.values import shown
from dloftbs_lab.evaluation.curves import even_l3
from dloftbs_lab.evaluation.gate import check_gate
from dloftbs_lab.evaluation.traces import SAMPLES, CurveLike, align, check_dimensions, trace_of


@dataclass(frozen=True, eq=False)
class CurveDistances:
    """Every true curve against every found one.

    Parameters
    ----------
    l3 : numpy.ndarray, shape (true curves, found curves)
        Undirected L3, in the unit of the points.
    forward : numpy.ndarray, shape (true curves, found curves), bool
        Whether the found curve runs as the true one does, that is, whether this direction has the smaller L3.
    """

    l3: FloatArray
    forward: BoolArray


@dataclass(frozen=True)
class Pair:
    """A found curve and the true one that it was given to.

    Parameters
    ----------
    found, true : int
        Their positions in what was compared.
    l3 : float
        Undirected L3, in the unit of the points.
    forward : bool
        Whether the found curve runs as the true one does.
    """

    found: int
    true: int
    l3: float
    forward: bool


@dataclass(frozen=True)
class Matching:
    """The curves of a frame against the true ones.

    Parameters
    ----------
    pairs : tuple of Pair
        In the order of the true curves.
    unmatched_true, unmatched_found : tuple of int
        The positions of the curves that are in no pair.
    """

    pairs: tuple[Pair, ...]
    unmatched_true: tuple[int, ...]
    unmatched_found: tuple[int, ...]

    @property
    def missing(self) -> int:
        """Number of true curves that were not found."""
        return len(self.unmatched_true)

    @property
    def redundant(self) -> int:
        """Number of found curves that match no true one."""
        return len(self.unmatched_found)

    @property
    def l3(self) -> tuple[float, ...]:
        """Undirected L3 of each pair, in the unit of the points."""
        return tuple(pair.l3 for pair in self.pairs)

    @property
    def mean_l3(self) -> float:
        """Mean undirected L3 of the pairs; NaN without pairs."""
        return float(np.mean(self.l3)) if self.pairs else math.nan

    def clean(self, limit_px: float) -> bool:
        """Return whether the number of curves is right and each is within a limit of the true one.

        Parameters
        ----------
        limit_px : float
            The largest undirected L3 that still counts as right, in the unit of the points.
        """
        return not self.missing and not self.redundant and all(value <= limit_px for value in self.l3)


def match_curves(
    found: Sequence[CurveLike], true: Sequence[CurveLike], *, samples: int = SAMPLES, gate_px: float | None = None
) -> Matching:
    """Give every true curve at most one found one, so that the total undirected L3 is least.

    Parameters
    ----------
    found, true : sequence of BSplineCurve or array_like, shape (n, d)
        Either may be empty.
    samples : int
        Points along each curve, see `curve_l3`.
    gate_px : float, optional
        The largest undirected L3 of a pair, in the unit of the points (px in the image, m in space). See
        `match_distances`.

    Raises
    ------
    InputError
        As `curve_l3`, or if the gate is negative.
    """
    return match_distances(compare_curves(found, true, samples=samples), gate_px=gate_px)


def compare_curves(found: Sequence[CurveLike], true: Sequence[CurveLike], *, samples: int = SAMPLES) -> CurveDistances:
    """Return undirected L3 and the direction between every true and every found curve.

    Parameters
    ----------
    found, true : sequence of BSplineCurve or array_like, shape (n, d)
        Either may be empty. What holds for closed curves: see `curve_l3`.
    samples : int
        Points along each curve, see `curve_l3`.

    Raises
    ------
    InputError
        As `curve_l3`.
    """
    for name, curves in (("found", found), ("true", true)):
        _check_list(name, curves)
    found_traces, true_traces = (
        [trace_of(f"{name}[{i}]", curve, samples) for i, curve in enumerate(curves)]
        for name, curves in (("found", found), ("true", true))
    )
    distance = np.zeros((len(true), len(found)))
    forward = np.zeros((len(true), len(found)), dtype=np.bool_)
    for i, true_trace in enumerate(true_traces):
        for j, found_trace in enumerate(found_traces):
            check_dimensions(found_trace, true_trace)
            best = align(found_trace, true_trace, samples, even_l3, directed=False)
            distance[i, j], forward[i, j] = best.error, best.forward
    forward.flags.writeable = False
    return CurveDistances(frozen(distance), forward)


def _check_list(name: str, curves: object) -> None:
    if not (isinstance(curves, Sequence) or (isinstance(curves, np.ndarray) and curves.ndim > 0)):
        raise InputError(f"{name} must be a sequence of curves, got {shown(curves)}")


def match_distances(distances: CurveDistances, *, gate_px: float | None = None) -> Matching:
    """Return the assignment with the least total undirected L3.

    Parameters
    ----------
    distances : CurveDistances
    gate_px : float, optional
        The largest undirected L3 of a pair, in the unit of the points. One that is further off counts as one missing
        and one redundant curve, and the assignment takes it for the gate itself, so that a stray curve far away does
        not decide over the others: the sum of ``min(L3, gate)`` is least.

    Raises
    ------
    InputError
        If the gate is negative.
    """
    gate = math.inf if gate_px is None else check_gate("gate_px", gate_px)
    rows, columns = linear_sum_assignment(np.minimum(distances.l3, gate))
    pairs = tuple(
        Pair(int(j), int(i), float(distances.l3[i, j]), bool(distances.forward[i, j]))
        for i, j in zip(rows, columns, strict=True)
        if distances.l3[i, j] <= gate
    )
    true_count, found_count = distances.l3.shape
    return Matching(
        pairs,
        tuple(sorted(set(range(true_count)) - {pair.true for pair in pairs})),
        tuple(sorted(set(range(found_count)) - {pair.found for pair in pairs})),
    )
