"""Rigs: what is taken, what is refused, and curves in space from two views."""

from __future__ import annotations

import json
import logging
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stereo_views import (
    BENT,
    CAMERA,
    OTHER,
    RADIUS_M,
    angular_mask,
    axis_through,
    beside,
    depths_m,
    distances_m,
    masks,
    rig,
)

from dloftbs import CameraRig, Config, Frame, InputError, PinholeCamera, Pipeline
from dloftbs.stereo import RigObject


def test_a_cable_is_where_it_was_drawn_and_its_deviation_holds():
    r = rig()
    result = r.detect(masks(r, BENT))
    (one,) = result.objects
    assert one.members == (0, 0)
    assert one.no_3d_reason is None
    apart = distances_m(one.curve_3d, BENT)
    assert apart.mean() < 0.0025
    std = one.curve_3d_std(np.linspace(0.03, 0.97, 101))
    assert (apart < 2.5 * std).mean() > 0.9
    assert one.width_m == pytest.approx(2 * RADIUS_M, rel=0.1)
    assert one.confidence > 0.9


@settings(max_examples=8, deadline=None)
@given(baseline=st.floats(0.05, 0.25), turn=st.floats(-0.1, 0.3), bend=st.floats(-0.06, 0.06), far=st.floats(0.5, 0.9))
def test_what_is_projected_and_found_again_is_the_same(baseline, turn, bend, far):
    r = rig(baseline, min(turn, baseline / far))
    axis = axis_through([(0.0, -0.12, far), (bend, -0.03, far + bend), (-bend, 0.05, far), (0.02, 0.12, far - bend)])
    (one,) = r.detect(masks(r, axis)).objects
    assert one.curve_3d is not None
    apart, std = distances_m(one.curve_3d, axis), one.curve_3d_std(np.linspace(0.03, 0.97, 101))
    assert (apart < 4.0 * std + 1e-4).mean() > 0.9


def test_the_curve_runs_as_that_of_the_first_view_and_each_view_has_it_in_its_own_frame():
    r = rig()
    result = r.detect(masks(r, BENT))
    (one,), curve = result.objects, result.objects[0].curve_3d
    for view, detection in enumerate(result.views):
        seen = r.cameras[view].project(detection[0].curve_3d([0.1, 0.9]))
        assert np.abs(seen - detection[0].curve(detection[0].u_2d([0.1, 0.9]))).max() < 1.5
    assert np.allclose(result.views[0][0].curve_3d.control_points, curve.control_points)
    assert one.inferred_3d == result.views[0][0].inferred_3d
    for view in result.views:
        here, there = view[0].curve_3d_std([0.1, 0.4]), view[0].reversed().curve_3d_std([0.9, 0.6])
        assert np.allclose(here, there)
        assert np.allclose(here, one.curve_3d_std([0.1, 0.4])) or np.allclose(here, one.curve_3d_std([0.9, 0.6]))


def test_cables_are_matched_to_themselves():
    r = rig()
    both = masks(r, BENT, OTHER)
    result = r.detect(both)
    placed = [one for one in result if one.curve_3d is not None]
    assert len(placed) == 2
    means = sorted((distances_m(one.curve_3d, axis).mean()) for one in placed for axis in (BENT, OTHER))
    assert means[1] < 0.004 < means[2]


def test_what_one_view_shows_alone_says_so():
    r = rig()
    left, right = masks(r, BENT)
    left[200:206, 20:120] = True
    result = r.detect([left, right])
    (alone,) = [one for one in result if one.curve_3d is None]
    assert alone.members[1] is None
    assert "one view alone" in alone.no_3d_reason
    assert result.objects[0].curve_3d is not None
    with pytest.raises(InputError, match="one view alone"):
        alone.curve_3d_std(0.5)


STEEP = axis_through([(0.01, -0.25, 0.0), (-0.01, -0.1, 0.02), (0.01, 0.05, -0.02), (0.0, 0.22, 0.0)])


def wide_views(r: CameraRig, axis: np.ndarray, radius_m: float) -> list[np.ndarray]:
    pairs = zip(r.cameras, r.poses, strict=True)
    return [angular_mask(camera, camera.size, (axis - pose[:3, 3]) @ pose[:3, :3], radius_m) for camera, pose in pairs]


