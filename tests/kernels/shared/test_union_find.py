"""Groups by union-find against sets that are merged one by one."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from dloftbs.kernels.shared.union_find import find_root, unite

find_root = njit(find_root)
unite = njit(unite)

pairs = st.lists(st.tuples(st.integers(0, 19), st.integers(0, 19)), max_size=40)


@given(pairs)
def test_each_group_has_its_lowest_member_as_its_root(joined: list[tuple[int, int]]) -> None:
    parent, groups = np.arange(20), [{i} for i in range(20)]
    for i, j in joined:
        unite(parent, i, j)
        merged = groups[i] | groups[j]
        for member in merged:
            groups[member] = merged
    assert [find_root(parent, i) for i in range(20)] == [min(group) for group in groups]
