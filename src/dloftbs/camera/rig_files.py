"""Rigs of cameras from files, as calibrators write them: our own, Kalibr's, OpenCV's and ROS's.

Each is turned into the keys of `PinholeCamera`'s files and a pose from the camera to the rig. The rig's frame is that
of the first camera, unless the file says otherwise.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dloftbs.camera.calibration_files import (
    FISHEYE_KEYS,
    MODEL_KEYS,
    content_of,
    first_of,
    matrix_of,
    normal_keys,
    numbers_of,
)
from dloftbs.camera.pinhole import PinholeCamera
from dloftbs.camera.poses import POSE_FORMS, POSE_KEYS, as_pose, inverse_of, pose_of
from dloftbs.errors import InputError, source_errors
from dloftbs.support.arrays import FloatArray

Keys = dict[str, Any]
_POSE_KEYS: dict[Any, str] = {key.replace("_", ""): key for key in POSE_KEYS}  # as `normal_keys` leaves them
CamerasAndPoses = tuple[list[PinholeCamera], list[FloatArray]]

_FORMS = (
    "our own (cameras, each with fx, fy, cx, cy and pose), Kalibr's camchain (cam0, cam1 with T_cn_cnm1), OpenCV's "
    "stereoCalibrate (M1, D1, M2, D2, R, T, in one file or two), or two of ROS's camera_info, left and right"
)


def read_rig(paths: Sequence[Path], *, rectified: bool) -> tuple[CamerasAndPoses, Keys]:
    """Return the cameras and poses that files describe together, and the other keys of a file of our own.

    Raises
    ------
    SourceError
        If a file cannot be read, or they are no rig.
    """
    named = " and ".join(str(path) for path in paths)
    with source_errors(named, InputError):
        contents = [normal_keys(content_of(path)) for path in paths]
        return rig_of(contents, rectified=rectified)


def rig_of(contents: Sequence[Keys], *, rectified: bool = False) -> tuple[CamerasAndPoses, Keys]:
    """Return what `read_rig` does, from what the files hold.

    Raises
    ------
    InputError
        If they are of no form that is known, or describe cameras that are not supported.
    """
    if len(contents) == 2 and all("projectionmatrix" in keys or "p" in keys for keys in contents):
        return _from_camera_infos(contents[0], contents[1], rectified), {}
    keys: Keys = {key: value for content in contents for key, value in content.items()}
    if isinstance(keys.get("cameras"), list):
        own = _from_own(keys["cameras"])
        return own, {key: value for key, value in keys.items() if key != "cameras"}
    if {"cam0", "cam1"} <= keys.keys():
        return _from_kalibr(keys), {}
    stereo = _from_opencv(keys)
    if stereo is None:
        raise InputError(f"is no rig: expected {_FORMS}; found {', '.join(keys) or 'nothing'}")
    return stereo, {}


def _from_own(cameras: list[Any]) -> CamerasAndPoses:
    made, poses = [], []
    for number, keys in enumerate(cameras):
        if not isinstance(keys, Mapping):
            raise InputError(f"camera {number} must be a mapping of keys to values, got {type(keys).__name__}")
        own = normal_keys(keys)
        placed = own.pop("pose", None)
        made.append(PinholeCamera.from_calibration(own))
        poses.append(_placed(number, placed))
    return made, poses


def _placed(number: int, given: Any) -> FloatArray:
    """Return the pose that a camera of our own file has; the first one needs none."""
    name = f"the pose of camera {number}"
    if given is None and number == 0:
        return np.eye(4)
    if given is None:
        raise InputError(f"camera {number} needs its pose in the rig, metres: {POSE_FORMS}; found none")
    if isinstance(given, Mapping):
        return as_pose(name, {str(_POSE_KEYS.get(key, key)): value for key, value in given.items()})
    return as_pose(name, np.array(numbers_of("pose", given, 16)).reshape(4, 4))


def _from_kalibr(keys: Keys) -> CamerasAndPoses:
    names = sorted((key for key in keys if re.fullmatch("cam[0-9]+", key)), key=lambda key: int(key[3:]))
    cameras, poses = [], [np.eye(4)]
    for name in names:
        if not isinstance(keys[name], dict):
            raise InputError(f"{name} must be a camera, got {type(keys[name]).__name__}")
        cameras.append(PinholeCamera.from_calibration(keys[name]))
    for name in names[1:]:
        if "tcncnm1" not in keys[name]:
            raise InputError(f"{name} lacks T_cn_cnm1, which takes points of the camera before to this one")
        step = np.array(numbers_of("T_cn_cnm1", keys[name]["tcncnm1"], 16)).reshape(4, 4)
        poses.append(poses[-1] @ inverse_of(step))
    return cameras, poses


def _from_opencv(keys: Keys) -> CamerasAndPoses | None:
    """Read what stereoCalibrate returns under the names of OpenCV's samples and users; None where there is none."""
    cameras = []
    shared = {key: keys[key] for key in (*MODEL_KEYS, *FISHEYE_KEYS) if key in keys}
    shared["imagesize"] = first_of(keys, "imagesize", "size")
    for number in ("1", "2"):
        matrix = first_of(keys, f"m{number}", f"k{number}", f"cameramatrix{number}")
        if matrix is None:
            return None
        own = {key.removesuffix(number): value for key, value in keys.items() if key.endswith(number)}
        cameras.append(PinholeCamera.from_calibration({**shared, **own, "cameramatrix": matrix}))
    rotation, translation = first_of(keys, "r", "rotation"), first_of(keys, "t", "translation")
    if rotation is None or translation is None:
        raise InputError(
            "has two cameras, but neither R nor T between them: OpenCV's sample writes them to extrinsics.yml; "
            "name both files"
        )
    step = pose_of(matrix_of(rotation, "R"), numbers_of("T", translation, 3))
    return cameras, [np.eye(4), inverse_of(step)]


def _from_camera_infos(left: Keys, right: Keys, rectified: bool) -> CamerasAndPoses:
    """Read two of ROS's CameraInfo; P of the second has the baseline, in the frame of the rectified images."""
    cameras, poses = [], []
    for name, keys in (("left", left), ("right", right)):
        p = np.array(numbers_of("P", first_of(keys, "projectionmatrix", "p"), 12)).reshape(3, 4)
        if not (p[0, 0] > 0.0 and p[1, 1] > 0.0):
            raise InputError(f"P of the {name} camera has no focal length: {p.tolist()}")
        turn = first_of(keys, "rectificationmatrix", "r")
        # R takes a camera's points to the rectified frame, which both share but for the baseline.
        rotation = np.eye(3) if rectified or turn is None else matrix_of(turn, "R")
        # P = K [1 | t], so that a point of the first camera is at X + t in this one's, which stands at -t.
        place = np.array([-p[0, 3] / p[0, 0], -p[1, 3] / p[1, 1], 0.0])
        if rectified:
            size = PinholeCamera.from_calibration(keys).size
            cameras.append(PinholeCamera.from_matrix(p[:, :3], size=size))
        else:
            cameras.append(PinholeCamera.from_calibration(keys))
        poses.append(pose_of(rotation, place))
    if not np.any(poses[1][:3, 3] != poses[0][:3, 3]):
        raise InputError(
            "P of both cameras has no baseline (P[0, 3] is 0): take camera_info of a stereo calibration, or state the "
            "poses in a file of our own"
        )
    return cameras, poses