def test_far_from_the_middle_of_one_view_a_cable_has_its_partner_and_its_width():
    camera = PinholeCamera(450.0, 450.0, 319.5, 179.5, size=(360, 640))
    r, axis = rig(0.3, camera=camera), np.add(STEEP, (0.53, 0.0, 0.8))
    (one,) = r.detect(wide_views(r, axis, 0.008)).objects
    assert one.members == (0, 0)
    assert one.width_m == pytest.approx(0.016, rel=0.03)
    assert distances_m(one.curve_3d, axis).mean() < 0.001


@pytest.mark.parametrize(
    "camera",
    [
        PinholeCamera(500.0, 500.0, 639.5, 359.5, size=(720, 1280)),
        PinholeCamera(500.0, 500.0, 639.5, 359.5, (0.01, 0.0, 0.0, 0.0), "fisheye", size=(720, 1280)),
        PinholeCamera(700.0, 700.0, 639.5, 359.5, (-0.25, 0.06, 0.0, 0.0), size=(720, 1280)),
    ],
    ids=["no lens", "fisheye", "polynomial"],
)
def test_far_from_the_middle_widths_hold_and_with_a_lens_deviations_do(camera):
    r, axis = rig(0.06, camera=camera), np.add(STEEP, (0.8, 0.0, 0.7))
    (one,) = r.detect(wide_views(r, axis, 0.008)).objects
    assert one.width_m == pytest.approx(0.016, rel=0.03)
    apart, std = distances_m(one.curve_3d, axis), one.curve_3d_std(np.linspace(0.03, 0.97, 101))
    if camera.distortion:
        assert (apart < std).mean() > 0.6
    assert (apart < 2.0 * std).mean() > 0.8


def ring(tilt: float) -> np.ndarray:
    angle = np.linspace(0.0, 2.0 * np.pi, 1500)
    across = 0.09 * np.sin(angle)
    return np.stack((0.08 * np.cos(angle), across, 0.6 + tilt * across + 0.02 * np.sin(2.0 * angle)), axis=1)


def test_a_loop_is_a_loop_in_space():
    r, axis = rig(), ring(0.3)
    (one,) = r.detect(masks(r, axis)).objects
    assert one.curve_3d.closed
    assert one.curve_3d.length == pytest.approx(np.linalg.norm(np.diff(axis, axis=0), axis=1).sum(), rel=0.05)
    apart = distances_m(one.curve_3d, axis)
    assert np.median(apart) < 0.002
    assert (apart < 3.0 * one.curve_3d_std(np.linspace(0.03, 0.97, 101))).mean() > 0.9


@pytest.mark.parametrize("view", [0, 1])
def test_a_loop_that_one_view_shows_in_part_is_bridged(view):
    r, axis = rig(), ring(0.0)
    views = masks(r, axis)
    columns = np.flatnonzero(views[view].any(axis=0))
    views[view][100:140, columns[-20] :] = False
    result = r.detect(views)
    one = result.objects[0]
    assert one.curve_3d.closed
    assert one.inferred_3d
    assert np.median(distances_m(one.curve_3d, axis)) < 0.003


def test_beyond_the_field_of_a_lens_nothing_is_put_together():
    strong = replace(CAMERA, distortion=(-1.5, 0.0, 0.0, 0.0))
    r = CameraRig([strong, strong], [np.eye(4), beside(0.1)])
    corner = np.zeros((240, 320), bool)
    corner[4:10, 4:100] = True
    assert "field of the lens" in r.detect([corner, corner])[0].no_3d_reason


def test_masks_of_any_integers():
    r = rig()
    views = masks(r, BENT)
    a, b = r.detect(views)[0], r.detect([view.astype(np.int32) * 7 for view in views])[0]
    assert np.array_equal(a.curve_3d.control_points, b.curve_3d.control_points)


@pytest.mark.parametrize("hidden", [0, 1])
def test_a_part_hidden_in_one_view_is_bridged_and_said(hidden):
    r = rig()
    views = masks(r, BENT, OTHER)
    whole = r.detect(views)
    views[hidden][100:140, (130, 90)[hidden] :] = False
    result = r.detect(views)
    assert [len(view) for view in result.views] == [3 - hidden, 2 + hidden]
    one = next(one for one in result if len(one.pieces[hidden]) == 2)
    assert one.members[hidden] in one.pieces[hidden]
    early = one.reversed()  # before anybody measured its spans
    assert one.inferred_3d
    turned = np.array([(1.0 - high, 1.0 - low) for low, high in one.inferred_3d[::-1]])
    assert np.allclose(early.inferred_3d, turned, atol=1e-9)
    assert np.allclose(one.reversed().inferred_3d, turned, atol=1e-9)
    assert one.curve_3d.length == pytest.approx(max(each.curve_3d.length for each in whole), rel=0.03)
    assert distances_m(one.curve_3d, BENT).max() < 0.02
    assert all(each.curve_3d is not None for each in result)
    assert one.reversed().pieces[hidden] == one.pieces[hidden][::-1]
    (part,) = set(one.pieces[hidden]) - {one.members[hidden]}
    assert f"object of detection {one.members[hidden]}" in result.views[hidden][part].no_3d_reason


