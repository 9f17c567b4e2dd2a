"""Cameras and registrations from files, as the calibrators of the field write them."""

from __future__ import annotations

import json
import re
import tempfile
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.camera import DepthRegistration, PinholeCamera
from dloftbs.errors import SourceError

D5 = (-0.41527, 0.31874, -0.00197, 0.00071, -0.08)
D8 = (0.55, -2.61, 0.0006, -0.0002, 1.51, 0.43, -2.43, 1.43)
D4 = (-0.0117, 0.0432, -0.0411, 0.0121)
WEBCAM = PinholeCamera(612.4, 613.9, 321.7, 243.2, D5, size=(480, 640))

ROS_CALIBRATION = """\
image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [612.4, 0.     , 321.7,
           0.     , 613.9, 243.2,
           0.     ,   0.     ,   1.     ]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.41527, 0.31874, -0.00197, 0.00071, -0.08]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]
projection_matrix:
  rows: 3
  cols: 4
  data: [590.1, 0., 322.9, 0., 0., 600.2, 242.1, 0., 0., 0., 1., 0.]
"""

ROS1_MESSAGE = """\
header:
  seq: 12
  stamp: {secs: 1618, nsecs: 3}
  frame_id: "camera_color_optical_frame"
height: 480
width: 640
distortion_model: "plumb_bob"
D: [-0.41527, 0.31874, -0.00197, 0.00071, -0.08]
K: [612.4, 0.0, 321.7, 0.0, 613.9, 243.2, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [612.4, 0.0, 321.7, 0.0, 0.0, 613.9, 243.2, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi: {x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: False}
---
"""

ROS2_MESSAGE = """\
header:
  stamp:
    sec: 1700000000
    nanosec: 5
  frame_id: color
height: 720
width: 1280
distortion_model: rational_polynomial
d:
- 0.55
- -2.61
- 0.0006
- -0.0002
- 1.51
- 0.43
- -2.43
- 1.43
k:
- 912.5
- 0.0
- 640.25
- 0.0
- 911.75
- 361.5
- 0.0
- 0.0
- 1.0
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
binning_x: 1
binning_y: 1
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: false
---
"""

OPENCV_YAML = """\
%YAML:1.0
---
calibration_time: "Sat 21 Nov 2026 09:00:00"
nframes: 13
image_width: 640
image_height: 480
board_width: 9
flags: 0
fisheye_model: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 6.1240000000000000e+02, 0., 3.2170000000000000e+02, 0., 6.139e+02,
       2.432e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.41527, 0.31874, -1.97e-03, 7.1e-04, -0.08 ]
avg_reprojection_error: 2.1e-01
"""

OPENCV_XML = """\
<?xml version="1.0"?>
<opencv_storage>
<image_width>640</image_width>
<image_height>480</image_height>
<camera_matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    612.4 0. 321.7 0. 613.9 243.2 0. 0. 1.</data></camera_matrix>
<distortion_coefficients type_id="opencv-matrix">
  <rows>5</rows>
  <cols>1</cols>
  <dt>d</dt>
  <data>
    -0.41527 0.31874 -0.00197 0.00071 -0.08</data></distortion_coefficients>
</opencv_storage>
"""

KALIBR = """\
cam0:
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: [-0.0117, 0.0432, -0.0411, 0.0121]
  distortion_model: equidistant
  intrinsics: [461.6, 460.3, 363.0, 248.1]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
"""

OPEN3D = json.dumps(
    {"width": 640, "height": 480, "intrinsic_matrix": [612.4, 0, 0, 0, 613.9, 0, 321.7, 243.2, 1]}, indent="\t"
)

REALSENSE = """\
{
  "width": 640, "height": 480, "ppx": 321.7, "ppy": 243.2, "fx": 612.4, "fy": 613.9,
  "model": "distortion.brown_conrady", "coeffs": [-0.41527, 0.31874, -0.00197, 0.00071, -0.08]
}
"""

