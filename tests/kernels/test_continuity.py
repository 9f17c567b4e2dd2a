"""Which pairs of ends continue each other along curves that were seen before."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.data.centerline import arc_parameter
from dloftbs.data.curve import BSplineCurve
from dloftbs.fitting import fit_with_knots
from dloftbs.kernels.continuity import follow, sample_curves

WIDTH = 10.0
LINE = np.column_stack((np.arange(0.0, 301.0, 5.0), np.full(61, 50.0)))


def arm(x: float, y: float, degrees: float) -> list[float]:
    a = np.radians(degrees)
    return [x, y, np.cos(a), np.sin(a), 0.0, 1.0]


def tangents_of(points: np.ndarray) -> np.ndarray:
    along = np.gradient(points, axis=0)
    return along / np.hypot(*along.T)[:, None]


def along(arms: list[list[float]], *curves: np.ndarray, trust: float = 1.0, closed: bool = False) -> np.ndarray:
    """Return what `follow` says of all pairs, as a square matrix."""
    n = len(arms)
    rows, columns = np.triu_indices(n, 1)
    found = follow(
        np.array(arms), rows, columns, np.concatenate(curves),
        np.cumsum([0, *map(len, curves)]), np.array([np.hypot(*(c[1] - c[0])) for c in curves]),
        np.array([np.hypot(*np.diff(c, axis=0).T).max() for c in curves]),
        np.full(len(curves), closed), np.full(len(curves), trust), WIDTH,
    )  # fmt: skip
    result = np.zeros((n, n))
    result[rows, columns] = result[columns, rows] = found
    return result


def test_two_ends_on_a_curve_that_face_each_other_continue_each_other() -> None:
    assert along([arm(100, 50, 0), arm(140, 50, 180)], LINE)[0, 1] == pytest.approx(1.0)
    assert along([arm(100, 50, 0), arm(140, 50, 180)], LINE, trust=0.4)[0, 1] == pytest.approx(0.4)
    assert along([arm(100, 50, 0), arm(140, 50, 180)], LINE[::-1])[0, 1] == pytest.approx(1.0)
    beside = along([arm(100, 56, 0), arm(140, 56, 180)], LINE)[0, 1]
    assert 0.3 < beside < 0.8


@pytest.mark.parametrize(
    "other",
    [arm(140, 50, 0), arm(60, 50, 180), arm(140, 70, 180), arm(140, 50, 90), arm(290, 50, 180)],
    ids=["points the same way", "lies behind", "beside the curve", "across it", "too far"],
)
def test_others_do_not(other: list[float]) -> None:
    bent = np.concatenate((LINE[:25], LINE[25:] + np.column_stack((np.zeros(36), 3.0 * np.arange(36)))))
    curve = bent if other[0] == 290 else LINE
    assert along([arm(100, 50, 0), other], curve)[0, 1] == 0.0


def test_of_several_curves_the_best_counts() -> None:
    arms = [arm(100, 50, 0), arm(140, 50, 180), arm(140, 80, 180)]
    found = along(arms, LINE + np.array([0.0, 9.0]), LINE)
    assert found[0, 1] == pytest.approx(1.0)
    assert found[0, 2] == found[1, 2] == 0.0


def test_around_the_seam_of_a_closed_curve() -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 81)[:-1]
    ring = 100.0 * np.column_stack((np.cos(turn), np.sin(turn)))
    arms = [arm(100 * np.cos(-0.2), 100 * np.sin(-0.2), 78.5), arm(100 * np.cos(0.2), 100 * np.sin(0.2), -78.5)]
    assert along(arms, ring, closed=True)[0, 1] > 0.7
    assert along(arms, ring, closed=False)[0, 1] == 0.0


def twin(arms: np.ndarray, i: int, j: int, points: np.ndarray, tangents: np.ndarray, step: float) -> float:
    """Do the same for one open curve of trust 1, end by end."""

    def places(end: int, sign: float) -> tuple[float, int]:
        d = np.hypot(*(points - arms[end, :2]).T)
        cosine = sign * (tangents @ arms[end, 2:4])
        value = np.where((cosine >= 0.6) & (d < 1.5 * WIDTH), (1.0 - d / (1.5 * WIDTH)) * cosine, 0.0)
        return float(value.max()), int(value.argmax())

    best = 0.0
    for a, b in ((i, j), (j, i)):
        (fit_a, at_a), (fit_b, at_b) = places(a, 1.0), places(b, -1.0)
        length = (at_b - at_a) * step
        if -WIDTH <= length <= 1.6 * np.hypot(*(arms[i, :2] - arms[j, :2])) + 2.0 * WIDTH:
            best = max(best, min(fit_a, fit_b))
    return best


@given(st.integers(0, 2**31))
def test_the_obvious_way_finds_the_same(seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, 1.0, 90)
    curve = np.column_stack((300 * s, 60 * np.sin(2 * np.pi * s * rng.uniform(0.2, 2.0)) + 40 * s))
    tangents, step = tangents_of(curve), float(np.hypot(*(curve[1] - curve[0])))
    at = rng.integers(0, 90, 5)
    degrees = np.degrees(np.arctan2(*tangents[at].T[::-1])) + rng.choice([0, 180], 5) + rng.normal(0, 20, 5)
    arms = np.array([arm(*(curve[k] + rng.normal(0, 4, 2)), a) for k, a in zip(at, degrees, strict=True)])
    found = along(arms.tolist(), curve)
    for i in range(5):
        for j in range(i):
            assert found[i, j] == pytest.approx(twin(arms, i, j, curve, tangents, step), abs=1e-9)


@given(st.integers(0, 2**31), st.floats(0, 6.3))
def test_turned_curves_and_ends_are_the_same(seed: int, angle: float) -> None:
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-8, 8, (2, 2))
    arms = np.array([arm(120 + x[0], 50 + y[0], 0), arm(170 + x[1], 50 + y[1], 180)])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turned = arms.copy()
    turned[:, :2], turned[:, 2:4] = arms[:, :2] @ turn.T, arms[:, 2:4] @ turn.T
    before, after = along(arms.tolist(), LINE), along(turned.tolist(), LINE @ turn.T)
    np.testing.assert_allclose(before, after, atol=1e-6)


def random_curve(rng: np.random.Generator, closed: bool) -> BSplineCurve:
    points = np.cumsum(rng.normal(0.0, 20.0, (60, 2)), axis=0) + 300.0
    u = arc_parameter(points, closed)
    return fit_with_knots(points, u, closed, int(rng.integers(5, 15)))


@given(st.integers(0, 2**31), st.booleans())
def test_samples_are_those_of_the_curves(seed: int, flip: bool) -> None:
    rng = np.random.default_rng(seed)
    curves = [random_curve(rng, closed) for closed in (False, True, False)]
    matrix, offset = np.array([[0.0, -1.0], [1.0, 0.0]] if flip else [[-1.0, 0.0], [0.0, 1.0]]), np.array([7.0, 500.0])
    points, first, steps, longest = sample_curves(
        np.concatenate([c.knots for c in curves]), np.concatenate([c.control_points for c in curves]),
        np.array([len(c.control_points) for c in curves]), np.array([c.closed for c in curves]),
        matrix, offset, 6.0, 80,
    )  # fmt: skip
    for c, curve in enumerate(curves):
        own = points[first[c] : first[c + 1]]
        polygon = np.hypot(*np.diff(curve.control_points, axis=0).T).sum()
        assert len(own) == min(max(int(np.ceil(polygon / 6.0)), 8), 80)
        np.testing.assert_allclose(own @ matrix.T + offset, curve.spline(np.linspace(0.0, 1.0, len(own))), atol=1e-9)
        assert steps[c] <= polygon / (len(own) - 1) + 1e-9
        length = np.hypot(*(own[2:] - own[:-2]).T).sum() + np.hypot(*(own[1] - own[0])) + np.hypot(*(own[-1] - own[-2]))
        assert steps[c] == pytest.approx(length / 2.0 / (len(own) - 1))
        assert longest[c] == pytest.approx(np.hypot(*np.diff(own, axis=0).T).max())
