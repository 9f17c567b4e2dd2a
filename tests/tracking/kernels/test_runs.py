"""Runs of samples of which the same holds."""

from __future__ import annotations

from itertools import groupby

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.tracking.kernels.runs import find_runs


@given(st.lists(st.booleans(), max_size=20))
def test_runs_are_those_of_neighbours_that_are_alike(mask: list[bool]) -> None:
    groups = [[i for i, _ in group] for value, group in groupby(enumerate(mask), lambda pair: pair[1]) if value]
    expected = [[group[0], group[-1] + 1] for group in groups]
    assert find_runs(np.array(mask, dtype=np.bool_)).tolist() == expected
