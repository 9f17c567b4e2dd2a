"""Where the axis of a cable ends."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, random_masks, turn, turn_points
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline
from skeletons import fast_skeleton, listed, padded

from dloftbs.data.curve import BSplineCurve
from dloftbs.kernels.tracing import trace
from dloftbs.linking.kernels.end_extension import extend_end, is_seen
from dloftbs.skeleton.kernels.recentring import recentre
from dloftbs_lab.synthetic import draw_tube_mask


def runs_of(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a mask in the kernels' frame, and the points and offsets of its skeleton's branches."""
    grid = fast_skeleton(mask)
    points, offsets, _ = trace(grid, *listed(grid))
    return padded(mask), points, offsets


def straight_band(angle: float, width: float, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a flat-ended band about the middle of an image, the unit vector along it and the middle."""
    y, x = np.mgrid[:200, :200]
    along, middle = np.array([np.cos(angle), np.sin(angle)]), np.array([99.7, 99.4])
    a = (x - middle[0]) * along[0] + (y - middle[1]) * along[1]
    b = (y - middle[1]) * along[0] - (x - middle[0]) * along[1]
    return ((np.abs(a) <= length / 2) & (np.abs(b) <= width / 2)).astype(np.uint8), along, middle + 1.0


def end_of(frame: np.ndarray, points: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Return the longest branch with its last end extended."""
    middle, radius = recentre(frame, points, offsets)
    branch = slice(*offsets[np.argmax(np.diff(offsets)) :][:2])
    drop, added = extend_end(frame, middle[branch], float(np.median(radius[branch])))
    assert len(added)
    return np.concatenate((middle[branch][: len(middle[branch]) - drop], added))


@pytest.mark.parametrize("width", [2, 3, 12, 30])  # at 5 px some of them look round
@pytest.mark.parametrize("angle", np.linspace(0.0, np.pi / 2, 7))
def test_a_flat_end_is_reached_in_its_middle(width: int, angle: float) -> None:
    mask, along, middle = straight_band(angle, width, 120.0)
    line = end_of(*runs_of(mask))
    sign = np.sign((line[-1] - middle) @ along)
    off = line[-1] - (middle + 60.0 * sign * along)
    assert abs(off @ along) < 0.1 * width + 0.5
    assert abs(off @ (-along[1], along[0])) < 0.1 * width + 0.5
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    assert steps.max() < 2.0


def bent_tube(width: float, seed: int, *, is_round: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a tube bent to a radius of two widths, where its axis ends, in the kernels' frame, and its way there."""
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, 8.0 * width, 400)
    angle = rng.uniform(0.0, 2.0 * np.pi) + rng.choice((-1.0, 1.0)) * np.maximum(s - 4.0 * width, 0.0) / (2.0 * width)
    points = np.cumsum(np.stack((np.cos(angle), np.sin(angle)), axis=1), axis=0) * (s[1] - s[0])
    points += 2.0 * width - points.min(axis=0) + rng.random(2)
    columns, rows = np.ceil(points.max(axis=0) + 2.0 * width).astype(int)
    spline = make_interp_spline(np.linspace(0.0, 1.0, len(points)), points)
    mask = draw_tube_mask(BSplineCurve(spline.t, spline.c), width, (rows, columns))
    out = np.array([np.cos(angle[-1]), np.sin(angle[-1])])
    if not is_round:
        y, x = np.mgrid[:rows, :columns]
        beyond = np.stack((x, y), axis=2) - points[-1]
        mask &= ~((beyond @ out > 0.0) & (np.hypot(*beyond.transpose(2, 0, 1)) < width))
    return mask.astype(np.uint8), points[-1] + 1.0, out


@pytest.mark.parametrize("is_round", [True, False])
@pytest.mark.parametrize("width", [5.0, 8.0, 12.0, 20.0, 40.0])
def test_a_bent_cable_ends_where_its_axis_does_however_its_cap_is_shaped(width: float, is_round: bool) -> None:
    misses = []
    for seed in range(8):
        mask, end, out = bent_tube(width, seed, is_round=is_round)
        frame, points, offsets = runs_of(mask)
        line = min((end_of(frame, points[::step], offsets) for step in (1, -1)), key=lambda p: np.hypot(*(p[-1] - end)))
        misses.append(abs((line[-1] - end) @ out))
        assert np.hypot(*(line[-1] - end)) < 0.6 * width + 1.0
    assert np.median(misses) < 0.1 * width + 0.5


@pytest.mark.parametrize("width", [12, 30])
def test_a_hollow_end_and_a_slanting_one_are_flat(width: int) -> None:
    y, x = np.mgrid[: 4 * width, : 10 * width]
    band = np.abs(y - 2.0 * width) <= width / 2.0
    for cut in (
        np.hypot(x - 9.2 * width, y - 2.0 * width) > 2.0 * width,  # an occluder that ends the axis at 7.2 widths
        x + 0.8 * (y - 2.0 * width) < 7.2 * width,
        x - 0.8 * (y - 2.0 * width) < 7.2 * width,
    ):
        frame, points, offsets = runs_of((band & cut & (x < 7.9 * width) & (x > width)).astype(np.uint8))
        ends = [end_of(frame, points[::step], offsets)[-1] for step in (1, -1)]
        assert max(ends, key=lambda end: end[0])[0] == pytest.approx(7.2 * width + 1.0, abs=0.15 * width + 0.5)


def test_a_cap_between_round_and_flat_ends_in_between() -> None:
    y, x = np.mgrid[:60, :200]
    ends = []
    for power in (2.0, 2.5, 3.0, 3.5, 4.0, 6.0, 12.0):
        cap = (np.maximum(x - 150.0, 0.0) / 15.0) ** power + np.abs((y - 30.0) / 15.0) ** power <= 1.0
        frame, points, offsets = runs_of((cap & (x > 10)).astype(np.uint8))
        ends.append(max(end_of(frame, points[::step], offsets)[-1][0] for step in (1, -1)))
    assert ends[0] == pytest.approx(151.0, abs=1.0)
    assert ends[-1] == pytest.approx(166.0, abs=1.0)
    assert sum(152.0 < end < 165.0 for end in ends) >= 1


def cone(angle: float, width: float, narrowest: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a band that narrows over two widths to a share of its width, where it is cut, and the middle of the cut.

    The latter is in the kernels' frame.
    """
    y, x = np.mgrid[:300, :300]
    along, middle = np.array([np.cos(angle), np.sin(angle)]), np.array([149.7, 149.4])
    a = (x - middle[0]) * along[0] + (y - middle[1]) * along[1]
    b = (y - middle[1]) * along[0] - (x - middle[0]) * along[1]
    share = np.clip(narrowest + (1.0 - narrowest) * (100.0 - a) / (2.0 * width), 0.0, 1.0)
    return ((np.abs(a) <= 100.0) & (np.abs(b) <= 0.5 * width * share)).astype(np.uint8), middle + 100.0 * along + 1.0


@pytest.mark.parametrize("narrowest", [0.2, 0.35, 0.5])
@pytest.mark.parametrize("width", [10, 16, 30])
def test_a_tapered_end_is_reached_where_it_is_cut(width: int, narrowest: float) -> None:
    misses = []
    for angle in np.linspace(0.0, np.pi / 2, 9):
        mask, tip = cone(float(angle), width, narrowest)
        frame, points, offsets = runs_of(mask)
        ends = [end_of(frame, points[::step], offsets)[-1] for step in (1, -1)]
        misses.append(min(np.hypot(*(end - tip)) for end in ends))
    assert np.median(misses) < 0.05 * width + 0.5
    assert max(misses) < 0.2 * width + 1.0  # some of these tips, of few pixels, look round


def test_a_thin_cable_that_tapers_is_no_round_one() -> None:
    misses = []
    for angle in np.linspace(0.0, np.pi / 2, 25):
        mask, tip = cone(float(angle), 6, 0.5)
        frame, points, offsets = runs_of(mask)
        ends = [end_of(frame, points[::step], offsets)[-1] for step in (1, -1)]
        misses.append(min(np.hypot(*(end - tip)) for end in ends))
    assert np.median(misses) < 1.0  # of 3, if its tip were a cap


@pytest.mark.parametrize("side", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("width", [16, 30])
@pytest.mark.parametrize("angle", np.linspace(0.0, np.pi / 2, 5))
def test_an_axis_ends_where_strands_begin(width: int, angle: float, side: float) -> None:
    """With a strand straight ahead, one to each side of the axis, and one to each side farther off."""
    mask, along, middle = straight_band(angle, width, 100.0)
    y, x = np.mgrid[:200, :200]
    a = (x - middle[0] + 1.0) * along[0] + (y - middle[1] + 1.0) * along[1]
    b = (y - middle[1] + 1.0) * along[0] - (x - middle[0] + 1.0) * along[1]
    mask |= ((a > 0.0) & (a < 50.0 + 0.7 * width) & (np.abs(np.abs(b) - side * width / 2) <= 0.08 * width)).astype(
        np.uint8
    )
    frame = padded(mask)
    points = middle + np.arange(-40.0, 50.0 - 0.5 * width)[:, None] * along
    drop, added = extend_end(frame, points, 0.5 * width)
    assert drop > 0
    assert np.hypot(*(added[-1] - (middle + 50.0 * along))) < 0.05 * width + 1.5


def knobbed(angle: float, width: float, size: float, *, is_round: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return a band with a ball or a square block of `size` about its end, and where that cable ends."""
    y, x = np.mgrid[:240, :240]
    along, start = np.array([np.cos(angle), np.sin(angle)]), np.array([119.7, 119.4])
    a = (x - start[0]) * along[0] + (y - start[1]) * along[1]
    b = (y - start[1]) * along[0] - (x - start[0]) * along[1]
    knob = np.hypot(a - 60.0, b) if is_round else np.maximum(np.abs(a - 60.0), np.abs(b))
    mask = ((a >= -60.0) & (a <= 60.0) & (np.abs(b) <= 0.5 * width)) | (knob <= 0.5 * size)
    return mask.astype(np.uint8), start + (60.0 if is_round else 60.0 + 0.5 * size) * along + 1.0


@pytest.mark.parametrize("is_round", [True, False])
@pytest.mark.parametrize("times", [1.8, 2.2, 3.0])
@pytest.mark.parametrize("width", [8, 12, 20])
def test_a_cable_ends_in_the_middle_of_a_ball_and_at_the_face_of_a_block(
    width: int, times: float, is_round: bool
) -> None:
    for angle in np.linspace(0.1, np.pi / 2, 7):
        mask, end = knobbed(float(angle), width, times * width, is_round=is_round)
        frame, points, offsets = runs_of(mask)
        ends = [end_of(frame, points[::step], offsets)[-1] for step in (1, -1)]
        assert min(np.hypot(*(found - end)) for found in ends) < 0.2 * width + 0.5


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_line_that_veers_into_a_lobe_of_a_knob_is_cut_at_its_middle(side: float) -> None:
    y, x = np.mgrid[:120, :160]
    mask = (np.abs(y - 60) <= 5) & (x >= 10) & (x <= 100)
    mask |= ((x - 100) / 11.0) ** 2 + ((y - 60) / 16.0) ** 2 <= 1.0  # wider across than along
    straight = np.stack((np.arange(20.0, 101.0), np.full(81, 60.0)), axis=1)
    lobe = np.stack((np.full(7, 100.0), 60.0 + side * np.arange(1.0, 8.0)), axis=1)
    drop, added = extend_end(padded(mask.astype(np.uint8)), np.concatenate((straight, lobe)) + 1.0, 5.5)
    assert drop >= len(lobe)
    assert abs(added[-1, 1] - 61.0) < 1.0
    assert 100.0 < added[-1, 0] < 112.5


def test_an_end_at_the_image_border_stops_there() -> None:
    frame = padded(np.pad(np.ones((9, 60), np.uint8), ((20, 20), (0, 0))))
    points = np.stack((np.arange(20.0, 57.0), np.full(37, 25.0)), axis=1)
    drop, added = extend_end(frame, points, 4.5)
    assert drop == 7
    np.testing.assert_allclose(added[-1], (60.5, 25.0), atol=0.2)


def test_what_does_not_end_is_left_alone() -> None:
    frame = padded(np.ones((9, 200), np.uint8))
    points = np.stack((np.arange(20.0, 60.0), np.full(40, 5.0)), axis=1)
    drop, added = extend_end(frame, points, 4.5)
    assert (drop, added.shape) == (0, (0, 2))


@pytest.mark.parametrize("n", range(5))
def test_too_few_points_tell_no_direction(n: int) -> None:
    frame = padded(np.ones((9, 20), np.uint8))
    drop, added = extend_end(frame, np.stack((np.arange(5.0, 5.0 + n), np.full(n, 5.0)), axis=1), 4.5)
    assert (drop, added.shape) == (0, (0, 2))


@given(random_masks)
def test_all_eight_versions_of_a_mask_give_the_same_ends(mask: np.ndarray) -> None:
    frame, points, offsets = runs_of(mask)
    middle, radius = recentre(frame, points, offsets)
    for start, stop in pairwise(offsets.tolist()):
        drop, added = extend_end(frame, middle[start:stop], float(radius[start]))
        for how in EIGHT_VERSIONS[1:]:
            branch = np.ascontiguousarray(turn_points(middle[start:stop], frame.shape, *how))
            again, moved = extend_end(np.ascontiguousarray(turn(frame, *how)), branch, float(radius[start]))
            assert again == drop
            np.testing.assert_allclose(moved, turn_points(added, frame.shape, *how), atol=1e-5)


def slow_is_seen(mask: np.ndarray, start: np.ndarray, stop: np.ndarray, width: float) -> bool:
    """List the pixels between two points, and look for the longest way from one on the mask to the next."""
    length = float(np.hypot(*(stop - start)))
    if length <= 2.0 * width:
        return True
    ahead = np.linspace(0.0, 1.0, int(length) + 2)[:, None]
    columns, rows = np.rint(start + ahead * (stop - start)).astype(int).T
    on = np.flatnonzero(mask[np.clip(rows, 0, mask.shape[0] - 1), np.clip(columns, 0, mask.shape[1] - 1)])
    return bool(np.diff(np.concatenate(([-1], on, [len(rows)]))).max() - 1 <= width / 2)


@given(random_masks, st.integers(0, 2**32 - 1))
def test_a_cable_is_seen_between_points_where_no_break_is_longer_than_half_its_width(
    mask: np.ndarray, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-3.0, (mask.shape[1] + 2.0, mask.shape[0] + 2.0), (8, 2))
    for i in range(1, len(points)):
        width = float(rng.uniform(0.5, 6.0))
        assert is_seen(mask, points, 0, i, width) == slow_is_seen(mask, points[0], points[i], width)


@pytest.mark.parametrize("gap", [1, 2, 3, 4])
def test_a_break_of_half_a_width_is_bridged(gap: int) -> None:
    mask = np.ones((5, 60), np.uint8)
    mask[:, 20 : 20 + gap] = 0
    assert is_seen(mask, np.array([[2.0, 2.0], [57.0, 2.0]]), 0, 1, 5.0) == (gap < 3)
