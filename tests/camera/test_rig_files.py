"""Rigs in files of others and our own: each describes the same two cameras."""

from __future__ import annotations

import json
import math

import cv2
import numpy as np
import pytest
import yaml

from dloftbs import CameraRig, PinholeCamera, SourceError

LEFT = PinholeCamera(900.0, 901.0, 640.0, 360.0, distortion=(0.1, -0.05, 0.001, 0.0, 0.01), size=(720, 1280))
RIGHT = PinholeCamera(905.0, 906.0, 630.0, 355.0, distortion=(0.08, 0.0, 0.0, 0.001, 0.0), size=(720, 1280))
POSE = np.eye(4)
POSE[:3, :3] = cv2.Rodrigues(np.array([0.01, -0.05, 0.02]))[0]
POSE[:3, 3] = (0.06, 0.001, -0.002)
STEP = np.linalg.inv(POSE)


def check(rig: CameraRig) -> None:
    assert [camera.matrix.tolist() for camera in rig.cameras] == [LEFT.matrix.tolist(), RIGHT.matrix.tolist()]
    assert [camera.distortion for camera in rig.cameras] == [LEFT.distortion, RIGHT.distortion]
    assert np.allclose(rig.poses[0], np.eye(4))
    assert np.allclose(rig.poses[1], POSE, atol=1e-9)


def test_our_own(tmp_path):
    path = tmp_path / "rig.yaml"
    rig = CameraRig(
        [LEFT, RIGHT], [np.eye(4), POSE], rotation_std_deg=0.1, pixel_std=0.2, time_std_s=0.004, triggered=True
    )
    path.write_text(yaml.safe_dump(rig.to_dict()))
    again = CameraRig.from_file(path)
    check(again)
    assert again.cameras == (LEFT, RIGHT)
    assert (again.rotation_std_deg, again.pixel_std, again.time_std_s, again.triggered) == (0.1, 0.2, 0.004, True)
    told = CameraRig.from_file(path, pixel_std=0.5, triggered=False)
    assert (told.pixel_std, told.time_std_s, told.triggered) == (0.5, 0.004, False)
    (tmp_path / "rig.json").write_text(json.dumps(rig.to_dict()))
    check(CameraRig.from_file(tmp_path / "rig.json"))


def test_a_pose_as_urdf_and_tf_give_it(tmp_path):
    angle = 0.3
    turn = cv2.Rodrigues(np.array([0.0, angle, 0.0]))[0]
    for extra in (
        {"rpy": [0.0, angle, 0.0]},
        {"quaternion_xyzw": [0.0, math.sin(angle / 2), 0.0, math.cos(angle / 2)]},
    ):
        cameras = [LEFT.to_dict(), {**RIGHT.to_dict(), "pose": {"translation_m": [0.1, 0.0, 0.0], **extra}}]
        path = tmp_path / "rig.yaml"
        path.write_text(yaml.safe_dump({"cameras": cameras}))
        pose = CameraRig.from_file(path).poses[1]
        assert np.allclose(pose[:3, :3], turn, atol=1e-9)
        assert np.allclose(pose[:3, 3], (0.1, 0.0, 0.0))


def kalibr(camera: PinholeCamera) -> dict[str, object]:
    return {
        "camera_model": "pinhole",
        "intrinsics": [camera.fx, camera.fy, camera.cx, camera.cy],
        "distortion_model": "radtan",
        "distortion_coeffs": list(camera.distortion),
        "resolution": [1280, 720],
    }


def test_kalibr(tmp_path):
    path = tmp_path / "camchain.yaml"
    third = {**kalibr(RIGHT), "T_cn_cnm1": np.linalg.inv(POSE).tolist()}
    chain = {"cam0": kalibr(LEFT), "cam1": {**kalibr(RIGHT), "T_cn_cnm1": STEP.tolist()}}
    path.write_text(yaml.safe_dump(chain))
    check(CameraRig.from_file(path))
    path.write_text(yaml.safe_dump({**chain, "cam2": third}))
    assert np.allclose(CameraRig.from_file(path).poses[2], POSE @ POSE, atol=1e-9)