FORMS = {
    "ros calibration.yaml": (ROS_CALIBRATION, WEBCAM),
    "ros1 message.yaml": (ROS1_MESSAGE, WEBCAM),
    "ros2 message.yaml": (ROS2_MESSAGE, PinholeCamera(912.5, 911.75, 640.25, 361.5, D8, size=(720, 1280))),
    "opencv.yml": (OPENCV_YAML, WEBCAM),
    "opencv.xml": (OPENCV_XML, WEBCAM),
    "kalibr.yaml": (KALIBR, PinholeCamera(461.6, 460.3, 363.0, 248.1, D4, "fisheye", (480, 752))),
    "open3d.json": (OPEN3D, PinholeCamera(612.4, 613.9, 321.7, 243.2, size=(480, 640))),
    "realsense.json": (REALSENSE, WEBCAM),
    "plain.yaml": ("fx: 612.4\nfy: 613.9\ncx: 321.7\ncy: 243.2\n", PinholeCamera(612.4, 613.9, 321.7, 243.2)),
    "plain with more.yaml": (
        "{fx: 612.4, fy: 613.9, cx: 321.7, cy: 243.2, model: plumb_bob, width: 640, height: 480,"
        f"distortion: {list(D5)}}}",
        WEBCAM,
    ),
    "ours.json": (json.dumps(WEBCAM.to_dict()), WEBCAM),
}  # fmt: skip


def write(path, text):
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", FORMS)
def test_every_form_is_read(tmp_path, name):
    text, camera = FORMS[name]
    assert PinholeCamera.from_file(write(tmp_path / name, text)) == camera


def test_keys_may_be_written_otherwise(tmp_path):
    text = REALSENSE.replace("brown_conrady", "Kannala Brandt4").replace("-0.08]", "0.0]")
    camera = PinholeCamera.from_file(write(tmp_path / "a.json", text))
    assert (camera.model, camera.distortion) == ("fisheye", D5[:4])
    text = ROS_CALIBRATION.replace("camera_matrix", "cameraMatrix").replace("distortion_coefficients", "dist_coeffs")
    assert PinholeCamera.from_file(write(tmp_path / "a.yaml", text)) == WEBCAM
    nested = json.dumps({"K": WEBCAM.matrix.tolist(), "D": [list(D5)]})
    assert PinholeCamera.from_file(write(tmp_path / "b.json", nested)).distortion == D5
    exponents = "fx: 6e2\nfy: 6.0e+2\ncx: 1e1\ncy: 0\n"  # to YAML 1.1 the first is text
    assert PinholeCamera.from_file(write(tmp_path / "c.yaml", exponents)) == PinholeCamera(600, 600, 10, 0)


K = "[[612.4, 0, 321.7], [0, 613.9, 243.2], [0, 0, 1]]"
OF_ALL_FORMS = {
    "matrix": f"camera_matrix: {K}",
    "message": f"K: {K}",
    "kalibr": "intrinsics: [612.4, 613.9, 321.7, 243.2]",
    "open3d": f"intrinsic_matrix: {K}",
    "realsense": "fx: 612.4\nfy: 613.9\nppx: 321.7\nppy: 243.2",
    "plain": "fx: 612.4\nfy: 613.9\ncx: 321.7\ncy: 243.2",
}


@pytest.mark.parametrize("form", OF_ALL_FORMS.values(), ids=OF_ALL_FORMS)
class TestLens:
    @pytest.mark.parametrize(
        "key", ["distortion", "dist", "dist_coefs", "dist_coeffs", "distortion_coefficients", "distortion_coeffs", "D"]
    )
    def test_its_coefficients_are_read_in_every_form(self, tmp_path, form, key):
        text = f"{form}\n{key}: {list(D5)}\nimage_size: [640, 480]\n"
        assert PinholeCamera.from_file(write(tmp_path / "a.yaml", text)) == WEBCAM

    @pytest.mark.parametrize(
        "stated", ["distortion_model: equidistant", "model: fisheye", "fisheye_model: 1", "fisheye: true"]
    )
    def test_its_model_is_read_in_every_form(self, tmp_path, form, stated):
        text = f"{form}\ndistortion: {list(D4)}\n{stated}\n"
        camera = PinholeCamera.from_file(write(tmp_path / "a.yaml", text))
        assert (camera.model, camera.distortion) == ("fisheye", D4)

    @pytest.mark.parametrize(
        ("stated", "message"),
        [
            ("distortion_parameters: [0.1, 0, 0, 0]", "keys of a lens that are unknown: distortionparameters; give"),
            ("lens_coefs: [0.1, 0, 0, 0]", "keys of a lens that are unknown: lenscoefs"),
            ("k1: -0.3", "unknown: k1"),
            ("distortion: {k1: -0.3, k2: 0.1}", "distortion must be numbers in a list or under data, got the keys k1"),
            ("model: thin_plate", "unknown distortion model 'thin_plate'"),
            ("distortion: [0.1, 0, 0, 0]\nD: [0, 0, 0, 0]", "distortion and d state different coefficients"),
            ("model: radtan\nlens_model: fisheye", "several models of the lens, fisheye, radtan"),
        ],
    )
    def test_what_is_not_read_of_it_is_refused(self, tmp_path, form, stated, message):
        with pytest.raises(SourceError, match=re.escape(message)):
            PinholeCamera.from_file(write(tmp_path / "a.yaml", f"{form}\n{stated}\n"))


