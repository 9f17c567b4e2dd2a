"""Sections across a curve, their rays, and which are seen, against slow twins."""

from __future__ import annotations

import numpy as np
import pytest
from builders import random_curve
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.lifting.kernels.sections import confirm_sections, find_rays, lay_sections


@given(st.integers(0, 2**31), st.booleans())
def test_sections_lie_on_the_curve_at_even_parameters(seed: int, closed: bool) -> None:
    curve = random_curve(seed, closed=closed)
    u, radius = np.linspace(0.0, 1.0, 50), np.full(50, 4.0)
    at, points, tangents, radii, length = lay_sections(
        curve.knots, curve.control_points, u, radius, closed, 10.0, 8, 20
    )
    n = len(at)
    polygon = np.linalg.norm(np.diff(curve.control_points, axis=0), axis=1).sum()
    assert length == pytest.approx(polygon)
    assert n == max(round(polygon / 10.0), 8)
    np.testing.assert_allclose(at, np.linspace(0.0, 1.0, n, endpoint=not closed))
    np.testing.assert_allclose(points, curve.spline(at), atol=1e-7)
    np.testing.assert_allclose(tangents, curve.tangent(curve.u_at(at)), atol=1e-5)
    np.testing.assert_allclose(radii, 4.0)


@given(st.integers(0, 2**31))
def test_crossings_do_not_show_in_the_radius(seed: int) -> None:
    rng = np.random.default_rng(seed)
    curve = random_curve(seed)
    u = np.linspace(0.0, 1.0, 400)
    radius = 4.0 + 2.0 * u
    start = int(rng.integers(0, 380))
    radius[start : start + 15] *= 2.0
    at, _, _, radii, _ = lay_sections(curve.knots, curve.control_points, u, radius, False, 5.0, 8, 80)
    # As the medians of blocks have it, which are a fifth of the curve long.
    np.testing.assert_allclose(radii, 4.0 + 2.0 * at, atol=0.35)


def test_rays_lie_the_radius_to_either_side() -> None:
    points, tangents = np.array([[10.0, 20.0], [30.0, 40.0]]), np.array([[1.0, 0.0], [0.0, 1.0]])
    expected = [[[10, 20], [30, 40]], [[10, 17], [34, 40]], [[10, 23], [26, 40]]]
    rays = find_rays(points, tangents, np.array([3.0, 4.0]), 2.0, 5.0, 7.0, -1.0)
    np.testing.assert_allclose(rays[..., :2] * (2.0, 5.0) + (7.0, -1.0), expected)
    assert (rays[..., 2] == 1.0).all()


def literally_confirmed(explained: list[bool], closed: bool, least: int) -> tuple[list[bool], list[tuple[int, int]]]:
    n = len(explained)
    near = [[k % n for k in (i - 1, i + 1) if closed or 0 <= k < n] for i in range(n)]
    seen = [explained[i] and any(explained[k] for k in near[i]) for i in range(n)]
    stretches = []
    for start in range(n):
        before = seen[start - 1] if closed or start > 0 else True
        if seen[start] or not before:
            continue
        stop = start
        while stop < (start + n if closed else n) and not seen[stop % n]:
            stop += 1
        if stop - start >= least:
            stretches.append((start, stop))
    return seen, stretches


@given(st.lists(st.booleans(), min_size=3, max_size=30), st.booleans(), st.integers(1, 4))
def test_stretches_agree_with_the_literal_twin(explained: list[bool], closed: bool, least: int) -> None:
    line = np.cos(np.arange(float(len(explained))))
    seen, stretches, count, first, last, lowest, lowest_seen = confirm_sections(
        np.where(explained, 1.0, np.nan), closed, least, line
    )
    expected_seen, expected = literally_confirmed(explained, closed, least)
    assert seen.tolist() == expected_seen
    assert (count, lowest) == (sum(expected_seen), line.min())
    assert lowest_seen == line[seen].min(initial=np.inf)
    assert not any(expected_seen) or [first, last] == np.flatnonzero(seen)[[0, -1]].tolist()
    found = sorted((int(a) % len(seen), int(b - a)) for a, b in stretches)
    assert not any(expected_seen) or found == sorted((a, b - a) for a, b in expected)
