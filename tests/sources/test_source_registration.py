"""Cameras from files, and depth of a camera of its own, through `open`."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest

from dloftbs import sources
from dloftbs.camera import DepthRegistration, PinholeCamera
from dloftbs.errors import InputError, SourceError

DEPTH = PinholeCamera(20.0, 20.0, 9.5, 7.5, size=(16, 20))
COLOUR = PinholeCamera(40.0, 40.0, 19.5, 15.5, (-0.1, 0.01, 0.001, 0.0), size=(32, 40))
REGISTRATION = DepthRegistration(DEPTH, COLOUR, np.eye(3), (0.02, 0.0, 0.0))
IMAGES = np.zeros((3, 32, 40, 3), np.uint8)
MASKS = np.zeros((3, 32, 40), np.uint8)
DEPTHS = np.random.default_rng(1).integers(900, 1100, (3, 16, 20), np.uint16)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "registration.json"
    cameras = {"depth_camera": DEPTH.to_dict(), "colour_camera": COLOUR.to_dict()}
    path.write_text(json.dumps({**cameras, "rotation": np.eye(3).tolist(), "translation_m": [0.02, 0.0, 0.0]}))
    return path


def assert_registered(source):
    with source:
        frames = list(source)
    assert len(frames) == 3
    for frame, depth in zip(frames, DEPTHS, strict=True):
        assert frame.camera == COLOUR
        assert frame.depth.dtype == np.uint16
        np.testing.assert_array_equal(frame.depth, REGISTRATION.register(depth))


@pytest.mark.parametrize("frames", [IMAGES, MASKS], ids=["images", "masks"])
def test_depth_beside_frames_is_registered(tmp_path, file, frames):
    np.save(tmp_path / "d.npy", DEPTHS)
    assert_registered(sources.open(frames, depth=tmp_path / "d.npy", registration=REGISTRATION))
    assert_registered(sources.open(frames, depth=tmp_path / "d.npy", registration=file))
    assert_registered(sources.open(frames, depth=tmp_path / "d.npy", registration=str(file), camera=COLOUR))


def test_depth_in_files_is_registered(tmp_path):
    for number in range(3):
        assert cv2.imwrite(str(tmp_path / f"{number}.png"), MASKS[number])
        assert cv2.imwrite(str(tmp_path / f"{number}_d.png"), DEPTHS[number])
    assert_registered(sources.open(tmp_path, depth="{stem}_d.png", registration=REGISTRATION))


@pytest.mark.parametrize("key", ["images", "masks"])
def test_depth_of_an_archive_is_registered(tmp_path, key):
    np.savez(tmp_path / "a.npz", **{key: IMAGES if key == "images" else MASKS}, depth=DEPTHS, camera=[1, 1, 0, 0])
    assert_registered(sources.open(tmp_path / "a.npz", registration=REGISTRATION))
    with pytest.raises(SourceError, match=r"a\.npz: the arrays must agree .* needs a registration"):
        sources.open(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", masks=MASKS, depth=DEPTHS[:2])
    with pytest.raises(SourceError, match="must agree"):
        sources.open(tmp_path / "b.npz", registration=REGISTRATION)


def test_without_a_registration_depth_of_another_size_is_refused_and_the_remedy_named(tmp_path):
    np.save(tmp_path / "d.npy", DEPTHS)
    with sources.open(IMAGES, depth=tmp_path / "d.npy", camera=COLOUR) as source:
        frames = iter(source)
        with pytest.raises(InputError, match=r"array#0: depth must have .* \(32, 40\).* got \(16, 20\).*registration="):
            next(frames)


def test_depth_of_neither_size_is_refused(tmp_path):
    np.save(tmp_path / "d.npy", DEPTHS[:, :8])
    with (
        sources.open(IMAGES, depth=tmp_path / "d.npy", registration=REGISTRATION) as source,
        pytest.raises(
            InputError, match=r"array#0: the camera is for images of size \(16, 20\) .* got one of \(8, 20\)"
        ),
    ):
        list(source)


def test_images_of_another_size_than_the_cameras_are_refused():
    with (
        sources.open(IMAGES[:, :30], camera=COLOUR) as source,
        pytest.raises(InputError, match=r"images of size \(32, 40\) .* got one of \(30, 40\).*cropped"),
    ):
        list(source)


def test_a_registration_without_depth_is_an_error(tmp_path):
    np.savez(tmp_path / "a.npz", images=IMAGES)
    for where in (IMAGES, tmp_path / "a.npz"):
        with pytest.raises(InputError, match="a registration needs depth to be registered; there is none"):
            sources.open(where, registration=REGISTRATION)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"registration": 3}, "registration must be a DepthRegistration or the path of a file, got 3"),
        ({"registration": REGISTRATION, "camera": DEPTH}, "camera and registration name two colour cameras"),
        ({"camera": 3}, "camera must be a PinholeCamera, .* got 3"),
    ],
)
def test_wrong_options(options, message):
    with pytest.raises(InputError, match=message):
        sources.open(IMAGES, **options)


def test_a_live_camera_has_no_depth_to_register():
    with pytest.raises(InputError, match="registration cannot go with a camera or a stream"):
        sources.open(0, registration=REGISTRATION)


def test_the_camera_may_be_a_file(tmp_path):
    (tmp_path / "camera.json").write_text(json.dumps(COLOUR.to_dict()))
    for path in (tmp_path / "camera.json", str(tmp_path / "camera.json")):
        with sources.open(IMAGES, camera=path) as source:
            assert [frame.camera for frame in source] == [COLOUR] * 3
    with pytest.raises(SourceError, match=r"none\.yaml: cannot be read"):
        sources.open(IMAGES, camera=tmp_path / "none.yaml")


@pytest.mark.parametrize(
    "lens", [{}, {"distortion": (0.1, 0.2, 0.0, 0.0)}, {"distortion": (0.1, 0.2, 0.0, 0.0), "model": "fisheye"}]
)
def test_an_archive_may_hold_a_lens(tmp_path, lens):
    camera = PinholeCamera(100.0, 101.0, 4.0, 5.0, **lens)
    arrays = {"distortion": camera.distortion, "distortion_model": camera.model} if lens else {}
    np.savez(tmp_path / "a.npz", masks=MASKS, camera=[100, 101, 4, 5], **arrays)
    with sources.open(tmp_path / "a.npz") as source:
        assert next(iter(source)).camera == camera


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"distortion": [0.1, 0.2]}, "coefficients, got 2"),
        (
            {"distortion": [0.1, 0.2, 0, 0], "distortion_model": "omni"},
            "model must be one of polynomial, fisheye, got 'omni'",
        ),
        ({"distortion": ["a"] * 4}, "distortion must be a finite number"),
    ],
)
def test_a_wrong_lens_in_an_archive_is_named(tmp_path, arrays, message):
    np.savez(tmp_path / "a.npz", masks=MASKS, camera=[100, 101, 4, 5], **arrays)
    with pytest.raises(SourceError, match=r"a\.npz: .*" + message):
        sources.open(tmp_path / "a.npz")


def units(source):
    with source:
        return {frame.depth_unit_m for frame in source}


def test_the_unit_of_depth_comes_with_the_frames(tmp_path):
    np.save(tmp_path / "d.npy", np.repeat(np.repeat(DEPTHS, 2, axis=1), 2, axis=2))
    np.savez(tmp_path / "a.npz", masks=MASKS, depth=np.repeat(np.repeat(DEPTHS, 2, axis=1), 2, axis=2))
    for how in ({"depth": tmp_path / "d.npy", "where": IMAGES}, {"where": tmp_path / "a.npz"}):
        assert units(sources.open(**how)) == {0.001}
        assert units(sources.open(**how, depth_unit_m=1e-4)) == {1e-4}
    with pytest.raises(InputError, match="depth_unit_m must be a finite number"):
        sources.open(IMAGES, depth_unit_m=0.0)


def test_a_registration_has_a_unit_of_its_own_unless_another_is_said(tmp_path):
    np.savez(tmp_path / "a.npz", masks=MASKS, depth=10 * DEPTHS)
    tenths = DepthRegistration(DEPTH, COLOUR, np.eye(3), (0.02, 0.0, 0.0), depth_unit_m=1e-4)
    for how in ({"registration": tenths}, {"registration": REGISTRATION, "depth_unit_m": 1e-4}):
        with sources.open(tmp_path / "a.npz", **how) as source:
            for frame, depth in zip(source, DEPTHS, strict=True):
                assert frame.depth_unit_m == 1e-4
                np.testing.assert_array_equal(frame.depth, tenths.register(10 * depth))