def test_a_camera_model_is_the_lens_where_it_says_more_than_pinhole(tmp_path):
    for model, expected in (("fisheye", "fisheye"), ("PINHOLE", "polynomial")):
        text = f"camera_matrix: {K}\ncamera_model: {model}\ndistortion: {list(D4)}\n"
        assert PinholeCamera.from_file(write(tmp_path / "a.yaml", text)).model == expected


def test_distances_are_no_distortion(tmp_path):
    text = f"{OF_ALL_FORMS['matrix']}\ndistance_m: 1.5\nP1: {K}\n"
    assert PinholeCamera.from_file(write(tmp_path / "a.yaml", text)).distortion == ()


@pytest.mark.parametrize("suffix", [".yml", ".xml", ".json"])
@pytest.mark.parametrize("count", [4, 5, 8, 12, 14])
def test_what_opencv_writes_itself_comes_back(tmp_path, suffix, count):
    distortion = np.random.default_rng(count).normal(0, 0.01, (1, count))
    path = tmp_path / f"camera{suffix}"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("camera_matrix", WEBCAM.matrix)
    storage.write("distortion_coefficients", distortion)
    storage.write("image_width", 640)
    storage.write("image_height", 480)
    storage.release()
    camera = PinholeCamera.from_file(path)
    np.testing.assert_allclose(camera.distortion, distortion[0], rtol=1e-15)
    assert (camera.fx, camera.cy, camera.size) == (612.4, 243.2, (480, 640))


def test_opencvs_fisheye_is_told_by_its_flag(tmp_path):
    text = (
        OPENCV_YAML.replace("fisheye_model: 0", "fisheye_model: 1").replace("rows: 5", "rows: 4").replace(", -0.08", "")
    )
    camera = PinholeCamera.from_file(write(tmp_path / "a.yml", text))
    assert (camera.model, len(camera.distortion)) == ("fisheye", 4)


@pytest.mark.parametrize("model", ["none", "Inverse Brown Conrady", "distortion.modified_brown_conrady", ""])
def test_without_coefficients_every_model_is_the_same(tmp_path, model):
    zeros = REALSENSE.replace("distortion.brown_conrady", model).replace(str(list(D5)), "[0.0, 0.0, 0.0, 0.0, 0.0]")
    assert PinholeCamera.from_file(write(tmp_path / "a.json", zeros)).distortion == ()
    if model:
        given = REALSENSE.replace("distortion.brown_conrady", model)
        with pytest.raises(SourceError, match=r"distortion model '.*' is not supported with coefficients other than 0"):
            PinholeCamera.from_file(write(tmp_path / "a.json", given))


