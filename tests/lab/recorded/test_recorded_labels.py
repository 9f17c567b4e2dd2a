"""Label images beside photographs, and folders that are no labelled sequence."""

from __future__ import annotations

import json
import logging
import pickle
import re

import numpy as np
import pytest
from recorded_examples import SIZE, assert_same_bits, picture, save

from dloftbs.camera import PinholeCamera
from dloftbs.errors import InputError, SourceError
from dloftbs_lab import open_labelled
from dloftbs_lab.recorded import LAYOUTS

LABELS = np.zeros(SIZE, np.uint8)
LABELS[4:6, 3:20] = 7
LABELS[9:12, 8:40] = 2


def fill(folder, *stems, labels=LABELS):
    for number, stem in enumerate(stems):
        save(folder / f"{stem}.png", picture(number))
        save(folder / f"{stem}.labels.png", labels)
    return folder


def test_masks_and_ids_are_those_of_the_labels(tmp_path):
    with open_labelled(fill(tmp_path, "10", "9"), "labels") as sequence:
        frame, truth = sequence.frame(0), sequence.truth(1)
        assert [f.name for f in sequence] == ["9.png", "10.png"]
        assert [f.index for f in sequence] == [0, 1]
    assert_same_bits(frame.image, picture(1))
    np.testing.assert_array_equal(frame.mask, LABELS > 0)
    assert (frame.depth, frame.camera) == (None, None)
    assert (truth.ids, truth.curves, truth.curves_3d) == ((2, 7), (), ())
    for mask, number in zip(truth.visible_masks, truth.ids, strict=True):
        np.testing.assert_array_equal(mask, number == LABELS)


def test_a_mask_beside_the_labels_is_what_methods_get(tmp_path):
    mask = np.eye(*SIZE, dtype=np.uint8) * 255
    save(fill(tmp_path, "0") / "0.mask.png", mask)
    sequence = open_labelled(tmp_path)
    assert_same_bits(sequence.frame(0).mask, mask)
    assert_same_bits(sequence.frame(0).image, picture(0))
    np.testing.assert_array_equal(sequence.truth(0).mask, LABELS > 0)


def test_a_mask_of_another_size_than_the_labels_is_refused(tmp_path):
    save(fill(tmp_path, "0", labels=LABELS[:-1]) / "0.mask.png", LABELS)
    message = "0.png: its mask and its labels must have one size, got (31, 45) and (30, 45)"
    with pytest.raises(SourceError, match=re.escape(message)):
        open_labelled(tmp_path).frame(0)


@pytest.mark.parametrize("layout", ["labels", "polylines"])
@pytest.mark.parametrize("name", ["0.json", "0.csv"])
def test_polylines_beside_labels_are_an_error(tmp_path, layout, name):
    (fill(tmp_path, "0") / name).write_text("[]")
    with pytest.raises(SourceError, match=re.escape(f"0.labels.png and {name} are the truth of one image; keep one")):
        open_labelled(tmp_path, layout)


def test_two_images_of_one_stem_are_an_error(tmp_path):
    save(fill(tmp_path, "0") / "0.JPG", picture())
    message = "images must have different stems, got 0.JPG and 0.png; keep one of them"
    with pytest.raises(SourceError, match=f"{re.escape(message)}.* name that 0.mask.png"):
        open_labelled(tmp_path)


def test_labels_of_16_bits_are_taken(tmp_path):
    fill(tmp_path, "0", labels=LABELS.astype(np.uint16) * 1000)
    assert open_labelled(tmp_path).truth(0).ids == (2000, 7000)


def test_an_image_of_background_shows_nothing(tmp_path):
    fill(tmp_path, "0", labels=LABELS * 0)
    assert open_labelled(tmp_path).truth(0).ids == ()


@pytest.mark.parametrize("suffix", [".png", ".npy"])
def test_depth_and_camera_may_lie_beside(tmp_path, suffix):
    fill(tmp_path, "0", "1")
    depth = np.full(SIZE, 700, np.uint16)
    if suffix == ".png":
        save(tmp_path / "1.depth.png", depth)
    else:
        np.save(tmp_path / "1.depth.npy", depth)
    (tmp_path / "camera.json").write_text(json.dumps({"fx": 500, "fy": 501.5, "cx": 20, "cy": 10}))
    without, frame = open_labelled(tmp_path)
    assert without.depth is None
    assert_same_bits(np.asarray(frame.depth), depth)
    assert frame.camera == PinholeCamera(500, 501.5, 20, 10)


@pytest.mark.parametrize("name", ["camera.json", "camera.yaml", "camera.yml"])
def test_the_camera_may_have_a_lens_and_any_form(tmp_path, name):
    text = """{image_width: 45, image_height: 31, camera_matrix: {data: [50, 0, 22, 0, 51, 15, 0, 0, 1]},
        distortion_model: plumb_bob, distortion_coefficients: {data: [0.1, 0.2, 0.0, 0.0, 0.0]}}"""
    (fill(tmp_path, "0") / name).write_text(text)
    (frame,) = open_labelled(tmp_path)
    assert frame.camera == PinholeCamera(50, 51, 22, 15, (0.1, 0.2, 0.0, 0.0, 0.0), size=(31, 45))


