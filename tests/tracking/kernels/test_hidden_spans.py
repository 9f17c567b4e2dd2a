"""Hidden spans against a slow twin: rigid motions by numpy's SVD; bends keep their length and meet both sides."""

from __future__ import annotations

from itertools import groupby

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.tracking.kernels.hidden_spans import fill_hidden, find_runs

WINDOW, SEARCHED_PX = 10, 0.06
SPANS = [[(0, 30)], [(20, 60)], [(35, 60)], [(0, 15), (40, 60)], [(5, 15), (22, 30), (58, 59)]]


def shape(seed: int, dims: int) -> np.ndarray:
    """Return a smooth curve of 61 points."""
    rng, t = np.random.default_rng(seed), np.linspace(0.0, 1.0, 61)
    points = np.stack([sum(rng.normal(0, 9 / k) * np.sin(k * t + rng.uniform(0, 6)) for k in (1, 2, 3))] * dims, 1)
    points = points * rng.normal(0.0, 1.0, dims) + rng.normal(0.0, 3.0, (1, dims)) * t[:, None]
    points[:, 0] += 200.0 * t
    return points


def motion(old: np.ndarray, new: np.ndarray, edge: int, noise: float, scale: float):
    a, b = old - old.mean(axis=0), new - new.mean(axis=0)
    u, _, vt = np.linalg.svd(b.T @ a + len(a) * noise**2 * np.eye(old.shape[1]))
    rotation = (u * ([1.0] * (len(u) - 1) + [np.sign(np.linalg.det(u @ vt))])) @ vt
    return lambda points: scale * (points - old[edge]) @ rotation.T + new[edge]


def twin(old: np.ndarray, new: np.ndarray, visible: list[tuple[int, int]], length: float) -> np.ndarray:
    result, step = new.copy(), length / 60
    edges = [-1, *(edge for span in visible for edge in span), len(old)]
    for k, (left, right) in enumerate(zip(edges[::2], edges[1::2], strict=True)):
        steps, inside = max(right - left, WINDOW), slice(left + 1, right)
        if right - left < 2:
            continue
        first, last = max(left, 0), min(right, 60)
        scale = (last - first) * step / np.linalg.norm(np.diff(old[first : last + 1], axis=0), axis=1).sum()
        before = after = None
        if k:
            low = max(left - steps, visible[k - 1][0])
            before = motion(old[low : left + 1], new[low : left + 1], -1, 0.5 * step, scale)
        if k < len(visible):
            high = min(right + steps, visible[k][1]) + 1
            after = motion(old[right:high], new[right:high], 0, 0.5 * step, scale)
        if before and after:
            t = (np.arange(1, right - left) / (right - left))[:, None]
            weight = t * t * (3 - 2 * t)
            result[inside] = (1 - weight) * before(old[inside]) + weight * after(old[inside])
        else:
            result[inside] = (before or after)(old[inside])
    return result


@pytest.mark.parametrize("dims", [2, 3])
@given(seed=st.integers(0, 10_000), visible=st.sampled_from(SPANS))
def test_hidden_spans_are_those_of_the_twin(dims: int, seed: int, visible: list[tuple[int, int]]) -> None:
    old = shape(seed, dims)
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(np.eye(dims) + 0.2 * rng.normal(0.0, 1.0, (dims, dims)))[0]
    turn *= np.sign(np.linalg.det(turn)) if dims == 3 else 1.0
    if np.linalg.det(turn) < 0.0:
        turn[:, 0] *= -1.0
    new = old @ turn.T + rng.normal(0.0, 30.0, dims)
    length = 1.01 * np.linalg.norm(np.diff(old, axis=0), axis=1).sum()
    expected = twin(old, new, visible, length)
    for left, right in zip([-1, *(last for _, last in visible)], [*(first for first, _ in visible), 61], strict=True):
        new[left + 1 : right] = np.nan
    fill_hidden(old, new, np.array(visible), WINDOW, length)
    for left, right in zip([-1, *(last for _, last in visible)], [*(first for first, _ in visible), 61], strict=True):
        inner = slice(max(left, 0), right + 1)
        lengths = [np.linalg.norm(np.diff(points[inner], axis=0), axis=1) for points in (old, new)]
        wanted = lengths[0] * (right - left) * length / 60 / lengths[0].sum()
        bent = left >= 0 and right <= 60 and np.abs(wanted - lengths[1]).max() < SEARCHED_PX
        if not bent:
            np.testing.assert_allclose(new[inner], expected[inner], atol=1e-6)


def test_a_hidden_bend_keeps_its_length_as_its_ends_come_nearer() -> None:
    angle = np.linspace(-1.0, 1.0, 61)
    old = 100.0 * np.stack((np.sin(angle), np.cos(angle)), axis=1)
    new = old.copy()
    new[40:, 0] -= 6.0
    new[21:40] = np.nan
    fill_hidden(old, new, np.array([(0, 20), (40, 60)]), WINDOW, np.linalg.norm(np.diff(old, axis=0), axis=1).sum())
    lengths = [np.linalg.norm(np.diff(points[20:41], axis=0), axis=1) for points in (old, new)]
    assert np.abs(lengths[0] - lengths[1]).max() < SEARCHED_PX


def test_a_span_that_would_need_to_wind_up_is_blended_from_both_sides() -> None:
    """Its ends are three times as far apart as it is long."""
    old = np.stack((np.linspace(0.0, 60.0, 61), np.zeros(61)), axis=1)
    new = old + np.array([0.0, 5.0])
    new[40:, 0] += 40.0
    new[21:40] = np.nan
    fill_hidden(old, new, np.array([(0, 20), (40, 60)]), WINDOW, 60.0)
    assert (np.diff(new[:, 0]) > 0.0).all()
    np.testing.assert_allclose(new[:, 1], 5.0, atol=1e-9)


@given(st.lists(st.booleans(), max_size=20))
def test_runs_are_those_of_neighbours_that_are_alike(mask: list[bool]) -> None:
    groups = [[i for i, _ in group] for value, group in groupby(enumerate(mask), lambda pair: pair[1]) if value]
    expected = [[group[0], group[-1] + 1] for group in groups]
    assert find_runs(np.array(mask, dtype=np.bool_)).tolist() == expected
