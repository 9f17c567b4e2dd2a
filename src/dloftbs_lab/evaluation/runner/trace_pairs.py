"""All pairs of found and true curves of a frame, compared in one compiled call."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from dloftbs.support.arrays import frozen
from dloftbs_lab.evaluation.curve_matching import CurveDistances
from dloftbs_lab.evaluation.curves import even_l3
from dloftbs_lab.evaluation.kernels.side_distances import measure_pairs
from dloftbs_lab.evaluation.traces import SAMPLES, Trace, align, check_dimensions


def compare_traces(found: Sequence[Trace], true: Sequence[Trace], *, samples: int = SAMPLES) -> CurveDistances:
    """Return what `dloftbs_lab.evaluation.compare_curves` does, to the last bit, for curves as dense polylines.

    A polyline keeps the points that are compared: where one is compared several times, they are made once.

    Raises
    ------
    InputError
        If one is in the plane and one in space.
    """
    for found_trace, true_trace in product(found, true):
        check_dimensions(found_trace, true_trace)
    distance = np.zeros((len(true), len(found)))
    forward = np.zeros((len(true), len(found)), dtype=np.bool_)
    open_found, open_true = ([i for i, trace in enumerate(traces) if not trace.closed] for traces in (found, true))
    if open_found and open_true:
        both_ways = np.array(
            [[trace.resampled(samples) for trace in (found[j], found[j].backwards)] for j in open_found]
        )
        points = np.array([true[i].resampled(samples) for i in open_true])
        of_points = np.empty((len(points), len(both_ways), 2, 2, samples))
        measure_pairs(both_ways, points, of_points)
        sums = of_points.mean(axis=-1).sum(axis=-1) / 2.0  # `even_l3`
        those = np.ix_(open_true, open_found)
        distance[those], forward[those] = sums.min(axis=-1), sums[..., 0] <= sums[..., 1]
    for (i, true_trace), (j, found_trace) in product(enumerate(true), enumerate(found)):
        if true_trace.closed or found_trace.closed:
            best = align(found_trace, true_trace, samples, even_l3, directed=False)
            distance[i, j], forward[i, j] = best.error, best.forward
    forward.flags.writeable = False
    return CurveDistances(frozen(distance), forward)