def test_what_is_put_together_under_a_rig_in_doubt_keeps_its_own_depth_and_its_confidence(monkeypatch):
    r = rig()
    views = masks(r, BENT)
    views[1][100:140] = False
    depth = [depths_m(r, BENT, view) for view in (0, 1)]
    (sure,) = r.detect(views).objects
    assert len(sure.pieces[1]) == 2
    monkeypatch.setattr("dloftbs.stereo.rig.RigDoubts.about_poses", lambda *_: "the rig is in doubt")
    result = r.detect(views)
    assert [one.confidence for one in result] == [sure.confidence]
    assert {one.no_3d_reason for view in result.views for one in view} == {"the rig is in doubt"}
    assert all(one.curve_3d is not None for view in r.detect(views, depth=depth).views for one in view)


def test_harnesses_have_the_curves_in_space():
    r = rig()
    result = r.detect(masks(r, BENT), config=Config().replace({"linking.branched": True}))
    for view in result.views:
        (harness,) = view.harnesses
        assert harness.detections is view.detections
        assert harness.length_3d == view[0].curve_3d.length


def test_two_cables_end_to_end_in_both_views_stay_two():
    r = rig()
    result = r.detect(masks(r, BENT[:500], BENT[1000:]))
    assert [len(view) for view in result.views] == [2, 2]
    assert [one.pieces for one in result] == [((0,), (0,)), ((1,), (1,))]


def test_along_epipolar_lines_the_deviation_is_large():
    r = rig(0.06)
    level = axis_through([(-0.2, 0.0, 0.7), (-0.1, 0.001, 0.7), (0.05, 0.0, 0.7), (0.15, 0.03, 0.7)])
    steep = axis_through([(0.0, -0.2, 0.7), (0.0, -0.1, 0.7), (0.0, 0.05, 0.7), (0.02, 0.15, 0.7)])
    stds = [r.detect(masks(r, axis)).objects[0] for axis in (level, steep)]
    assert stds[0].curve_3d_std(0.4) > 3.0 * stds[1].curve_3d_std(0.4)


def test_depth_of_a_view_counts_by_its_deviation():
    r = rig(0.06)
    level = axis_through([(-0.2, 0.0, 0.7), (-0.1, 0.001, 0.68), (0.05, 0.0, 0.72), (0.15, 0.03, 0.7)])
    views = masks(r, level)
    apart = []
    for depth in (None, [depths_m(r, level, 0), None], [None, depths_m(r, level, 1)]):
        one = r.detect(views, depth=depth)[0]
        apart.append(distances_m(one.curve_3d, level).mean())
        assert one.curve_3d_std([0.1, 0.5]).max() > apart[-1] / 3.0
    assert max(apart[1:]) < 0.001 < 0.01 < apart[0]


def test_depth_gives_metres_to_what_one_view_shows_alone():
    r = rig()
    left, right = masks(r, BENT)
    right[:] = False
    (one,) = r.detect([left, right], depth=[depths_m(r, BENT, 0), np.zeros(right.shape, np.float32)])
    assert one.members == (0, None)
    assert distances_m(one.curve_3d, BENT).mean() < 0.001
    assert one.curve_3d_std(0.5) < 0.005


def test_stated_errors_of_the_rig_enter_the_deviation():
    r = rig()
    wrong = CameraRig(r.cameras, r.poses, rotation_std_deg=0.2, pixel_std=0.5)
    views = masks(r, BENT)
    plain, known = r.detect(views).objects[0], wrong.detect(views).objects[0]
    assert known.curve_3d_std(0.5) > 1.5 * plain.curve_3d_std(0.5)


