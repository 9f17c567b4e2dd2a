"""Folders of images with their label images, and of images of several sizes."""

from __future__ import annotations

import logging
from pathlib import Path

import cv2
import numpy as np
import pytest

from dloftbs import sources

COLOUR = np.zeros((12, 16, 3), np.uint8)
COLOUR[4:6, 2:14] = (10, 200, 30)


@pytest.fixture(autouse=True)
def log(caplog):
    caplog.set_level(logging.WARNING, "dloftbs.sources")
    return caplog


def save(folder: Path, *names: str, pixels: np.ndarray = COLOUR) -> None:
    folder.mkdir(exist_ok=True)
    for name in names:
        assert cv2.imwrite(str(folder / name), pixels)


def test_pictures_that_a_command_drew_beside_their_frames_are_none(tmp_path, log):
    save(tmp_path, "0.png", "1.png", "0.overlay.png", "1.overlay.png", "1.stages.png", "7.overlay.png", "a.overlay.jpg")
    for where in (tmp_path, tmp_path / "*.png"):
        log.clear()
        with sources.open(where) as source:
            names = [frame.name for frame in source]
        assert [name for name in names if not name.endswith("jpg")] == ["0.png", "1.png", "7.overlay.png"]
        (record,) = log.records
        assert record.getMessage() == (
            f"{where}: left out 3 pictures that --overlay or --stages drew, such as 0.overlay.png; "
            "name it alone to read it"
        )


@pytest.mark.parametrize(
    ("image", "label", "rule"),
    [
        ("photo.jpg", "photo.png", "{stem}.png"),
        ("photo.jpg", "photo_mask.png", "{stem}_mask.png"),
        ("photo.png", "photo_label.png", "{stem}_label.png"),
        ("photo.png", "photo.labels.png", "{stem}.labels.png"),
        ("photo.JPEG", "photo-Mask.tif", "{stem}-Mask.tif"),
    ],
)
@pytest.mark.parametrize("pattern", ["", "*"])
def test_an_image_beside_its_mask_is_told_with_the_remedy(tmp_path, log, image, label, rule, pattern):
    save(tmp_path, image, label, image.replace("photo", "second"), label.replace("photo", "second"), "alone.png")
    where = str(tmp_path / pattern) if pattern else tmp_path
    with sources.open(where) as source:
        assert source.length == 5
        list(source)
        list(source)
    (message,) = log.messages
    assert f"{image} and {label} look like an image and its mask, and 1 more such pairs" in message
    assert f'masks="{rule}" (--masks "{rule}")' in message
    log.clear()
    with sources.open(where, masks=rule) as source:  # the remedy is one
        frames = [frame for frame in source if frame.name != "alone.png"]
    assert [frame.name for frame in frames] == [image, image.replace("photo", "second")]
    assert all(frame.mask is not None for frame in frames)
    assert "look like" not in log.text


@pytest.mark.parametrize("more", [(), ("a_mask_all.png",)])
def test_masks_of_single_objects_are_told_with_the_rule_of_instances(tmp_path, log, more):
    save(tmp_path, "a.jpg", "a_mask_0.png", "a_mask_1.png", *more, pixels=COLOUR[:, :, 1])
    with sources.open(tmp_path) as source:
        list(source)
    (message,) = log.messages
    assert f"look like an image and its mask, and {1 + len(more)} more such pairs" in message
    rule = "{stem}_mask_*.png"
    assert f'give instances="{rule}" (--instances "{rule}")' in message
    log.clear()
    with sources.open(tmp_path, instances=rule, kind="image") as source:  # the remedy is one
        (frame,) = source
    assert (frame.name, int(frame.instances.max())) == ("a.jpg", 2)
    assert log.messages == []


@pytest.mark.parametrize("ending", ["_mask_", "_mask", ".seg-", "_obj", "_object_", "-instance_"])
def test_masks_of_single_objects_without_pictures_are_told_once(tmp_path, log, ending):
    names = [f"frame_{t}{ending}{k}.png" for t in range(3) for k in range(2)]
    save(tmp_path, *names, pixels=COLOUR[:, :, 1])
    with sources.open(tmp_path) as source:
        assert len(list(source)) == 6
    (message,) = log.messages
    rule = f"{{stem}}{ending}*.png"
    assert f"{names[0]} and {names[1]} look like masks of two objects in one frame" in message
    assert f'give instances="{rule}" (--instances "{rule}")' in message
    log.clear()
    with sources.open(tmp_path, instances=rule) as source:
        assert len(list(source)) == 3
    assert log.messages == []


@pytest.mark.parametrize(
    "names",
    [
        ["cam_mask_0.png", "cam_mask_1.png", "cam_mask_2.png"],
        ["a_mask_0.png", "b_mask_0.png"],
        ["a_obj.png", "a.png"],
        ["a_1.png", "a_2.png", "b_1.png", "b_2.png"],
    ],
)
def test_a_stream_of_masks_is_no_frame_of_many_objects(tmp_path, log, names):
    save(tmp_path, *names, pixels=COLOUR[:, :, 1])
    with sources.open(tmp_path) as source:
        assert len(list(source)) == len(names)
    assert log.messages == []


def test_other_names_are_nobodys_masks(tmp_path, log):
    save(tmp_path, "a.png", "b.png", "mask.png", "a_2.png", "c_mask.png", "d.jpg", "d.jpeg")
    save(tmp_path / "sub", "d.png")
    with sources.open(f"{tmp_path}/**/*") as source:
        assert source.length == 8
    assert log.messages == []


def test_the_first_frame_of_another_size_is_told_once(tmp_path, log):
    save(tmp_path, "0.png", "1.png")
    save(tmp_path, "2.png", "4.png", pixels=np.ascontiguousarray(COLOUR[:10]))
    save(tmp_path, "3.png", "5.png", pixels=np.ascontiguousarray(COLOUR[:, :9]))
    with sources.open(tmp_path, jobs=2) as source:
        assert len(list(source)) == 6
    (message,) = log.messages
    assert "2.png has 16 x 10 pixels, 0.png before it 16 x 12; tracks begin anew with each change of size" in message


def test_frames_of_one_size_are_silent(tmp_path, log):
    save(tmp_path, "0.png", "1.png")
    with sources.open(tmp_path) as source:
        list(source)
    assert log.messages == []
