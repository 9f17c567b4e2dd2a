"""Skeletons moved to the middle of the mask."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, random_mask, random_masks, turn, turn_points
from hypothesis import example, given
from scipy.spatial import cKDTree
from skeletons import fast_skeleton, listed, padded

from dloftbs.cleaning import clean
from dloftbs.config import CleaningConfig
from dloftbs.data.curve import BSplineCurve
from dloftbs.kernels.tracing import trace
from dloftbs.skeleton.kernels.recentring import recentre
from dloftbs_lab.synthetic import NOISY, draw_tube_mask, random_curve

SIZE = (300, 500)


def runs_of(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a mask in the kernels' frame, and the points and offsets of its skeleton's runs."""
    grid = fast_skeleton(mask)
    points, offsets, _ = trace(grid, *listed(grid))
    return padded(mask), points, offsets


def tube(width: float, seed: int, *, noisy: bool = False) -> tuple[np.ndarray, BSplineCurve]:
    """Return a mask of one cable without crossings, and its axis in the coordinates of the kernels' frame."""
    rng = np.random.default_rng(seed)
    curve = random_curve(rng, 400.0, SIZE, min_radius_px=max(2.0 * width, 40.0))
    mask = draw_tube_mask(curve, width, SIZE)
    if noisy:
        mask = NOISY.apply(mask, [curve], (seed,))
    crop = clean(mask, CleaningConfig(close_px=3, open_px=3 if width > 3.0 else 1))
    assert crop is not None
    mask = np.zeros(SIZE)
    (x, y), (h, w) = crop.origin, crop.size
    mask[y : y + h, x : x + w] = crop.pixels[1 : h + 1, 1 : w + 1]
    return mask.astype(np.uint8), curve.transformed(np.eye(2), (1.0, 1.0))


def distances(points: np.ndarray, axis: BSplineCurve, off_end: float) -> np.ndarray:
    """Return how far the points are from the axis, without those near its ends."""
    ends = axis.sample(2)
    near_end = cKDTree(ends).query(points)[0] < off_end
    return cKDTree(axis.sample(8000)).query(points[~near_end])[0]


@pytest.mark.parametrize("width", [2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 40.0])
def test_points_come_to_the_axis_and_the_radius_is_half_the_width(width: float) -> None:
    before, after, radii = [], [], []
    for seed in range(4):
        mask, axis = tube(width, seed)
        frame, points, offsets = runs_of(mask)
        middle, radius = recentre(frame, points, offsets)
        before.append(distances(points, axis, 1.5 * width))
        after.append(distances(middle, axis, 1.5 * width))
        radii.append(np.median(radius))
    assert np.mean(np.concatenate(after)) < 0.15
    assert np.mean(np.concatenate(after)) < 0.4 * np.mean(np.concatenate(before))
    assert np.mean(radii) == pytest.approx(width / 2.0, abs=0.15)


@pytest.mark.parametrize("width", [8.0, 12.0, 20.0])
def test_ragged_edges_enter_only_in_part(width: float) -> None:
    before, after = [], []
    for seed in range(4):
        mask, axis = tube(width, seed, noisy=True)
        frame, points, offsets = runs_of(mask)
        long = np.repeat(np.diff(offsets), np.diff(offsets)) > 2 * width
        middle, _ = recentre(frame, points, offsets)
        before.append(distances(points[long], axis, 1.5 * width))
        after.append(distances(middle[long], axis, 1.5 * width))
    assert np.mean(np.concatenate(after)) < 0.75 * np.mean(np.concatenate(before))


@given(random_masks)
@example(random_mask(208))  # loops of four pixels, which have no direction once they are smoothed
@example(random_mask(825))
def test_all_eight_versions_of_a_mask_give_the_same_points(mask: np.ndarray) -> None:
    frame, points, offsets = runs_of(mask)
    middle, radius = recentre(frame, points, offsets)
    for how in EIGHT_VERSIONS[1:]:
        turned = np.ascontiguousarray(turn(frame, *how))
        moved, again = recentre(turned, turn_points(points, frame.shape, *how), offsets)
        np.testing.assert_allclose(moved, turn_points(middle, frame.shape, *how), atol=1e-9)
        np.testing.assert_allclose(again, radius, atol=1e-9)


def test_a_strided_view_gives_the_same_as_a_copy() -> None:
    frame, points, offsets = runs_of(random_mask(2, 60))
    wide = np.zeros((frame.shape[0], 2 * frame.shape[1]), np.uint8)
    wide[:, ::2] = frame
    for ours, expected in zip(recentre(wide[:, ::2], points, offsets), recentre(frame, points, offsets), strict=True):
        np.testing.assert_array_equal(ours, expected)


def test_a_straight_band_is_hit_exactly() -> None:
    mask = np.zeros((30, 80), np.uint8)
    mask[10:16, 5:75] = 1  # the middle lies between two rows of pixels
    points = np.stack((np.arange(10.0, 70.0), np.full(60, 12.0)), axis=1)
    middle, radius = recentre(mask, points, np.array([0, 60]))
    np.testing.assert_allclose(middle[10:-10], points[10:-10] + np.array([0.0, 0.5]), atol=0.01)
    np.testing.assert_allclose(radius, 3.0, atol=0.01)


