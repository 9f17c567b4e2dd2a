"""Curves laid along each other: against slow twins, and under changes that must not matter."""

from __future__ import annotations

import numpy as np
import pytest
from builders import curve_through, loop, part, random_curve, wave
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.data.curve import BSplineCurve
from dloftbs.kernels import cubic_samples
from dloftbs.tracking.kernels import alignment as kernels

M = 64
U = np.linspace(0.0, 1.0, M)
FAR = 1e9


def samples(curve: BSplineCurve) -> np.ndarray:
    return curve.spline(U)


def length_of(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def at(points: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return samples at parameters, linearly between them."""
    return np.stack([np.interp(u, U, column) for column in points.T], axis=1)


def slow_misfit(short: np.ndarray, whole: np.ndarray, share: float, start: float, shift_weight: float) -> float:
    """Return what `misfit_at` should."""
    t = np.linspace(0.0, 1.0, max(8, int(share * (M - 1)) // 2 + 1))
    apart = at(short, t) - at(whole, start + share * t)
    return float(np.linalg.norm(apart - (1.0 - shift_weight) * apart.mean(axis=0), axis=1).mean())


@pytest.mark.parametrize("ndim", [2, 3])
@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_samples_lie_on_the_curve(seed, closed, ndim):
    curve = random_curve(seed, ndim, closed)
    for first, last in ((0.0, 1.0), (0.25, 0.6)):
        points, length = cubic_samples.sample_cubic(curve.knots, curve.control_points, first, last, M)
        np.testing.assert_allclose(points, curve.spline(np.linspace(first, last, M)), atol=1e-9)
        assert length == pytest.approx(length_of(points))


@given(st.integers(0, 1000), st.floats(0.1, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_the_misfit_is_that_of_its_slow_twin(seed, share, where, shift_weight):
    short, whole = samples(random_curve(seed)), samples(random_curve(seed + 1))
    start = where * (1.0 - share)
    fast = kernels.misfit_at(short, whole, share, start, shift_weight)
    assert fast == pytest.approx(slow_misfit(short, whole, share, start, shift_weight), rel=1e-9, abs=1e-9)


@given(st.floats(0.0, 0.6), st.floats(0.15, 0.4), st.booleans(), st.floats(0.0, 2.0 * np.pi))
def test_a_part_is_found_where_it_was_cut_out(start, share, flip, angle):
    c, s = np.cos(angle), np.sin(angle)
    curve = wave().transformed([[c, -s], [s, c]], [300.0, 300.0])
    piece = part(curve, start, start + share)
    misfit, found, backwards = align_all([curve], [piece.reversed() if flip else piece])
    assert backwards[0, 0] == flip
    assert found[0, 0] == pytest.approx(start, abs=0.02)
    assert misfit[0, 0] < 3.0


def align_all(tracks: list[BSplineCurve], found: list[BSplineCurve], cap: float = FAR):
    a, b = np.array([samples(c) for c in tracks]), np.array([samples(c) for c in found])
    lengths = [np.array([length_of(p) for p in points]) for points in (a, b)]
    closed = [np.array([c.closed for c in curves]) for curves in (tracks, found)]
    return kernels.align_all(a, lengths[0], closed[0], b, lengths[1], closed[1], np.full((len(a), len(b)), cap))


def test_all_pairs_are_those_one_by_one():
    curves = [wave(), wave((30.0, 90.0), phase=1.0).reversed(), part(wave(), 0.2, 0.7)]
    misfit, start, backwards = align_all(curves, curves)
    np.testing.assert_allclose(np.diag(misfit), 0.0, atol=1e-9)
    assert backwards.tolist() == [[False, True, False], [True, False, True], [False, True, False]]
    assert start[0, 2] == pytest.approx(0.2, abs=0.01)
    assert start[2, 0] == pytest.approx(0.2, abs=0.01)
    assert misfit[0, 2] < 2.0


@given(st.floats(0.0, 0.99), st.booleans())
def test_the_seam_of_a_loop_is_found(seam, flip):
    squashed = [[1.5, 0.0], [0.0, 0.7]]
    ring, other = (loop(60.0, start=a).transformed(squashed, [0.0, 0.0]) for a in (0.0, 2.0 * np.pi * seam))
    misfit, start, backwards = align_all([ring], [other.reversed() if flip else other])
    assert misfit[0, 0] < 1.0
    assert backwards[0, 0] == flip
    expected = ring.spline(start[0, 0] % 1.0)
    np.testing.assert_allclose(other(0.0), expected, atol=2.0)


def test_a_sample_counts_no_more_than_the_cap():
    misfit, _, _ = align_all([wave()], [wave((0.0, 30.0))], cap=20.0)
    assert misfit[0, 0] == pytest.approx(20.0)


def test_a_pair_that_is_not_asked_for_does_not_fit():
    track, ones = samples(wave())[None], np.ones(1)
    misfit, _, _ = kernels.align_all(track, ones, ones < 0.0, track, ones, ones < 0.0, np.zeros((1, 1)))
    assert misfit[0, 0] == np.inf


def match(tracks: list[BSplineCurve], found: list[BSplineCurve]) -> list[int]:
    a, b = np.array([samples(c) for c in tracks]), np.array([samples(c) for c in found])
    lengths = np.array([length_of(points) for points in a])
    return kernels.find_partners(a, lengths, b, 0.02).tolist()


class TestWithoutDoubt:
    THREE = (wave(), wave((0.0, 150.0)), wave((0.0, 300.0)))

    @given(st.permutations(range(3)), st.tuples(*[st.booleans()] * 3), st.floats(-4.0, 4.0))
    def test_order_and_direction_do_not_matter(self, order, flips, shift):
        moved = [self.THREE[k].transformed(np.eye(2), [shift, shift]) for k in order]
        found = [curve.reversed() if flip else curve for curve, flip in zip(moved, flips, strict=True)]
        expected = [(order.index(k) + 1) * (-1 if flips[order.index(k)] else 1) for k in range(3)]
        assert match(list(self.THREE), found) == expected

    @pytest.mark.parametrize(
        ("found", "expected"),
        [
            ([wave((0.0, 300.0)), wave()], [2, 0, 1]),  # one is missing
            ([wave((0.0, 300.0)), wave(), wave((0.0, 150.0)), wave((0.0, 600.0))], [2, 3, 1]),  # one is new
            ([wave(), wave((0.0, 150.0)), wave((0.0, 340.0))], [1, 2, 0]),  # one is far
            ([wave(), wave((0.0, 150.0)), part(wave((0.0, 300.0)), 0.0, 0.95)], [1, 2, 0]),  # one is shorter
            ([wave((0.0, 1.0)), wave((0.0, 2.0)), wave((0.0, 300.0))], [0, 0, 3]),  # two are near to one
            ([wave(), wave((0.0, 150.0)), loop(60.0)], [1, 2, 0]),  # one is a loop
        ],
    )
    def test_what_is_in_doubt_is_left_open(self, found, expected):
        assert match(list(self.THREE), found) == expected

    def test_two_tracks_that_are_near_to_one_are_left_open(self):
        assert match([wave((0.0, 1.0)), wave((0.0, -1.0)), wave((0.0, 300.0))], [wave(), wave((0.0, 300.0))]) == [
            0,
            0,
            2,
        ]

    def test_a_direction_in_doubt_is_left_open(self):
        hairpin = np.vstack((np.linspace((0, 0), (400, 0), 40), np.linspace((400, 2), (0, 2), 40)))
        assert match([curve_through(hairpin)], [curve_through(hairpin + np.array([0.0, 1.0]))]) == [0]
