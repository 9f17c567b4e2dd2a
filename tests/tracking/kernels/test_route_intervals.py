"""Intervals of a route, against a slow twin."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.tracking.kernels import routing

LENGTHS = (9, 5)
PART = np.repeat(np.arange(len(LENGTHS)), LENGTHS)


def intervals_by_hand(at: list[int], min_nodes: int) -> list[list[int]]:
    """Return the intervals as lists of nodes."""
    intervals: list[list[int]] = []
    for node, signed in enumerate(at):
        if signed == 0:
            continue
        if intervals and intervals[-1][-1] == node - 1 and goes_on(at, intervals[-1], node):
            intervals[-1].append(node)
        else:
            intervals.append([node])
    return [interval for interval in intervals if len(interval) >= min_nodes]


def goes_on(at: list[int], interval: list[int], node: int) -> bool:
    """Tell whether a node goes on along the part of an interval, in its direction; one node has none yet."""
    before, i = abs(at[interval[-1]]) - 1, abs(at[node]) - 1
    way = 1 if at[node] > 0 else -1
    turns = len(interval) > 1 and (at[interval[-1]] > 0) != (at[node] > 0)
    return not turns and PART[before] == PART[i] and 1 <= way * (i - before) <= 6


@given(st.lists(st.integers(-len(PART), len(PART)), min_size=1, max_size=24), st.integers(1, 3))
def test_intervals_are_those_found_node_by_node(at: list[int], min_nodes: int) -> None:
    found = np.empty((len(at), 6), np.int64)
    count = routing.find_intervals(np.array(at), PART, min_nodes, found)
    expected = []
    for interval in intervals_by_hand(at, min_nodes):
        samples = [abs(at[node]) - 1 for node in interval]
        way = 1 if samples[-1] >= samples[0] else -1
        origin = np.median(
            [routing.SAMPLES_PER_NODE * node - way * i for node, i in zip(interval, samples, strict=True)]
        )
        expected.append([PART[samples[0]], samples[0], samples[-1], interval[0], interval[-1], round(2.0 * origin)])
    assert found[:count].tolist() == expected


def test_an_interval_ends_where_nothing_is_seen_and_where_it_goes_over() -> None:
    at = np.array([1, 4, 7, 0, 8, 9, 10, 13, 12, 11, 10])
    found = np.empty((len(at), 6), np.int64)
    count = routing.find_intervals(at, PART, 2, found)
    assert found[:count, :5].tolist() == [[0, 0, 6, 0, 2], [0, 7, 8, 4, 5], [1, 9, 12, 6, 7]]
