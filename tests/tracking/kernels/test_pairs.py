"""Distances of tracks from curves, pair by pair, against numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.tracking.kernels.pairs import box_distances, lie_near, mean_distance, mean_distances, ratios_differ

seeds = st.integers(0, 10_000)


def curves(seed: int, count: int, samples: int = 7) -> np.ndarray:
    """Return curves that start somewhere and wander, shape (count, samples, 2)."""
    rng = np.random.default_rng(seed)
    return rng.uniform(0.0, 60.0, (count, 1, 2)) + rng.normal(0.0, 6.0, (count, samples, 2)).cumsum(axis=1)


@given(seeds, st.integers(1, 4), st.integers(1, 4))
def test_boxes_are_as_far_apart_as_their_sides(seed: int, count: int, others: int) -> None:
    tracks, found = curves(seed, count), curves(seed + 1, others)
    before = tracks.min(axis=1)[:, None] - found.max(axis=1)
    after = found.min(axis=1) - tracks.max(axis=1)[:, None]
    expected = np.linalg.norm(np.maximum(np.maximum(before, after), 0.0), axis=2)
    np.testing.assert_allclose(box_distances(tracks, found), expected, rtol=1e-12)


def distance(track: np.ndarray, curve: np.ndarray, *, is_part: bool) -> float:
    """Return the mean distance of a track from a curve, sample by sample; of a part, at the best place along it."""
    own, longer = (np.linalg.norm(np.diff(one, axis=0), axis=1).sum() for one in (track, curve))
    means = [np.linalg.norm(track - curve, axis=1).mean()]
    if is_part and own < longer:
        share, u = own / longer, np.linspace(0.0, 1.0, len(track))
        for first in np.linspace(0.0, 1.0 - share, math.ceil((1.0 - share) * 32) + 1):
            there = np.stack([np.interp(first + share * u, u, curve[:, d]) for d in range(2)], axis=1)
            means.append(np.linalg.norm(track - there, axis=1).mean())
    return min(means)


@given(seeds, st.integers(1, 4), st.integers(1, 4), st.floats(0.0, 40.0))
def test_a_track_is_as_far_away_as_where_it_lies_along_a_curve(
    seed: int, count: int, others: int, reach: float
) -> None:
    tracks, found = curves(seed, count), curves(seed + 1, others)
    nearer = np.full((count, others), reach)
    nearer[0, 0] = 0.0
    is_part = np.arange(count) % 2 == 0
    there, back = mean_distances(tracks, found, nearer, is_part)
    counts = box_distances(tracks, found) < nearer
    assert not counts[0, 0]
    for t, f in np.ndindex(counts.shape):
        for way, curve in ((there, found[f]), (back, found[f, ::-1])):
            assert way[t, f] == pytest.approx(
                distance(tracks[t], curve, is_part=bool(is_part[t])) if counts[t, f] else np.inf, rel=1e-9
            )


@given(seeds)
def test_the_mean_distance_is_over_all_samples_in_order(seed: int) -> None:
    one, other = curves(seed, 2)
    assert mean_distance(one, other[::-1]) == pytest.approx(np.linalg.norm(one - other[::-1], axis=1).mean())


@given(seeds, st.integers(0, 4), st.floats(0.0, 40.0))
def test_points_lie_near_the_nearest_sample_of_any_curve(seed: int, others: int, distance: float) -> None:
    (points,), found = curves(seed, 1), curves(seed + 1, others)
    apart = np.linalg.norm(points[:, None] - found.reshape(-1, 1, 2).transpose(1, 0, 2), axis=2)
    expected = apart.min(axis=1, initial=np.inf) < distance
    np.testing.assert_array_equal(lie_near(points, found, distance), expected)


def test_unknown_lengths_agree_with_any() -> None:
    ones, others = np.array([np.nan, 0.0, 2.0]), np.array([0.5, 1.0, 6.0, 6.1, np.nan])
    expected = np.zeros((3, 5), np.bool_)
    expected[2, [0, 3]] = True
    np.testing.assert_array_equal(ratios_differ(ones, others, 3.0), expected)
