"""Flattened curves against the curves themselves, and their intersections against a brute-force twin."""

from __future__ import annotations

import numpy as np
from builders import curve_through, loop, random_curve, wave
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.data.curve import BSplineCurve
from dloftbs.fitting.crossings.kernels.intersections import flatten, intersect, measure_arcs

MAX = 20_000


def flattened(curves: list[BSplineCurve], chord_px: float, most: int = MAX) -> tuple[np.ndarray, ...]:
    """Return points, parameters, arc lengths and where each curve starts in them."""
    points, u, first = flatten(
        np.concatenate([curve.knots for curve in curves]),
        np.concatenate([curve.control_points for curve in curves]),
        np.array([len(curve.control_points) for curve in curves]),
        np.full(len(curves), chord_px),
        most,
    )
    return points, u, measure_arcs(points, first), first


def literal_intersections(lines: list[np.ndarray]) -> set[tuple[int, int]]:
    """Test all pairs of chords, of which no three ends lie on a line."""
    firsts = np.cumsum([0] + [len(line) for line in lines])
    index = np.concatenate([first + np.arange(len(line) - 1) for first, line in zip(firsts, lines, strict=False)])
    a, b = (np.concatenate([line[part] for line in lines]) for part in (np.s_[:-1], np.s_[1:]))

    def left(c: np.ndarray) -> np.ndarray:
        (dx, dy), (px, py) = (b - a).T[:, :, None], (c[None] - a[:, None]).transpose(2, 0, 1)
        return dx * py - dy * px > 0

    apart = left(a) != left(b)
    crossed = apart & apart.T & (index[:, None] + 1 < index[None])
    return {(int(index[i]), int(index[j])) for i, j in np.argwhere(crossed)}


def random_lines(seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    smooth = rng.random() < 0.5
    lines = []
    for _ in range(rng.integers(1, 4)):
        steps = rng.normal(size=(rng.integers(9, 60), 2))
        lines.append(np.cumsum(np.cumsum(steps, axis=0) if smooth else steps, axis=0) + rng.normal(0, 3, 2))
    return lines


@given(st.integers(0, 2**31))
def test_intersections_agree_with_the_literal_twin(seed: int) -> None:
    lines = random_lines(seed)
    points, first = np.concatenate(lines), np.cumsum([0] + [len(line) for line in lines])
    chords, shares = intersect(points, first)
    assert len(set(map(tuple, chords.tolist()))) == len(chords)
    assert set(map(tuple, chords.tolist())) == literal_intersections(lines)
    a, b = (points[c] + s[:, None] * (points[c + 1] - points[c]) for c, s in zip(chords.T, shares.T, strict=True))
    np.testing.assert_allclose(a, b, atol=1e-6)


@given(st.integers(0, 2**31))
def test_lines_through_the_same_pixels_cross_as_often_as_their_sides_say(seed: int) -> None:
    """Two walks over a grid from opposite sides to opposite sides cross oddly often, however much they share."""
    rng = np.random.default_rng(seed)
    x = np.arange(40.0)

    def walk(start: float, end: float) -> np.ndarray:
        y = np.concatenate(([start], np.rint(rng.uniform(-1, 1, 38)), [end]))
        return np.stack((x, y), axis=1)

    first = np.array([0, 40, 80])
    crossed, _ = intersect(np.concatenate((walk(-5, 5), walk(5, -5))), first)
    touched, _ = intersect(np.concatenate((walk(-5, -5), walk(5, 5))), first)
    assert len(crossed) % 2 == 1
    assert len(touched) % 2 == 0


def test_the_same_line_twice_touches_itself() -> None:
    line = np.stack((np.arange(30.0), np.zeros(30)), axis=1)
    chords, _ = intersect(np.concatenate((line, line)), np.array([0, 30, 60]))
    assert len(chords) % 2 == 0


def test_flattened_points_lie_on_the_curves() -> None:
    curves = [random_curve(seed, closed=seed % 2 == 0) for seed in range(20)]
    points, u, arc, first = flattened(curves, 7.0)
    for curve, low, high in zip(curves, first, first[1:], strict=False):
        np.testing.assert_allclose(points[low:high], curve.spline(np.minimum(u[low:high], 1.0 - 1e-15)), atol=1e-6)
        assert (u[low], u[high - 1]) == (0.0, 1.0)
        steps = np.linalg.norm(np.diff(points[low:high], axis=0), axis=1)
        np.testing.assert_allclose(np.diff(arc[low:high]), steps, atol=1e-9)


def test_chords_are_no_longer_than_asked_for_unless_there_would_be_too_many() -> None:
    _, _, arc, first = flattened([wave(), loop(50.0)], 4.0)
    assert (np.diff(arc[: first[1]]).mean(), np.diff(arc[first[1] :]).mean()) <= (4.0, 4.0)
    _, _, _, first = flattened([wave()], 1e-3, most=500)
    assert first.tolist() == [0, 501]


def test_a_curve_without_extent_is_flattened_too() -> None:
    points, _, arc, _ = flattened([BSplineCurve(np.r_[[0.0] * 4, [1.0] * 4], np.full((4, 2), 7.0))], 4.0)
    assert (points == 7.0).all()
    assert (arc == 0.0).all()
    chords, _ = intersect(points, np.array([0, len(points)]))
    assert len(chords) == 0


def test_a_smooth_curve_has_no_intersection_with_itself() -> None:
    points, _, _, first = flattened([curve_through(np.stack((np.arange(0, 99, 9), np.zeros(11)), axis=1))], 3.0)
    assert len(intersect(points, first)[0]) == 0