def test_views_fit_that_are_off_by_as_much_as_the_rig_states():
    camera = PinholeCamera(900.0, 900.0, 639.5, 359.5, size=(720, 1280))
    r, angle = rig(camera=camera), np.linspace(0.0, np.pi, 1500)
    arch = np.stack((0.12 * np.cos(angle) + 0.02, 0.12 * np.sin(angle) - 0.06, 0.6 + 0.1 * np.cos(angle)), axis=1)
    off = np.eye(4)
    off[1:3, 1:3] = [[np.cos(0.016), -np.sin(0.016)], [np.sin(0.016), np.cos(0.016)]]
    poses, views = [r.poses[0], r.poses[1] @ off], wide_views(r, arch, RADIUS_M)
    assert "its views disagree" in CameraRig(r.cameras, poses).detect(views)[0].no_3d_reason
    (one,) = CameraRig(r.cameras, poses, rotation_std_deg=1.0).detect(views).objects
    assert distances_m(one.curve_3d, arch).mean() < 3.0 * one.curve_3d_std(np.linspace(0.0, 1.0, 101)).mean()


def test_images_with_masks_and_colours():
    r = rig()
    images = [np.where(mask[..., None], (0, 0, 255), (90, 90, 90)).astype(np.uint8) for mask in masks(r, BENT)]
    by_colour = r.detect(images, hsv="red").objects[0]
    by_mask = r.detect(images, mask=masks(r, BENT)).objects[0]
    assert np.allclose(by_colour.curve_3d.control_points, by_mask.curve_3d.control_points)


def test_the_values_of_masks_are_what_is_said_of_them(tmp_path):
    r = rig()
    views = masks(r, BENT)
    images = [np.zeros((*view.shape, 3), np.uint8) for view in views]
    unsure = [np.float32(view) * 0.3 for view in views]
    paths = [tmp_path / f"{number}.npy" for number in range(2)]
    for path, view in zip(paths, unsure, strict=True):
        np.save(path, view)
    expected = r.detect(views)[0].curve_3d.control_points
    for seen, options in ((unsure, {}), (paths, {}), (images, {"mask": unsure})):
        assert np.array_equal(r.detect(seen, mask_is="binary", **options)[0].curve_3d.control_points, expected)
        assert len(r.detect(seen, **options)) == 0


def test_pictures_are_read_as_stored(tmp_path):
    pytest.importorskip("PIL")
    from picture_files import pillow  # which needs it

    r = rig()
    views = masks(r, BENT)
    paths = [tmp_path / f"{number}.png" for number in range(2)]
    for path, view in zip(paths, views, strict=True):
        path.write_bytes(pillow(view.astype(np.uint8) * 255, "PNG", orientation=3))
    assert np.array_equal(r.detect(paths)[0].curve_3d.control_points, r.detect(views)[0].curve_3d.control_points)


def test_one_camera_that_moves():
    r = rig()
    views = masks(r, BENT)
    moved = CameraRig([CAMERA]).detect(views, poses=r.poses).objects[0]
    assert np.array_equal(moved.curve_3d.control_points, r.detect(views).objects[0].curve_3d.control_points)
    turned = beside(0.3, 0.2)
    again = CameraRig([CAMERA]).detect(views, poses=[turned @ pose for pose in r.poses]).objects[0]
    assert np.allclose(again.curve_3d.control_points, moved.curve_3d.control_points, atol=1e-6)


def test_views_of_one_moment_have_planes_of_their_own():
    across = np.broadcast_to((np.arange(320) - CAMERA.cx) / CAMERA.fx, (240, 320))
    depths = [0.7 / (1.0 + slope * across) for slope in (0.0, 0.1)]
    for depth in depths:
        depth[115:125, 30:290] -= 0.01
    images = [np.zeros((240, 320, 3), np.uint8)] * 2
    config = Config().replace({"segmentation.plane.height_m": 0.004})
    poses = [np.eye(4), beside(0.05)]
    found = CameraRig([CAMERA]).detect(images, poses=poses, depth=depths, config=config)
    alone = Pipeline(config).detect(Frame(image=images[1], depth=depths[1], camera=CAMERA))
    assert [one.curve for one in found.views[1]] == [one.curve for one in alone]


def test_three_views():
    r = CameraRig([CAMERA] * 3, [np.eye(4), beside(0.08), beside(0.16)])
    result = r.detect(masks(r, BENT))
    (one,) = result.objects
    assert one.members == (0, 0, 0)
    assert distances_m(one.curve_3d, BENT).mean() < 0.002


