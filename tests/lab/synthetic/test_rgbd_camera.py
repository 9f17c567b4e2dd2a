"""Cables before a depth camera: what is drawn agrees with the truth; scenes and errors are as described."""

from __future__ import annotations

import pickle
from functools import cache
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs_lab.synthetic.depth_camera import DEPTH_CAMERAS
from dloftbs_lab.synthetic.rgbd_camera import DEPTH_SCENES, DepthCameraSequence, rgbd_camera
from dloftbs_lab.truth import Truth

SIZE = (360, 640)
FRAMES = 6
DIAMETERS_M = np.array([0.003, 0.005, 0.008, 0.012, 0.020])
EVERY_SCENE = pytest.mark.parametrize("kind", DEPTH_SCENES)


@cache
def sequence(kind: str, errors: str = "perfect", seed: int = 0) -> DepthCameraSequence:
    return DepthCameraSequence(kind, errors, FRAMES, SIZE, seed)


@cache
def frame_and_truth(kind: str, index: int, errors: str = "perfect", seed: int = 0) -> tuple[Frame, Truth]:
    """Return what is seen and what is so; depth and mask are there."""
    one = sequence(kind, errors, seed)
    return one.frame(index), one.truth(index)


def parts(frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Return mask and depth of a frame."""
    assert frame.mask is not None
    assert frame.depth is not None
    return frame.mask, frame.depth


def table(kind: str, index: int) -> tuple[np.ndarray, float, np.ndarray]:
    """Return the plane ``normal @ x = level`` that is seen around the cables, away from the camera, and its depth."""
    frame, _ = frame_and_truth(kind, index)
    mask, depth = parts(frame)
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    pixels = np.stack((columns, rows), axis=2).astype(float)
    rays = sequence(kind).camera.deproject(pixels.reshape(-1, 2), np.ones(rows.size)).reshape(*SIZE, 3)
    # Along a ray, 1 / depth is (normal / level) @ ray.
    plane, *_ = np.linalg.lstsq(rays[~mask], 1.0 / depth[~mask].astype(np.float64), rcond=None)
    level = 1.0 / np.linalg.norm(plane)
    return plane * level, float(level), 1.0 / (rays @ plane)


def radius_of(truth: Truth, frame: Frame) -> np.ndarray:
    """Return the distance of everything that the mask shows from the axes, (n,) m."""
    mask, depth = parts(frame)
    rows, columns = np.nonzero(mask)
    assert frame.camera is not None
    surface = frame.camera.deproject(np.stack((columns, rows), axis=1), depth[rows, columns])
    axes = np.concatenate([axis.sample(20000) for axis in truth.curves_3d])
    return cKDTree(axes).query(surface)[0]


def slopes(kind: str, index: int) -> list[np.ndarray]:
    """Return the angle of each cable against the table along it, degrees; above 0 it comes off the table."""
    normal, _, _ = table(kind, index)
    _, truth = frame_and_truth(kind, index)
    at = np.linspace(0.0, 1.0, 400)
    return [np.degrees(np.arcsin(np.clip(-axis.tangent(at) @ normal, -1.0, 1.0))) for axis in truth.curves_3d]


class TestTruth:
    @EVERY_SCENE
    def test_every_visible_pixel_lies_on_the_surface_around_an_axis(self, kind: str) -> None:
        for index in range(FRAMES):
            frame, truth = frame_and_truth(kind, index)
            distance = radius_of(truth, frame)
            diameter = DIAMETERS_M[np.abs(DIAMETERS_M - 2.0 * np.median(distance)).argmin()]
            np.testing.assert_allclose(distance, 0.5 * diameter, rtol=0, atol=1e-4)
            assert len(distance) > 200

    @EVERY_SCENE
    def test_all_else_is_one_plane(self, kind: str) -> None:
        for index in range(FRAMES):
            mask, depth = parts(frame_and_truth(kind, index)[0])
            _, _, behind = table(kind, index)
            np.testing.assert_allclose(depth[~mask], behind[~mask], rtol=1e-5)
            assert (depth[mask] < behind[mask] - 0.02).all()

    @EVERY_SCENE
    def test_the_curves_in_the_image_are_the_projections_of_the_axes(self, kind: str) -> None:
        for index in range(FRAMES):
            _, truth = frame_and_truth(kind, index)
            for flat, axis in zip(truth.curves, truth.curves_3d, strict=True):
                projected, dense = sequence(kind).camera.project(axis.sample(400)), flat.sample(20000)
                assert cKDTree(dense).query(projected)[0].max() < 0.1
                assert np.abs(projected[[0, -1]] - dense[[0, -1]]).max() < 1e-6

    @EVERY_SCENE
    def test_the_curves_in_the_image_are_by_their_arc_length(self, kind: str) -> None:
        for index in range(FRAMES):
            for curve in frame_and_truth(kind, index)[1].curves:
                speed = np.linalg.norm(curve(np.linspace(0.0, 1.0, 101), 1), axis=1)
                np.testing.assert_allclose(speed, curve.length, rtol=0.02)

    @EVERY_SCENE
    def test_so_are_the_axes(self, kind: str) -> None:
        for index in range(FRAMES):
            for curve in frame_and_truth(kind, index)[1].curves_3d:
                speed = np.linalg.norm(curve(np.linspace(0.0, 1.0, 101), 1), axis=1)
                np.testing.assert_allclose(speed, curve.length, rtol=0.02)

    @EVERY_SCENE
    def test_the_masks_of_the_cables_make_up_the_frame_s(self, kind: str) -> None:
        for index in range(FRAMES):
            frame, truth = frame_and_truth(kind, index)
            np.testing.assert_array_equal(truth.mask, frame.mask)
            assert np.sum(truth.visible_masks, axis=0).max() == 1
            count = 2 if kind == "crossing" else 1
            assert len(truth.curves) == len(truth.curves_3d) == len(truth.visible_masks) == count
            assert truth.ids == tuple(range(count))

    def test_where_cables_cross_the_nearer_one_is_seen(self) -> None:
        for index in range(FRAMES):
            _, truth = frame_and_truth("crossing", index)
            below, above = (curve.sample(4000) for curve in truth.curves)
            apart, place = cKDTree(below).query(above)
            assert apart.min() < 0.5
            column, row = below[place[apart.argmin()]].round().astype(int)
            first, second = truth.visible_masks
            assert second[row, column]
            assert not first[row, column]


class TestScenes:
    @EVERY_SCENE
    def test_cables_lie_inside_of_the_image(self, kind: str) -> None:
        for index in range(FRAMES):
            _, truth = frame_and_truth(kind, index)
            points = np.concatenate([curve.sample(400) for curve in truth.curves])
            assert (points > 0.05 * np.array(SIZE[::-1])).all()
            assert (points < 0.95 * np.array(SIZE[::-1])).all()

    @EVERY_SCENE
    def test_they_are_04_to_15_m_away(self, kind: str) -> None:
        distances = []
        for seed in range(3):
            for index in range(FRAMES):
                truth = sequence(kind, seed=seed).truth(index)
                depth = np.concatenate([axis.sample(400)[:, 2] for axis in truth.curves_3d])
                assert 0.35 < depth.min() < depth.max() < 1.6
                distances.append(depth.mean())
        assert 0.39 < min(distances) < 0.7
        assert 0.8 < max(distances) < 1.51

    @EVERY_SCENE
    def test_the_lowest_point_is_2_to_15_cm_above_the_table(self, kind: str) -> None:
        for index in range(FRAMES):
            normal, level, _ = table(kind, index)
            frame, truth = frame_and_truth(kind, index)
            axes = np.concatenate([axis.sample(2000) for axis in truth.curves_3d])
            gap = level - (axes @ normal).max() - np.median(radius_of(truth, frame))
            assert 0.02 - 3e-4 <= gap <= 0.15 + 3e-4

    def test_all_diameters_occur(self) -> None:
        found = set()
        for kind in DEPTH_SCENES:
            for index in range(FRAMES):
                frame, truth = frame_and_truth(kind, index)
                found.add(round(2000.0 * float(np.median(radius_of(truth, frame)))))
        assert found <= {3, 5, 8, 12, 20}
        assert len(found) >= 4

    def test_flat_ones_are_level_with_the_table(self) -> None:
        for index in range(FRAMES):
            (slope,) = slopes("flat", index)
            assert np.abs(slope).max() < 0.5

    def test_lifted_ones_lie_at_their_ends_and_are_up_to_15_cm_higher_in_their_middle(self) -> None:
        for index in range(FRAMES):
            normal, level, _ = table("lifted", index)
            (axis,) = frame_and_truth("lifted", index)[1].curves_3d
            height = level - axis.sample(401) @ normal
            assert height[-1] == pytest.approx(height[0], abs=1e-3)
            assert height.argmax() == pytest.approx(200, abs=5)
            lifted = height.max() - height[0]
            assert 0.005 < lifted < min(0.15, axis.length / 3.0)
            assert np.abs(slopes("lifted", index)[0][[0, -1]]).max() < 2.0

    def test_tilted_ones_come_towards_the_camera_at_up_to_70_degrees(self) -> None:
        steepest = []
        for index in range(FRAMES):
            (slope,) = slopes("tilted", index)
            assert 0.2 * 70.0 - 0.5 < slope.min() < slope.max() < 70.5
            assert (np.diff(slope) > -0.1).all() or (np.diff(slope) < 0.1).all()  # evenly, or more and more
            steepest.append(slope.max())
        assert max(steepest) > 45.0

    def test_bent_ones_are_level_and_then_40_to_70_degrees_steep(self) -> None:
        for index in range(FRAMES):
            (slope,) = slopes("bent", index)
            assert abs(slope[:60]).max() < 1.0
            assert 39.5 < abs(slope).max() < 70.5
            assert np.median(np.abs(np.diff(slope))) < 0.01  # it is level or steep, and bends shortly

    @pytest.mark.parametrize("seed", range(3))
    def test_crossing_ones_touch_and_do_not_go_through_each_other(self, seed: int) -> None:
        for index in range(FRAMES):
            frame, truth = frame_and_truth("crossing", index, seed=seed)
            below, above = (axis.sample(4000) for axis in truth.curves_3d)
            diameter = 2.0 * np.median(radius_of(truth, frame))
            assert cKDTree(below).query(above)[0].min() == pytest.approx(1.03 * diameter, rel=0.02)

    def test_each_frame_and_each_seed_is_a_scene_of_its_own(self) -> None:
        lengths = {
            sequence(kind, seed=seed).truth(index).curves_3d[0].length
            for kind in DEPTH_SCENES
            for seed in range(2)
            for index in range(FRAMES)
        }
        assert len(lengths) == 2 * FRAMES * len(DEPTH_SCENES)


class TestErrors:
    @EVERY_SCENE
    @pytest.mark.parametrize("errors", DEPTH_CAMERAS)
    def test_the_scene_is_the_same_whatever_the_errors_are(self, kind: str, errors: str) -> None:
        (perfect, true), (frame, truth) = frame_and_truth(kind, 1), frame_and_truth(kind, 1, errors)
        np.testing.assert_array_equal(frame.mask, perfect.mask)
        np.testing.assert_array_equal(frame.image, perfect.image)
        assert frame.camera == perfect.camera
        assert truth.curves_3d == true.curves_3d
        assert np.array_equal(parts(frame)[1], parts(perfect)[1]) == (errors == "perfect")

    @EVERY_SCENE
    def test_noise_is_that_of_each_pixel_s_distance(self, kind: str) -> None:
        depth, true = (parts(frame_and_truth(kind, 0, errors)[0])[1] for errors in ("noise", "perfect"))
        assert ((depth - true) / true**2).std() == pytest.approx(4e-3, rel=0.02)

    @EVERY_SCENE
    def test_depth_in_steps_is_off_by_half_a_step(self, kind: str) -> None:
        depth, true = (parts(frame_and_truth(kind, 0, errors)[0])[1] for errors in ("steps", "perfect"))
        assert np.abs(45.0 / depth - 45.0 / true).max() <= 0.5 / 8.0 + 1e-4

    @EVERY_SCENE
    def test_fattened_depth_is_never_farther_and_reaches_2_to_4_px_beyond_the_mask(self, kind: str) -> None:
        for index in range(FRAMES):
            mask, true = parts(frame_and_truth(kind, index)[0])
            _, depth = parts(frame_and_truth(kind, index, "fattened")[0])
            assert (depth <= true).all()
            _, _, behind = table(kind, index)
            more = (depth < behind - 0.015) & ~mask
            away = distance_transform_edt(~mask)
            assert 2.0 <= away[more].max() <= 4.5
            assert more[~mask & (away <= 2.0)].all()

    @EVERY_SCENE
    def test_half_of_the_pixels_at_edges_fly_between_what_is_around_them(self, kind: str) -> None:
        depth, true = (parts(frame_and_truth(kind, 0, errors)[0])[1] for errors in ("flying", "perfect"))
        near, far = (change(true, np.ones((3, 3), np.uint8)) for change in (cv2.erode, cv2.dilate))
        changed, edge = depth != true, far - near > 0.003
        assert not changed[~edge].any()
        assert changed[edge].mean() == pytest.approx(0.5, abs=0.06)
        assert ((near <= depth) & (depth <= far)).all()

    @EVERY_SCENE
    def test_holes_take_10_to_30_percent_of_the_mask(self, kind: str) -> None:
        for index in range(FRAMES):
            mask, true = parts(frame_and_truth(kind, index)[0])
            _, depth = parts(frame_and_truth(kind, index, "holes")[0])
            none = depth == 0.0
            assert 0.1 - 2e-3 <= none[mask].mean() <= 0.3 + 2e-3
            np.testing.assert_array_equal(depth[~none], true[~none])

    @EVERY_SCENE
    def test_displaced_depth_lies_1_to_2_px_beside_the_mask(self, kind: str) -> None:
        displaced = []
        for index in range(FRAMES):
            mask, depth = parts(frame_and_truth(kind, index, "misregistered")[0])
            _, _, behind = table(kind, index)
            seen = depth < behind - 0.015
            assert seen.sum() == pytest.approx(mask.sum(), rel=0.05)
            displaced.append(np.argwhere(seen).mean(axis=0) - np.argwhere(mask).mean(axis=0))
        size = np.linalg.norm(displaced, axis=1)
        assert 0.5 < size.min() < size.max() < 2.5  # a thin cable along the rows is moved by whole pixels
        assert np.linalg.norm(np.mean(displaced, axis=0)) < 1.5  # each frame has another direction

    @EVERY_SCENE
    def test_in_spells_depth_shows_the_table(self, kind: str) -> None:
        shares = []
        for index in range(FRAMES):
            mask, true = parts(frame_and_truth(kind, index)[0])
            _, depth = parts(frame_and_truth(kind, index, "behind")[0])
            _, _, behind = table(kind, index)
            lost = depth != true
            assert not lost[~mask].any()
            np.testing.assert_allclose(depth[lost], behind[lost], rtol=1e-5)
            shares.append(lost[mask].mean())
        assert min(shares) > 0.03
        assert max(shares) < 0.25
        assert np.mean(shares) == pytest.approx(0.11, abs=0.03)

    @EVERY_SCENE
    def test_with_all_of_them_most_of_a_cable_still_shows(self, kind: str) -> None:
        for index in range(FRAMES):
            mask, depth = parts(frame_and_truth(kind, index, "all")[0])
            true = parts(frame_and_truth(kind, index)[0])[1]
            assert (np.abs(depth - true) < 0.02)[mask].mean() > 0.5
            assert 0.1 - 2e-3 <= (depth == 0.0)[mask].mean() <= 0.3 + 2e-3


class TestSequence:
    @pytest.mark.parametrize("errors", ["perfect", "all"])
    @EVERY_SCENE
    def test_frames_are_the_same_bit_for_bit_in_any_order_and_after_pickling(self, kind: str, errors: str) -> None:
        one = DepthCameraSequence(kind, errors, FRAMES, SIZE, 3)
        frames = [one.frame(index) for index in (4, 2, 4)]
        for other in (DepthCameraSequence(kind, errors, FRAMES, SIZE, 3), pickle.loads(pickle.dumps(one))):
            frame = other.frame(4)
            for expected in (frames[0], frames[2]):
                for ours, theirs in zip(parts(frame), parts(expected), strict=True):
                    np.testing.assert_array_equal(ours, theirs)
                np.testing.assert_array_equal(frame.image, expected.image)
            assert other.truth(4).curves == one.truth(4).curves
            assert other.truth(4).curves_3d == one.truth(4).curves_3d
        assert not np.array_equal(parts(frames[1])[0], parts(frames[0])[0])

    def test_a_frame_does_not_depend_on_how_many_there_are(self) -> None:
        frame = DepthCameraSequence("bent", "all", 2, SIZE).frame(1)
        for ours, theirs in zip(parts(frame), parts(frame_and_truth("bent", 1, "all")[0]), strict=True):
            np.testing.assert_array_equal(ours, theirs)

    def test_a_pickle_is_small_even_after_use(self) -> None:
        one = DepthCameraSequence("crossing", "all", FRAMES, SIZE)
        one.frame(0)
        one.truth(0)
        assert len(pickle.dumps(one)) < 10_000

    def test_frames_carry_what_a_tracker_needs(self) -> None:
        one = sequence("tilted", "holes")
        frame, _ = frame_and_truth("tilted", 4, "holes")
        mask, depth = parts(frame)
        assert mask.dtype == np.bool_
        assert depth.dtype == np.float32
        assert frame.image is not None
        assert frame.image.dtype == np.uint8
        assert frame.image.shape == (*SIZE, 3)
        assert mask.shape == depth.shape == SIZE
        assert frame.camera == one.camera
        assert (frame.index, frame.stamp, frame.name) == (4, None, "tilted, holes#0004")
        assert len(one) == FRAMES
        assert [f.index for f in one] == list(range(FRAMES))

    def test_the_field_of_view_is_that_of_an_hd_image(self) -> None:
        for size, focal in (((720, 1280), 900.0), (SIZE, 450.0), ((180, 320), 225.0)):
            assert DepthCameraSequence("flat", size=size).camera.fx == pytest.approx(focal)

    @pytest.mark.parametrize(
        ("wrong", "why"),
        [
            ({"kind": "round"}, "kind must be one of 'flat', 'lifted', 'tilted', 'bent', 'crossing', got 'round'"),
            ({"errors": "some"}, "errors must be one of perfect, noise, .*, got 'some'"),
            ({"frames": 0}, "frames >= 1"),
            ({"seed": -1}, "seed >= 0"),
            ({"size": (63, 640)}, "64 x 64"),
        ],
    )
    def test_values_out_of_range_are_refused(self, wrong: dict[str, Any], why: str) -> None:
        with pytest.raises(InputError, match=why):
            DepthCameraSequence(**({"kind": "flat"} | wrong))

    @pytest.mark.parametrize("index", [-1, FRAMES])
    def test_a_frame_that_is_not_there_is_refused(self, index: int) -> None:
        for get in (sequence("flat").frame, sequence("flat").truth):
            with pytest.raises(InputError, match=r"index must be in 0\.\.5"):
                get(index)


class TestSuite:
    def test_every_kind_comes_before_every_camera(self) -> None:
        suite = rgbd_camera()
        assert [(one.kind, one.name) for one in suite] == [
            (kind, f"{kind}, {errors}") for errors in DEPTH_CAMERAS for kind in DEPTH_SCENES
        ]
        assert [one.errors for one in suite] == [camera for camera in DEPTH_CAMERAS.values() for _ in DEPTH_SCENES]
        assert {(len(one), one.size, one.seed) for one in suite} == {(32, (720, 1280), 0)}

    @pytest.mark.parametrize(("scale", "frames"), [(0.25, 8), (0.001, 1), (2.0, 64)])
    def test_scale_multiplies_the_frames_and_leaves_at_least_one(self, scale: float, frames: int) -> None:
        suite = rgbd_camera(scale, 5, SIZE)
        assert {(len(one), one.size, one.seed) for one in suite} == {(frames, SIZE, 5)}

    @pytest.mark.parametrize(
        "wrong", [{"scale": 0.0}, {"scale": float("nan")}, {"scale": 101.0}, {"seed": -1}, {"size": (10, 100)}]
    )
    def test_values_out_of_range_are_refused(self, wrong: dict[str, Any]) -> None:
        with pytest.raises(InputError, match="expected"):
            rgbd_camera(**wrong)


def test_an_image_in_which_every_cable_is_too_thin_is_refused() -> None:
    with pytest.raises(InputError, match="make it larger"):
        DepthCameraSequence("flat", "perfect", 1, (64, 64))
