"""The errors of a depth camera, one by one, in the amounts that are stated; and together."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest

from dloftbs.errors import InputError
from dloftbs_lab.synthetic.depth_camera import DEPTH_CAMERAS, DepthCamera, depth_camera

SIZE = (180, 320)
WIDTH_PX = 8.0
NEAR_M, FAR_M = 0.8, 1.0
ERRORS = [field.name for field in dataclasses.fields(DepthCamera)]
SEEDS = range(20)

Scene = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def scene() -> Scene:
    """Return depth with two level cables, depth without them, their arc length in widths, and their mask."""
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    upper, lower = np.abs(rows - 50) < WIDTH_PX / 2, np.abs(rows - 120) < WIDTH_PX / 2
    inside = (columns >= 20) & (columns < 300)
    mask = (upper | lower) & inside
    along = np.where(mask, (columns - 20 + 280 * lower) / WIDTH_PX, np.nan).astype(np.float32)
    background = np.full(SIZE, FAR_M, np.float32)
    return np.where(mask, np.float32(NEAR_M), background), background, along, mask


def measured(name: str, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return depth as a camera measures it, true depth, and the mask."""
    depth, background, along, mask = scene()
    result = DEPTH_CAMERAS[name].measure(depth, background, along, mask, np.random.default_rng(seed))
    assert result.dtype == np.float32
    assert result.shape == SIZE
    np.testing.assert_array_equal(depth, scene()[0])  # it is not written to
    return result, depth, mask


def test_the_cameras_have_the_errors_one_by_one_and_together() -> None:
    has = {name: {error for error in ERRORS if getattr(camera, error)} for name, camera in DEPTH_CAMERAS.items()}
    assert has.pop("perfect") == set()
    assert has.pop("all") == set(ERRORS)
    assert has.pop("all but fattened") == set(ERRORS) - {"fattened"}
    assert has == {error: {error} for error in ERRORS}


@pytest.mark.parametrize("name", DEPTH_CAMERAS)
def test_a_camera_is_found_by_its_name(name: str) -> None:
    assert depth_camera(name) is DEPTH_CAMERAS[name]


@pytest.mark.parametrize("name", ["", "none", "Perfect"])
def test_another_name_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="errors must be one of perfect, noise, "):
        depth_camera(name)


@pytest.mark.parametrize("name", DEPTH_CAMERAS)
def test_the_same_generator_gives_the_same_depth_bit_for_bit(name: str) -> None:
    first = measured(name)[0]
    np.testing.assert_array_equal(first, measured(name)[0])
    constant = {"perfect", "steps", "misregistered"}  # the last one is a matter of where depth is rendered from
    assert any((first != measured(name, seed)[0]).any() for seed in range(1, 9)) == (name not in constant)


def test_perfect_is_perfect() -> None:
    depth, true, _ = measured("perfect")
    np.testing.assert_array_equal(depth, true)
    np.testing.assert_array_equal(DepthCamera().displacement(np.random.default_rng(0)), 0.0)


@pytest.mark.parametrize("distance", [0.4, 1.0, 1.5])
def test_noise_is_gaussian_and_grows_with_the_square_of_the_distance(distance: float) -> None:
    true = np.full(SIZE, distance, np.float32)
    _, background, along, mask = scene()
    error = DepthCamera(noise=True).measure(true, background, along, mask, np.random.default_rng(0)) - true
    sigma = 4e-3 * distance**2
    assert error.std() == pytest.approx(sigma, rel=0.02)
    assert abs(error.mean()) < 0.02 * sigma
    assert (np.abs(error) < sigma).mean() == pytest.approx(0.683, abs=0.01)
    assert abs(np.corrcoef(error[:, 1:].ravel(), error[:, :-1].ravel())[0, 1]) < 0.02  # each pixel has its own


def test_steps_are_eighths_of_a_pixel_of_disparity() -> None:
    true = np.tile(np.linspace(0.4, 1.6, SIZE[1], dtype=np.float32), (SIZE[0], 1))
    _, background, along, mask = scene()
    depth = DepthCamera(steps=True).measure(true, background, along, mask, np.random.default_rng(0))
    eighths = 8.0 * 900.0 * 0.05 / depth.astype(np.float64)
    np.testing.assert_allclose(eighths, np.rint(eighths), rtol=0, atol=1e-3)
    assert np.abs(eighths - 8.0 * 900.0 * 0.05 / true).max() == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_near_covers_2_to_4_px_more_to_every_side(seed: int) -> None:
    depth, true, mask = measured("fattened", seed)
    assert (depth <= true).all()
    np.testing.assert_array_equal(depth[mask], true[mask])
    away = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    more = (depth == np.float32(NEAR_M)) & ~mask
    assert more[(away > 0.0) & (away <= 2.0)].all()
    reach = away[more].max()
    assert 2.0 <= reach <= 4.5
    for across in (more[35:50, 160], more[51:70, 160], more[50, 5:20], more[50, 300:315]):
        assert np.count_nonzero(across) == int(reach)
    assert set(np.unique(depth)) == {np.float32(NEAR_M), np.float32(FAR_M)}