def test_the_same_views_give_the_same_bits():
    r = rig()
    views = masks(r, BENT, OTHER)
    a, b = r.detect(views), r.detect(views)
    assert [one.to_dict() for one in a] == [one.to_dict() for one in b]


def test_a_rig_survives_its_dictionary():
    r = CameraRig(
        [CAMERA, replace(CAMERA, distortion=(0.1, 0, 0, 0))],
        [np.eye(4), beside(0.1, 0.2)],
        pixel_std=0.3,
        triggered=True,
    )
    again = CameraRig.from_dict(json.loads(json.dumps(r.to_dict())))
    assert again.cameras == r.cameras
    assert np.allclose(again.poses, r.poses, atol=1e-12)
    assert (again.pixel_std, again.rotation_std_deg, again.time_std_s, again.triggered) == (0.3, 0.0, 0.0, True)


@pytest.mark.parametrize("cables", [(BENT,), (BENT, OTHER)])
def test_views_that_are_exchanged_are_named(cables, caplog):
    r = rig()
    with caplog.at_level(logging.WARNING):
        result = r.detect(masks(r, *cables)[::-1])
    assert "left and right" in caplog.text
    assert "left and right" in result.objects[0].no_3d_reason


def test_inverted_poses_are_named(caplog):
    r = rig(0.1, 0.02)
    views = masks(r, BENT)
    wrong = CameraRig(r.cameras, [np.linalg.inv(pose) for pose in r.poses])
    with caplog.at_level(logging.WARNING):
        result = wrong.detect(views)
    assert "exchanged" in caplog.text or "inverted" in caplog.text
    assert all(one.curve_3d is None for one in result)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CameraRig([CAMERA, CAMERA], [np.eye(4), beside(60.0)]), "divide their translations by 1000"),
        (lambda: CameraRig([CAMERA, CAMERA], [np.eye(4), np.eye(4)]), "at the same place"),
        (
            lambda: CameraRig([CAMERA] * 3, [np.eye(4), beside(0.1), beside(0.1)]),
            "cameras 1 and 2 are at the same place",
        ),
        (lambda: CameraRig([CAMERA, CAMERA]), "need their poses"),
        (lambda: CameraRig([]), "one for each view"),
        (lambda: CameraRig([CAMERA, CAMERA], [np.eye(4)]), "poses must be 2"),
        (lambda: CameraRig([CAMERA, CAMERA], [np.eye(4), np.eye(3)]), r"shape \(4, 4\)"),
        (lambda: CameraRig([CAMERA, CAMERA], [np.eye(4), 2.0 * beside(0.1)]), "rotation"),
        (lambda: CameraRig([CAMERA, CAMERA], [np.eye(4), beside(0.1)[[0, 1, 2, 2]]]), "last row"),
        (lambda: CameraRig.from_dict({}), "cameras"),
        (lambda: CameraRig.from_dict({"cameras": [CAMERA.to_dict()]}), "needs its pose"),
        (lambda: rig().detect([np.zeros((240, 320), bool)]), "two views or more"),
        (lambda: rig().detect([np.zeros((240, 320), bool)] * 3), "as many as the rig's cameras, 2, got 3"),
        (lambda: CameraRig([CAMERA]).detect([np.zeros((240, 320), bool)] * 2), "needs poses="),
        (lambda: rig().detect([np.zeros((240, 320), bool), np.zeros((120, 160), bool)]), "view 1.*camera.scaled"),
        (lambda: rig().detect([np.zeros((240, 320), bool)] * 2, mask=[1]), "mask must be a list, one for each of 2"),
        (lambda: rig().project([1.0, 2.0]), "shape"),
        (lambda: rig().detect(None), "views must be a list"),
        (lambda: RigObject((0, None), pieces=((1,), ())), "each view's member"),
        (lambda: RigObject((0, None), pieces=(0, 1)), "list of indices"),
    ],
)
def test_what_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_views_of_other_sizes_need_cameras_that_say_theirs():
    camera = PinholeCamera(300.0, 300.0, 159.5, 119.5)
    r = CameraRig([camera, camera], [np.eye(4), beside(0.1)])
    with pytest.raises(InputError, match=r"sizes \(120, 160\), \(240, 320\).*size=\(H, W\)"):
        r.detect([Frame(mask=np.zeros((240, 320), bool)), np.zeros((120, 160), bool)])


def test_nothing_to_see_is_no_object():
    assert len(rig().detect([np.zeros((240, 320), bool)] * 2)) == 0