def test_a_region_of_the_whole_image_is_none(tmp_path):
    whole = re.sub(
        r"(x_offset: 0.*?)height: 0(.*?)width: 0", r"\1height: 480\2width: 640", ROS1_MESSAGE, flags=re.DOTALL
    )
    assert whole != ROS1_MESSAGE
    assert PinholeCamera.from_file(write(tmp_path / "a.yaml", whole)) == PinholeCamera.from_file(
        write(tmp_path / "b.yaml", ROS1_MESSAGE)
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must hold one mapping of keys to values, found 0 documents"),
        ("fx", "must hold one mapping of keys to values, found str"),
        ("[1, 2]", "found list"),
        ("a: [1", "is no YAML"),
        ("a: !!python/object:os.system {}", "the tag tag:yaml.org,2002:python/object:os.system is not supported"),
        ("width: 3\nfocal: 4", "is no camera: expected ROS's camera_info"),
        ("width: 3\nfocal: 4", "found width, focal"),
        ("fx: 1\nfy: 1\ncx: 2", "a camera needs fx, fy, cx and cy; missing: cy"),
        ("fx: 1\nfy: 1\ncx: 2\ncy: a", "cy must be numbers"),
        ("fx: 1\nfy: 1\ncx: 2\ncy: 3\nk1: 0.1", "unknown: k1"),
        ("fx: 0\nfy: 1\ncx: 2\ncy: 3", "focal lengths must be positive"),
        (ROS_CALIBRATION.replace("612.4, 0. ", "612.4, 0.7 "), "skew is not supported"),
        (ROS_CALIBRATION.replace("plumb_bob", "thin_plate"), "unknown distortion model 'thin_plate'; known are"),
        (ROS_CALIBRATION.replace(", -0.08]", "]").replace("-0.00197,", ""), "it is 1 x 5, but holds 3 numbers"),
        (ROS_CALIBRATION.replace("image_width: 640", "image_width: -3"), "width and height must be positive integers"),
        (ROS1_MESSAGE.replace("binning_x: 0", "binning_x: 2"), "binning and regions of interest are not supported"),
        (ROS1_MESSAGE.replace("x_offset: 0", "x_offset: 8"), "region [8, 0, 0, 0]"),
        (ROS1_MESSAGE.replace("K: [612.4", "K: [0, 612.4"), "the camera matrix must be 9 numbers, got 10"),
        (KALIBR.replace("pinhole", "omni"), "camera_model must be pinhole, got 'omni'"),
        (KALIBR.replace("[461.6, ", "["), "intrinsics must be 4 numbers, got 3"),
        (KALIBR + KALIBR.replace("cam0:", "cam1:"), "holds 2 cameras, cam0, cam1; keep the one that is meant"),
        (OPENCV_YAML[:400], "is no YAML"),
        ("<camera/>", "its root must be opencv_storage"),
        ("%YAML:1.0\n---\nnothing: 3\n", "is no camera"),
    ],
)
def test_what_is_wrong_is_said_with_the_file(tmp_path, text, message):
    path = write(tmp_path / "cam era.yaml", text)
    with pytest.raises(SourceError, match=re.escape(str(path)) + ".*" + re.escape(message)):
        PinholeCamera.from_file(path)


anything = st.recursive(
    st.none() | st.booleans() | st.integers(-2, 2**70) | st.floats() | st.text(max_size=3),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(["data", "rows", "a"]), inner, max_size=3)
    ),
    max_leaves=6,
)


@given(form=st.sampled_from([ROS_CALIBRATION, ROS2_MESSAGE, KALIBR, OPEN3D, REALSENSE]), data=st.data())
def test_whatever_stands_in_a_file_it_is_a_camera_or_an_error_that_names_it(form, data):
    values = next(yaml.safe_load_all(form.replace("\t", " ")))
    inner = values.get("cam0", values)
    inner[data.draw(st.sampled_from(sorted(inner)))] = data.draw(anything)
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder) / "camera.yaml", yaml.safe_dump(values))
        try:
            said = repr(PinholeCamera.from_file(path))
        except SourceError as error:
            said = str(error)
    assert said.startswith(("PinholeCamera(", f"{path}: "))


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    for path in (tmp_path, tmp_path / "none.yaml"):
        with pytest.raises(SourceError, match=re.escape(f"{path}: cannot be read")):
            PinholeCamera.from_file(path)
    (tmp_path / "a.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SourceError, match=r"a\.yaml: cannot be read"):
        PinholeCamera.from_file(tmp_path / "a.yaml")


TURN = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
INDENTED = ROS_CALIBRATION.replace("\n", "\n  ")
REGISTRATION = f"""\
depth_camera: {{fx: 424.0, fy: 424.0, cx: 423.5, cy: 239.5, width: 848, height: 480}}
colour_camera:
  {INDENTED}
rotation: {TURN.tolist()}
translation_m: [0.015, -0.001, 0.0]
"""


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text,
        lambda text: text.replace("colour", "color"),
        lambda text: text.replace(str(TURN.tolist()), str(TURN.ravel().tolist())),
    ],
)
def test_a_registration_is_read(tmp_path, change):
    registration = DepthRegistration.from_file(write(tmp_path / "r.yaml", change(REGISTRATION)))
    depth_camera = PinholeCamera(424, 424, 423.5, 239.5, size=(480, 848))
    assert registration == DepthRegistration(depth_camera, WEBCAM, TURN, (0.015, -0.001, 0.0))


