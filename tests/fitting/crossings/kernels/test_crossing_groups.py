"""Which intersections count, against a literal twin on polylines that weave along each other."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.fitting.crossings.kernels.crossing_groups import select_crossings
from dloftbs.fitting.crossings.kernels.intersections import intersect

WIDTH, NEAR, REACH, TURN = 4.0, 1.5, 0.5, np.pi


def select(lines: list[np.ndarray], closed: bool = False) -> tuple[np.ndarray, ...]:
    points, first = np.concatenate(lines), np.cumsum([0] + [len(line) for line in lines])
    steps = [np.linalg.norm(np.diff(line, axis=0), axis=1) for line in lines]
    arc = np.concatenate([np.concatenate(([0.0], np.cumsum(step))) for step in steps])
    u = np.concatenate([np.linspace(0, 1, len(line)) for line in lines])
    loops, widths = np.full(len(lines), closed), np.full(len(lines), WIDTH)
    chords, shares = intersect(points, first)
    return select_crossings(points, u, arc, first, loops, widths, chords, shares)


def literal_places(height: np.ndarray) -> list[tuple[float, float]]:
    """Return the stretches that hold one crossing each, of the line y = height(x), x = 0, 1, ..., with the x axis.

    Runs of places within reach of the axis, joined where they are near, count where the sides before and after differ.
    """
    x = np.arange(len(height))
    roots = [i + height[i] / (height[i] - height[i + 1]) for i in x[:-1] if height[i] * height[i + 1] < 0]
    groups: list[list[float]] = []
    for root in roots:
        if groups:
            between = np.abs(height[int(groups[-1][-1]) + 1 : int(root) + 1])
            slopes = np.hypot(1.0, np.diff(np.concatenate(([0.0], between, [0.0]))))
            if (between <= REACH * WIDTH).all() or slopes.sum() < NEAR * WIDTH:
                groups[-1].append(root)
                continue
        groups.append([root])

    def leaves(group: list[float]) -> bool:
        before, after = np.abs(height[: int(group[0]) + 1]), np.abs(height[int(group[-1]) + 1 :])
        return (before > REACH * WIDTH).any() and (after > REACH * WIDTH).any()

    return [(group[0], group[-1]) for group in groups if len(group) % 2 and leaves(group)]


@given(st.integers(0, 2**31), st.booleans())
def test_weaving_lines_agree_with_the_literal_twin(seed: int, backwards: bool) -> None:
    rng = np.random.default_rng(seed)
    # Steps are either small, within a shared stretch, or large, so that no way is about as long as the limits.
    height = np.concatenate(
        [rng.choice([-30.0, 30.0, 0.0], p=[0.3, 0.3, 0.4]) + rng.uniform(-1.5, 1.5, 8) for _ in range(6)]
    )
    x = np.arange(48.0)
    axis = np.stack((x, np.zeros(48)), axis=1)
    curves, places, _, _ = select([axis, np.stack((x, height), axis=1)[:: -1 if backwards else 1]])
    expected = literal_places(height)
    assert len(places) == len(expected)
    assert curves.tolist() == [[0, 1]] * len(places)
    for place, (low, high) in zip(sorted(places[:, 0].tolist()), expected, strict=True):
        assert low - 1e-6 <= place <= high + 1e-6


def test_the_middle_of_three_stands_for_them() -> None:
    x = np.arange(60.0)
    height = np.clip((np.abs(x - 30) - 6) * 4, 0, None) * np.sign(x - 30) + np.where(
        np.abs(x - 30) < 6, np.sin(x - 30), 0
    )
    _, places, u, at = select([np.stack((x, np.zeros(60)), axis=1), np.stack((x, height), axis=1)])
    np.testing.assert_allclose(places, [[30.0, 0.0]], atol=1e-9)
    assert u[0, 0] == np.float64(30 / 59)
    assert at[0, 0] == 30.0


def test_a_small_curl_is_a_neighbouring_part_and_a_large_one_is_not() -> None:
    t = np.linspace(-1.6, 1.6, 33)
    curl = np.stack((t**3 - t, t**2), axis=1)
    assert len(select([curl * 2.0])[0]) == 0
    assert len(select([curl * 20.0])[0]) == 1


def test_the_seam_of_a_loop_is_no_crossing() -> None:
    angle = np.linspace(0, 2 * np.pi, 65)
    ring = 40 * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    ring[-1] = ring[0]
    assert len(select([ring], closed=True)[0]) == 0