@pytest.mark.parametrize("suffix", ["yml", "xml"])
def test_opencv(tmp_path, suffix):
    """As samples/cpp/stereo_calib.cpp writes them."""
    inner, outer = tmp_path / f"intrinsics.{suffix}", tmp_path / f"extrinsics.{suffix}"
    storage = cv2.FileStorage(str(inner), cv2.FILE_STORAGE_WRITE)
    for number, camera in ((1, LEFT), (2, RIGHT)):
        storage.write(f"M{number}", camera.matrix)
        storage.write(f"D{number}", np.array([camera.distortion]))
    storage.release()
    storage = cv2.FileStorage(str(outer), cv2.FILE_STORAGE_WRITE)
    storage.write("R", STEP[:3, :3].copy())
    storage.write("T", STEP[:3, 3:].copy())
    storage.write("P1", np.ones((3, 4)))
    storage.write("P2", np.ones((3, 4)))
    storage.release()
    check(CameraRig.from_file(inner, outer))
    with pytest.raises(SourceError, match=r"neither R nor T.*extrinsics\.yml"):
        CameraRig.from_file(inner)


@pytest.mark.parametrize("key", ["D{}", "dist_coeffs{}", "distortion_{}", "distortion_coefficients_{}", "dist_coefs{}"])
def test_the_lenses_of_opencv_under_other_names(tmp_path, key):
    lenses = {key.format(number): list(camera.distortion) for number, camera in ((1, LEFT), (2, RIGHT))}
    keys = {"K1": LEFT.matrix.tolist(), "K2": RIGHT.matrix.tolist(), **lenses, "image_size": [1280, 720]}
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump({**keys, "R": STEP[:3, :3].tolist(), "T": STEP[:3, 3].tolist()}))
    rig = CameraRig.from_file(path)
    check(rig)
    assert rig.cameras[1].size == (720, 1280)
    path.write_text(path.read_text().replace(key.format(2), "distortion_parameters2"))
    with pytest.raises(SourceError, match="keys of a lens that are unknown: distortionparameters"):
        CameraRig.from_file(path)


def info(camera: PinholeCamera, rotation: np.ndarray, baseline_m: float) -> dict[str, object]:
    p = np.array([[800.0, 0.0, 600.0, -800.0 * baseline_m], [0.0, 800.0, 350.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
    return {
        "image_width": 1280,
        "image_height": 720,
        "camera_matrix": {"rows": 3, "cols": 3, "data": camera.matrix.ravel().tolist()},
        "distortion_model": "plumb_bob",
        "distortion_coefficients": {"rows": 1, "cols": 5, "data": list(camera.distortion)},
        "rectification_matrix": {"rows": 3, "cols": 3, "data": rotation.ravel().tolist()},
        "projection_matrix": {"rows": 3, "cols": 4, "data": p.ravel().tolist()},
    }


def test_two_camera_infos(tmp_path):
    r = cv2.stereoRectify(
        LEFT.matrix, np.zeros(5), RIGHT.matrix, np.zeros(5), (1280, 720), STEP[:3, :3].copy(), STEP[:3, 3:].copy()
    )
    baseline = float(np.linalg.norm(STEP[:3, 3]))
    left, right = tmp_path / "left.yaml", tmp_path / "right.yaml"
    left.write_text(yaml.safe_dump(info(LEFT, r[0], 0.0)))
    right.write_text(yaml.safe_dump(info(RIGHT, r[1], baseline)))
    raw = CameraRig.from_file(left, right)
    relative = np.linalg.inv(raw.poses[0]) @ raw.poses[1]
    assert np.allclose(relative, POSE, atol=1e-6)
    assert raw.cameras[0].distortion == LEFT.distortion
    flat = CameraRig.from_file(left, right, rectified=True)
    assert flat.cameras[1].fx == 800.0
    assert flat.cameras[1].distortion == ()
    assert np.allclose(flat.poses[1][:3, 3], (baseline, 0.0, 0.0))
    assert np.allclose(flat.poses[1][:3, :3], np.eye(3))
    right.write_text(yaml.safe_dump(info(RIGHT, r[1], 0.0)))
    with pytest.raises(SourceError, match="no baseline"):
        CameraRig.from_file(left, right, rectified=True)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"fx": 1.0}, "is no rig: expected"),
        ({"cameras": [1, 2]}, "camera 0 must be a mapping"),
        ({"cameras": [LEFT.to_dict(), RIGHT.to_dict()]}, "camera 1 needs its pose"),
        ({"cameras": [LEFT.to_dict(), {**RIGHT.to_dict(), "pose": {"quaternion_xyzw": [1, 1, 0, 0]}}]}, "the length 1"),
        ({"cam0": kalibr(LEFT), "cam1": kalibr(RIGHT)}, "cam1 lacks T_cn_cnm1"),
        ({"cam0": kalibr(LEFT), "cam1": 5}, "cam1 must be a camera"),
    ],
)
def test_what_is_no_rig(tmp_path, content, message):
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(SourceError, match=message):
        CameraRig.from_file(path)