def test_kalibrs_chain_is_a_registration(tmp_path):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = TURN, (0.05, 0.0, -0.01)
    chain = f"{KALIBR}{KALIBR.replace('cam0:', 'cam1:')}  T_cn_cnm1: {pose.tolist()}\n"
    camera = FORMS["kalibr.yaml"][1]
    registration = DepthRegistration.from_file(write(tmp_path / "chain.yaml", chain))
    assert registration == DepthRegistration(camera, camera, TURN, (0.05, 0.0, -0.01))
    for text, message in (
        (chain.replace("T_cn_cnm1", "T_cam_imu"), "lacks T_cn_cnm1"),
        (chain.replace("[0.0, 0.0, 0.0, 1.0]]", "]"), "T_cn_cnm1 must be 16 numbers, got 12"),
        (chain + KALIBR.replace("cam0:", "cam2:"), "two cameras, cam0 for depth and cam1 for colour"),
    ):
        with pytest.raises(SourceError, match=r"chain\.yaml: .*" + re.escape(message)):
            DepthRegistration.from_file(write(tmp_path / "chain.yaml", text))


def test_the_unit_of_depth_of_a_registration_is_read(tmp_path):
    for text in (REGISTRATION, f"{KALIBR}{KALIBR.replace('cam0:', 'cam1:')}  T_cn_cnm1: {np.eye(4).tolist()}\n"):
        path = write(tmp_path / "r.yaml", f"{text}depth_unit_m: 0.0001\n")
        assert DepthRegistration.from_file(path).depth_unit_m == 0.0001
        assert DepthRegistration.from_file(path, depth_unit_m=0.00025).depth_unit_m == 0.00025
        assert DepthRegistration.from_file(write(path, text)).depth_unit_m == 0.001
        for more, message in (
            ("depth_unit: 0.0001", r"r\.yaml: a registration has .*depth_unit_m; unknown: depthunit$"),
            ("depth_unit_m: 0", r"r\.yaml: depth_unit_m must be a finite number"),
            ("depth_unit_m: mm", r"r\.yaml: depth_unit_m must be numbers"),
        ):
            with pytest.raises(SourceError, match=message):
                DepthRegistration.from_file(write(path, f"{text}{more}\n"))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("depth_camera", "camera", "a registration needs depth_camera, a camera"),
        ("colour_camera", "left_camera", "a registration needs colour_camera"),
        ("cx: 423.5, ", "", "depth_camera: a camera needs fx, fy, cx and cy; missing: cx"),
        ("translation_m", "translation", "lacks translation_m; found depthcamera"),
        ("0.015, ", "", "translation_m must be 3 numbers, got 2"),
        ("0.8, -0.6", "0.8, -0.5", "rotation must be a rotation"),
    ],
)
def test_a_wrong_registration_is_said_with_the_file(tmp_path, old, new, message):
    with pytest.raises(SourceError, match=r"r\.yaml: .*" + re.escape(message)):
        DepthRegistration.from_file(write(tmp_path / "r.yaml", REGISTRATION.replace(old, new)))


def test_the_file_in_the_documentation_is_one():
    text = (Path(__file__).parents[2] / "docs" / "files.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```yaml\n(depth_camera.*?)```", text, re.DOTALL)
    with tempfile.TemporaryDirectory() as folder:
        registration = DepthRegistration.from_file(write(Path(folder) / "r.yaml", block))
    assert registration.colour_camera.size == (720, 1280)
