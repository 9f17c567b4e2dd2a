"""Cameras from CameraInfo, of both ROS."""

from __future__ import annotations

import numpy as np
import pytest
from ros import bag_examples as bags

from dloftbs import PinholeCamera
from dloftbs.errors import InputError
from dloftbs.ros import camera_of

PLUMB = (0.1, -0.2, 0.001, 0.002, 0.05)


@pytest.mark.parametrize("make", [bags.MAKE1, bags.MAKE2])
@pytest.mark.parametrize(
    ("model", "d", "expected"),
    [
        ("plumb_bob", PLUMB, "polynomial"),
        ("rational_polynomial", (*PLUMB, 0.1, 0.2, 0.3), "polynomial"),
        ("equidistant", PLUMB[:4], "fisheye"),
        ("fisheye", PLUMB[:4], "fisheye"),
        ("plumb_bob", (), "polynomial"),
        ("", (), "polynomial"),
    ],
)
def test_every_distortion_model(make, model, d, expected):
    camera = camera_of(bags.camera_info(make=make, d=d, model=model))
    assert camera == PinholeCamera(150.0, 150.0, 80.0, 60.0, d, expected, bags.SIZE)


def test_rectified_images_have_the_matrix_p_and_no_distortion():
    p = [140.0, 0.0, 81.0, -7.0, 0.0, 141.0, 61.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    camera = camera_of(bags.camera_info(d=PLUMB, p=p), rectified=True)
    assert camera == PinholeCamera(140.0, 141.0, 81.0, 61.0, size=bags.SIZE)


def test_zeros_are_no_calibration():
    assert camera_of(bags.camera_info(k=[0.0] * 9)) is None


def test_a_region_of_the_whole_image_is_none():
    roi = bags.MAKE2("sensor_msgs/msg/RegionOfInterest", width=bags.SIZE[1], height=bags.SIZE[0])
    assert camera_of(bags.camera_info(roi=roi)) is not None
    roi = bags.MAKE2("sensor_msgs/msg/RegionOfInterest", width=50, height=bags.SIZE[0])
    with pytest.raises(InputError, match="regions of interest are not supported"):
        camera_of(bags.camera_info(roi=roi))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"model": "thin_prism", "d": PLUMB}, "unknown distortion model 'thin_prism'"),
        ({"d": PLUMB[:3]}, "distortion coefficients, got 3"),
        ({"k": [np.nan] * 9}, "must be finite"),
        ({"k": [1.0, 0.5, 2.0, 0.0, 1.0, 2.0, 0.0, 0.0, 1.0]}, "skew"),
        ({"binning_x": 2}, "binning"),
    ],
)
def test_what_is_not_supported_is_said(changes, said):
    with pytest.raises(InputError, match=said):
        camera_of(bags.camera_info(**changes))


def test_another_message_is_none():
    with pytest.raises(InputError, match="expected a message with the field k or K"):
        camera_of(bags.raw_image(bags.photo_of(0), "bgr8"))
