"""All pairs in one call: pair by pair is the slow twin."""

from __future__ import annotations

import numpy as np
import pytest
from builders import curve_through, loop

from dloftbs.errors import InputError
from dloftbs_lab.evaluation import compare_curves
from dloftbs_lab.evaluation.runner.trace_pairs import compare_traces
from dloftbs_lab.evaluation.traces import trace_of

SAMPLES = 60


def traces(curves):
    return [trace_of("a curve", curve, SAMPLES) for curve in curves]


@pytest.mark.parametrize("ndim", [2, 3])
@pytest.mark.parametrize("counts", [(3, 4), (1, 1), (0, 2), (2, 0), (0, 0)])
def test_it_is_pair_by_pair_to_the_last_bit(ndim, counts):
    rng = np.random.default_rng(sum(counts))
    found, true = ([np.cumsum(rng.normal(size=(30, ndim)), axis=0) for _ in range(n)] for n in counts)
    slow, fast = (
        compare_curves(found, true, samples=SAMPLES),
        compare_traces(traces(found), traces(true), samples=SAMPLES),
    )
    np.testing.assert_array_equal(fast.l3, slow.l3)
    np.testing.assert_array_equal(fast.forward, slow.forward)


def test_loops_among_the_curves_begin_where_they_fit():
    ring = loop(50.0, start=0.3)
    line = curve_through([(-50.0, 0.0), (-10.0, 30.0), (20.0, 20.0), (50.0, 0.0)])
    found, true = [line, ring], [ring.reversed(), line.reversed()]
    slow, fast = (
        compare_curves(found, true, samples=SAMPLES),
        compare_traces(traces(found), traces(true), samples=SAMPLES),
    )
    np.testing.assert_array_equal(fast.l3, slow.l3)
    np.testing.assert_array_equal(fast.forward, slow.forward)
    assert not fast.forward[0, 1]
    assert not fast.forward[1, 0]


def test_curves_in_the_plane_and_in_space_do_not_compare():
    with pytest.raises(InputError, match="the same dimension"):
        compare_traces(traces([np.eye(2)]), traces([np.eye(3)]), samples=SAMPLES)