def test_a_loop_has_no_seam() -> None:
    y, x = np.mgrid[:101, :101]
    frame, points, offsets = runs_of((np.abs(np.hypot(x - 50.2, y - 50.4) - 36.0) <= 5.0).astype(np.uint8))
    middle, radius = recentre(frame, points, offsets)
    assert len(offsets) == 2
    assert np.abs(np.hypot(*(middle - (51.2, 51.4)).T) - 36.0).max() < 0.35
    np.testing.assert_allclose(radius, 5.0, atol=0.4)


def test_a_second_cable_beside_the_first_does_not_draw_it_over() -> None:
    mask = np.zeros((40, 202), np.uint8)
    mask[10:17, 1:201] = 1
    alone = mask.copy()
    mask[17:24, 90:112] = 1
    points = np.stack((np.arange(5.0, 195.0), np.full(190, 13.0)), axis=1)
    middle, radius = recentre(mask, points, np.array([0, 190]))
    expected, _ = recentre(alone, points, np.array([0, 190]))
    np.testing.assert_allclose(middle, expected, atol=0.2)
    np.testing.assert_allclose(radius, 3.5, atol=0.2)


@pytest.mark.parametrize("seed", [0, 108, 202, 227, 280])
def test_no_point_is_taken_off_the_mask_by_a_blob(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mask = tube(9.0, seed)[0]
    y, x = np.nonzero(mask)
    corners = rng.normal((x[0], y[0]), (70.0, 45.0), (6, 2))
    cv2.fillConvexPoly(mask, cv2.convexHull(corners.astype(np.int32)), 1)
    frame, points, offsets = runs_of(mask)
    middle, _ = recentre(frame, points, offsets)
    assert cKDTree(np.argwhere(frame)[:, ::-1]).query(middle)[0].max() < 1.5 * np.sqrt(2.0)


def test_runs_of_one_or_two_points_and_none() -> None:
    mask = padded(np.ones((5, 9), np.uint8))
    points = np.array([[5.0, 3.0], [3.0, 3.0], [4.0, 3.0]])
    middle, radius = recentre(mask, points, np.array([0, 1, 3]))
    assert np.isfinite(middle).all()
    assert (radius > 0.0).all()
    middle, radius = recentre(mask, np.empty((0, 2)), np.array([0]))
    assert (middle.shape, radius.shape) == ((0, 2), (0,))


def test_the_points_given_are_not_changed() -> None:
    frame, points, offsets = runs_of(tube(12.0, 0)[0])
    before = points.copy()
    middle, _ = recentre(frame, points, offsets)
    np.testing.assert_array_equal(points, before)
    assert np.abs(middle - points).max() < 2.0


def dashed(width: float, dash: float, gap: float, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a mask of a straight dashed line at some angle, a point of its axis in the kernels' frame, and its normal.

    Dashes are the pixels whose middles lie within them: on average as wide as said, whatever the angle.
    """
    rng = np.random.default_rng(seed)
    angle, middle, phase = rng.uniform(0.0, np.pi), 60.0 + rng.uniform(-0.5, 0.5, 2), rng.uniform(0.0, dash + gap)
    y, x = np.mgrid[:121, :121]
    along = (x - middle[0]) * np.cos(angle) + (y - middle[1]) * np.sin(angle)
    across = (y - middle[1]) * np.cos(angle) - (x - middle[0]) * np.sin(angle)
    mask = (-width / 2.0 <= across) & (across < width / 2.0) & (abs(along) < 55.0)
    mask &= (along + phase) % (dash + gap) < dash
    return mask.astype(np.uint8), middle + 1.0, np.array([-np.sin(angle), np.cos(angle)])


@pytest.mark.parametrize("width", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("dash", [5.0, 8.0, 14.0, 25.0])
@pytest.mark.parametrize("gap", [0.5, 1.0, 4.0])
def test_dashes_of_a_few_pixels_have_their_width_and_place(width: float, dash: float, gap: float) -> None:
    widths, beside = [], []
    for seed in range(40):
        mask, on_axis, normal = dashed(width, dash, gap * dash, seed)
        frame, points, offsets = runs_of(mask)
        middle, radius = recentre(frame, points, offsets)
        widths.append(2.0 * np.median(radius))
        beside.append(np.mean((middle - on_axis) @ normal))
    assert np.mean(abs(np.array(widths) / width - 1.0) <= 0.25) >= 0.9  # the rest are staircases, wider by themselves
    assert np.mean(widths) == pytest.approx(width, rel=0.15)
    assert abs(np.mean(beside)) < 0.2


@pytest.mark.parametrize("angle", range(0, 180, 15))
def test_a_drawn_line_of_one_pixel_is_one_pixel_wide(angle: int) -> None:
    mask = np.zeros((61, 61), np.uint8)
    along = 25.0 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    a, b = np.rint(30.0 - along).astype(int), np.rint(30.0 + along).astype(int)
    cv2.line(mask, a.tolist(), b.tolist(), 1)
    frame, points, offsets = runs_of(mask)
    _, radius = recentre(frame, points, offsets)
    np.testing.assert_allclose(2.0 * radius, 1.0, atol=0.25)