@pytest.mark.parametrize("text", ["{}", '{"fx": 0, "fy": 1, "cx": 1, "cy": 1}', "[1, 2]", '{"fx": "a"}', "fx"])
def test_a_wrong_camera_is_named(tmp_path, text):
    (fill(tmp_path, "0") / "camera.json").write_text(text)
    with pytest.raises(SourceError, match=re.escape("camera.json: ")):
        open_labelled(tmp_path)


def test_images_without_labels_are_left_out_and_said(tmp_path, caplog):
    fill(tmp_path, "0", "1", "2")
    (tmp_path / "1.labels.png").unlink()
    with caplog.at_level(logging.WARNING, "dloftbs.sources"):
        assert [frame.name for frame in open_labelled(tmp_path)] == ["0.png", "2.png"]
    assert "left out 1 images without truth: 1.png" in caplog.text


def test_labels_without_an_image_are_an_error(tmp_path):
    fill(tmp_path, *"0123456789")
    for stem in "1234567":
        (tmp_path / f"{stem}.png").unlink()
    named = "7 of 10 lack an image .png|.jpg|"
    with pytest.raises(SourceError, match=re.escape(named) + ".*1.labels.png, .*5.labels.png and 2 more"):
        open_labelled(tmp_path)


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        (
            np.dstack([LABELS] * 3),
            "0.labels.png: labels must have one channel of integers, or be a PNG of indexed colour, got (31, 45, 3)",
        ),
        (LABELS[:-1], "frame 0: mask must have the frame's size (31, 45)"),
    ],
)
def test_wrong_labels_are_named(tmp_path, labels, message):
    with pytest.raises(SourceError, match=re.escape(message)):
        open_labelled(fill(tmp_path, "0", labels=labels)).frame(0)


def test_labels_cut_off_are_named(tmp_path):
    sequence = open_labelled(fill(tmp_path, "0"))
    (tmp_path / "0.labels.png").write_bytes(b"")
    for get in (sequence.frame, sequence.truth):
        with pytest.raises(SourceError, match=re.escape("0.labels.png: the file is empty")):
            get(0)


@pytest.mark.parametrize(("name", "count"), [("S1", 1), ("S2", 2), ("S3", 3)])
def test_the_photographs_of_mbest_open(shared_data, name, count):
    folder = shared_data / "mbest" / name
    with pickle.loads(pickle.dumps(open_labelled(folder))) as sequence:
        assert len(sequence) == 30
        assert sequence.name == str(folder)
        for index in (29, 0):
            frame, truth = sequence.frame(index), sequence.truth(index)
            assert frame.image.shape == (*frame.size, 3)
            assert truth.ids == tuple(range(1, count + 1))
            np.testing.assert_array_equal(frame.mask, truth.mask)


def test_a_wrong_folder_is_told_what_right_ones_look_like(tmp_path):
    save(tmp_path / "0.png", picture())
    (tmp_path / "notes.txt").write_text("")
    (tmp_path / "more").mkdir()
    with pytest.raises(SourceError) as error:
        open_labelled(tmp_path)
    assert "found more/, 1 .png, 1 .txt" in str(error.value)
    for layout in LAYOUTS.values():
        assert layout.tree in str(error.value)


def test_an_empty_folder_holds_nothing(tmp_path):
    with pytest.raises(SourceError, match="found nothing"):
        open_labelled(tmp_path)


def test_a_folder_of_sequences_is_told_to_be_opened_one_by_one(tmp_path):
    fill(tmp_path / "b", "0")
    fill(tmp_path / "a", "0")
    with pytest.raises(SourceError, match="Folders in it that look right, to be opened one by one: a, b"):
        open_labelled(tmp_path)


@pytest.mark.parametrize("layout", [name for name in LAYOUTS if name not in ("labels", "mbest")])
def test_a_folder_of_another_layout_is_told_so(tmp_path, layout):
    with pytest.raises(SourceError) as error:
        open_labelled(fill(tmp_path, "0"), layout)
    assert "It looks like the layout labels or mbest." in str(error.value)
    assert LAYOUTS[layout].tree in str(error.value)
    assert LAYOUTS["labels"].tree not in str(error.value)


def test_an_unknown_layout_is_refused(tmp_path):
    with pytest.raises(InputError, match="layout must be one of auto, written, labels, mbest, ariadne, spline tables"):
        open_labelled(tmp_path, "coco")


@pytest.mark.parametrize("name", ["none", "file.txt"])
def test_what_is_no_folder_is_refused(tmp_path, name):
    (tmp_path / "file.txt").write_text("")
    with pytest.raises(SourceError, match="there is no folder"):
        open_labelled(tmp_path / name)