def test_it_is_fattened_by_2_3_and_4_px() -> None:
    covered = {int(np.count_nonzero(measured("fattened", seed)[0][35:46, 160] < FAR_M)) for seed in SEEDS}
    assert len(covered) == 3
    assert max(covered) - min(covered) == 2


def test_half_of_the_pixels_at_edges_lie_between_the_two_surfaces() -> None:
    depth, true, _ = measured("flying")
    kernel = np.ones((3, 3), np.uint8)
    edge = cv2.dilate(true, kernel) > cv2.erode(true, kernel)
    changed = depth != true
    assert not changed[~edge].any()
    assert changed[edge].mean() == pytest.approx(0.5, abs=0.04)
    assert ((depth[changed] > NEAR_M) & (depth[changed] < FAR_M)).all()
    assert np.ptp(depth[changed]) > 0.8 * (FAR_M - NEAR_M)


def test_10_to_30_percent_of_a_cable_have_no_depth() -> None:
    shares = []
    for seed in SEEDS:
        depth, true, mask = measured("holes", seed)
        none = depth == 0.0
        np.testing.assert_array_equal(depth[~none], true[~none])
        shares.append(none[mask].mean())
    assert 0.1 - 1e-3 <= min(shares) < 0.15
    assert 0.25 < max(shares) <= 0.3 + 1e-3


def test_depth_is_displaced_by_1_to_2_px_in_any_direction() -> None:
    rng = np.random.default_rng(0)
    displaced = np.array([DepthCamera(misregistered=True).displacement(rng) for _ in range(400)])
    size = np.linalg.norm(displaced, axis=1)
    assert 1.0 <= size.min() < 1.1
    assert 1.9 < size.max() <= 2.0
    sectors = np.floor(4.0 * np.arctan2(displaced[:, 1], displaced[:, 0]) / np.pi).astype(int)
    assert np.bincount(sectors + 4, minlength=8).min() > 25


@pytest.mark.parametrize("name", sorted(set(DEPTH_CAMERAS) - {"misregistered", "all", "all but fattened"}))
def test_no_other_error_displaces_it(name: str) -> None:
    np.testing.assert_array_equal(DEPTH_CAMERAS[name].displacement(np.random.default_rng(0)), 0.0)


def lost_widths(seed: int) -> tuple[list[float], float]:
    """Return the lengths of the stretches that show what lies behind, and the length of both cables, widths."""
    depth, true, mask = measured("behind", seed)
    lost = depth != true
    assert lost.any()
    assert (depth[lost] == np.float32(FAR_M)).all()
    gone = np.concatenate([lost[row, 20:300] for row in (50, 120)])
    for row in (47, 53, 117, 123):  # across the whole cable
        np.testing.assert_array_equal(lost[row], lost[50 if row < 90 else 120])
    assert not lost[~mask].any()
    edges = np.flatnonzero(np.diff(gone.astype(int), prepend=0, append=0)).reshape(-1, 2)
    return (np.diff(edges, axis=1)[:, 0] / WIDTH_PX).tolist(), len(gone) / WIDTH_PX


def test_along_stretches_of_3_to_8_widths_it_shows_what_lies_behind() -> None:
    shares, lengths = [], []
    for seed in range(100):
        stretches, length = lost_widths(seed)
        shares.append(sum(stretches) / length)
        lengths += stretches
    assert np.mean(shares) == pytest.approx(0.1, abs=0.02)
    assert max(shares) < 0.1 + 3.5 / length  # the last stretch has three widths, even if less are left of a tenth
    assert min(lengths) > 3.0 - 2.0 / WIDTH_PX
    assert np.quantile(lengths, 0.9) < 8.0 + 2.0 / WIDTH_PX  # where two of them overlap, they are longer


@pytest.mark.parametrize("name", ["all", "all but fattened"])
def test_together_they_are_all_there(name: str) -> None:
    depth, true, mask = measured(name)
    assert 0.08 < (depth == 0.0)[mask].mean() < 0.32
    eighths = 8.0 * 900.0 * 0.05 / depth[depth > 0.0].astype(np.float64)
    np.testing.assert_allclose(eighths, np.rint(eighths), rtol=0, atol=1e-3)
    calm = (depth > 0.0) & (cv2.dilate(mask.astype(np.uint8), np.ones((15, 15), np.uint8)) == 0)
    assert (depth - true)[calm].std() == pytest.approx(4e-3, rel=0.1)
    assert 0.03 < (depth > 0.5 * (NEAR_M + FAR_M))[mask].mean() < 0.25
    beside = (cv2.dilate(mask.astype(np.uint8), np.ones((5, 5), np.uint8)) == 1) & ~mask & (depth > 0.0)
    assert ((depth[beside] < 0.5 * (NEAR_M + FAR_M)).mean() > 0.7) == (name == "all")


def test_where_there_is_no_cable_there_are_no_holes() -> None:
    depth = np.full((40, 60), 1.0, np.float32)
    none = np.full(depth.shape, np.nan, np.float32)
    seen = DEPTH_CAMERAS["holes"].measure(depth, depth, none, np.zeros(depth.shape, bool), np.random.default_rng(0))
    np.testing.assert_array_equal(seen, depth)
