"""Distances of tracks from curves, pair by pair, against numpy."""

from __future__ import annotations

import numpy as np
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


@given(seeds, st.integers(1, 4), st.integers(1, 4), st.floats(0.0, 40.0))
def test_means_are_over_all_samples_of_pairs_that_count(seed: int, count: int, others: int, reach: float) -> None:
    tracks, found = curves(seed, count), curves(seed + 1, others)
    nearer = np.full((count, others), reach)
    nearer[0, 0] = 0.0
    there, back = mean_distances(tracks, found, nearer)
    counts = box_distances(tracks, found) < nearer
    assert not counts[0, 0]
    for way, step in ((there, 1), (back, -1)):
        means = np.linalg.norm(tracks[:, None] - found[None, :, ::step], axis=3).mean(axis=2)
        np.testing.assert_allclose(way, np.where(counts, means, np.inf), rtol=1e-12)
    for t, f in np.argwhere(counts):  # to the last bit
        assert there[t, f] == mean_distance(tracks[t], found[f])
        assert back[t, f] == mean_distance(tracks[t], found[f, ::-1])


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
