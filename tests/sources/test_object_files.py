"""Masks of single objects in files: beside pictures, and as streams of their own."""

from __future__ import annotations

import json
import logging
import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from dloftbs import Frame, InputError, SourceError, sources
from dloftbs.data.run_lengths import encode

SIZE = (20, 30)


def rope(number: int, shift: int = 0) -> np.ndarray:
    canvas = np.zeros(SIZE, np.uint8)
    canvas[3 + 8 * number + shift :, 2:28][:3] = 255
    return canvas


def labels(shift: int = 0) -> np.ndarray:
    return np.select([rope(0, shift) > 0, rope(1, shift) > 0], [1, 2])


def save(path: Path, pixels: np.ndarray) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(cv2.imencode(path.suffix, pixels)[1].tobytes())
    return path


def picture() -> np.ndarray:
    return np.dstack([np.full(SIZE, 40, np.uint8), rope(0), rope(1)])


def corners(mask: np.ndarray) -> list[list[int]]:
    rows, columns = np.nonzero(mask)
    left, top, right, bottom = (int(n) for n in (columns.min(), rows.min(), columns.max(), rows.max()))
    return [[left, top], [right, top], [right, bottom], [left, bottom]]


def write(folder: Path, form: str, count: int = 3) -> str:
    """Write the masks of some frames in a form, and return the rule or the path that names them."""
    folder.mkdir(exist_ok=True)
    annotations = []
    for t in range(count):
        masks = [rope(0, t % 6), rope(1, t % 6)]
        polygons = [corners(mask) for mask in masks]
        match form:
            case "objects":
                for k, mask in enumerate(masks):
                    save(folder / f"f{t}_mask_{k}.png", mask)
            case "folders":
                for k, mask in enumerate(masks):
                    save(folder / f"f{t}" / f"{k}.png", mask)
            case "labels":
                save(folder / f"f{t}_labels.png", labels(t % 6).astype(np.uint16))
            case "stacks":
                np.save(folder / f"f{t}_masks.npy", np.stack(masks) > 0)
            case "labelme":
                shapes = [{"points": one, "shape_type": "polygon", "label": "rope"} for one in polygons]
                content = {"shapes": shapes, "imageHeight": 20, "imageWidth": 30}
                (folder / f"f{t}.json").write_text(json.dumps(content), encoding="utf-8")
            case "yolo":
                lines = [" ".join(["0", *(f"{x / 30} {y / 20}" for x, y in one)]) for one in polygons]
                (folder / f"f{t}.txt").write_text("\n".join(lines), encoding="utf-8")
            case "coco":
                annotations += [
                    {"image_id": t, "segmentation": encode(masks[0])},
                    {"image_id": t, "segmentation": [np.ravel(polygons[1]).tolist()]},
                ]
    if form == "coco":
        images = [{"id": t, "file_name": f"rgb/f{t}.png", "height": 20, "width": 30} for t in range(count)]
        path = folder / "coco.json"
        path.write_text(json.dumps({"images": images, "annotations": annotations}), encoding="utf-8")
        return str(path)
    return RULES[form]


RULES = {
    "objects": "{stem}_mask_*.png",
    "folders": "{stem}/*.png",
    "labels": "{stem}_labels.png",
    "stacks": "{stem}_masks.npy",
    "labelme": "{stem}.json",
    "yolo": "{stem}.txt",
}
FORMS = [*RULES, "coco"]


def read(where: object, **options: object) -> list[Frame]:
    with sources.open(where, **options) as source:
        return list(source)


@pytest.fixture(autouse=True)
def log(caplog):
    caplog.set_level(logging.WARNING, "dloftbs.sources")
    return caplog


@pytest.mark.parametrize("form", FORMS)
def test_masks_of_objects_beside_pictures(tmp_path, log, form):
    rule = write(tmp_path, form)
    for t in range(3):
        save(tmp_path / f"f{t}.png", picture())
    for where in (tmp_path, f"{tmp_path}/*.png", [tmp_path / f"f{t}.png" for t in range(3)]):
        frames = read(where, instances=rule)
        assert [frame.name for frame in frames] == ["f0.png", "f1.png", "f2.png"]
        for t, frame in enumerate(frames):
            np.testing.assert_array_equal(frame.instances, labels(t))
            np.testing.assert_array_equal(frame.mask, labels(t) > 0)
            np.testing.assert_array_equal(frame.image, picture())
    assert log.messages == []


@pytest.mark.parametrize("form", ["objects", "labelme", "yolo", "coco"])
def test_they_are_masks_as_their_union(tmp_path, form):
    rule = write(tmp_path, form)
    for t in range(3):
        save(tmp_path / f"f{t}.png", picture())
    for what in ("masks", "occluders"):
        for t, frame in enumerate(read(tmp_path, **{what: rule})):
            array = frame.mask if what == "masks" else frame.occluders
            assert array.dtype == np.bool_  # numbers would be read as labels
            np.testing.assert_array_equal(array, labels(t) > 0)
            assert frame.instances is None


@pytest.mark.parametrize("form", ["objects", "labels", "labelme", "stacks"])
def test_without_pictures_the_stems_are_the_frames(tmp_path, log, form):
    rule = write(tmp_path, form, 12)
    for t in range(12):
        np.save(tmp_path / f"f{t}_depth.npy", np.full(SIZE, t + 1.0))
    with sources.open(tmp_path, instances=rule, depth="{stem}_depth.npy", fps=10) as source:
        assert source.length == 12
        for _ in range(2):
            frames = list(source)
            assert [frame.name for frame in frames] == [f"f{t}" for t in range(12)]
            assert [frame.stamp for frame in frames] == [t / 10 for t in range(12)]
            assert [frame.depth[0, 0] for frame in frames] == [t + 1.0 for t in range(12)]
            for t, frame in enumerate(frames):
                np.testing.assert_array_equal(frame.instances, labels(t % 6))
                assert frame.image is None
    assert log.messages == []


@pytest.mark.parametrize("form", ["objects", "labels", "labelme"])
def test_without_pictures_numbers_without_a_file_are_told(tmp_path, log, form):
    rule = write(tmp_path, form, 12)
    for path in [path for number in (3, 7, 8) for path in tmp_path.glob(f"f{number}[._]*")]:
        path.unlink()
    assert len(read(tmp_path, instances=rule)) == 9
    (told,) = log.messages
    assert f"{tmp_path}: 3 numbers have no file, such as between f2 and f4; the frames behind them move up" in told
    assert "save a mask of zeros for each" in told


@pytest.mark.parametrize(
    "stems",
    [
        ["a", "b"],
        ["f7"],
        ["f0", "f10", "f20"],  # every tenth
        ["f1", "f001", "f2"],
        ["run1_0", "run1_1", "run2_6", "run2_7", "photo"],
        ["1612345678123", "1612345678156", "1612345678190", "1612345678256"],  # times
        ["9" * 40, "1" * 40],
    ],
)
def test_other_names_have_no_gaps(tmp_path, log, stems):
    for stem in stems:
        save(tmp_path / f"{stem}_mask_0.png", rope(0))
    assert len(read(tmp_path, instances="{stem}_mask_*.png")) == len(stems)
    assert log.messages == []


def test_pictures_of_depth_alone_are_no_pictures_of_frames(tmp_path):
    rule = write(tmp_path, "objects")
    for t in range(3):
        save(tmp_path / f"f{t}_depth.png", np.full(SIZE, 1000, np.uint16))
    frames = read(tmp_path, instances=rule, depth="{stem}_depth.png")
    assert [frame.name for frame in frames] == ["f0", "f1", "f2"]
    assert all(frame.depth is not None for frame in frames)


def test_a_frame_without_a_picture_that_cannot_be_read_is_skipped(tmp_path, log):
    rule = write(tmp_path, "objects")
    (tmp_path / "f1_mask_1.png").write_bytes(b"broken")
    with sources.open(tmp_path, instances=rule) as source:
        assert [frame.index for frame in source] == [0, 2]
        assert source.skipped == 1
    assert "skipped frame 1" in log.text
    assert "f1_mask_1.png" in log.text
    write(tmp_path / "yolo", "yolo")
    assert read(tmp_path / "yolo", instances="{stem}.txt") == []
    assert "shares of the picture's size, which is needed beside it" in log.text


@pytest.mark.parametrize("rule", ["masks/{stem}_mask_*.png", "masks/{stem}.png"])
def test_a_rule_by_which_no_frame_has_a_file_is_refused_with_the_place_it_means(tmp_path, rule):
    for t in range(2):
        save(tmp_path / f"f{t}.png", picture())
    expected = re.escape(str(tmp_path / rule.replace("{stem}", "f0")))
    with pytest.raises(SourceError, match=f"such as '{expected}'; a rule starts from the folder of the frames"):
        sources.open(tmp_path, instances=rule)


@pytest.mark.parametrize(
    ("form", "damage", "message"),
    [
        ("objects", lambda folder: [(folder / f"f1_mask_{k}.png").unlink() for k in range(2)], "no file by the rule"),
        ("objects", lambda folder: save(folder / "f1_mask_1.png", rope(0)[:9]), "must have the size"),
        ("labels", lambda folder: (folder / "f1_labels.png").unlink(), "f1_labels.png: cannot be read"),
        ("labels", lambda folder: save(folder / "f1_labels.png", picture()), "must have one channel of integers"),
        ("stacks", lambda folder: np.save(folder / "f1_masks.npy", rope(0) / 2.0), "threshold it first"),
        ("labelme", lambda folder: (folder / "f1.json").write_text("{"), "f1.json"),
        ("yolo", lambda folder: (folder / "f1.txt").write_text("31 279 244 271 232 263 217"), "line 1 must have"),
        (
            "coco",
            lambda folder: (folder / "f1.png").rename(folder / "f1_.png"),
            r"has no image that is named 'f1_.png'",
        ),
    ],
)
def test_a_frame_goes_without_what_is_missing_or_corrupt(tmp_path, log, form, damage, message):
    rule = write(tmp_path, form)
    for t in range(3):
        save(tmp_path / f"f{t}.png", picture())
    damage(tmp_path)
    frames = read(tmp_path, instances=rule)
    assert [frame.instances is None for frame in frames] == [False, True, False]
    assert [frame.mask is None for frame in frames] == [False, True, False]
    (told,) = log.messages
    assert told.startswith("frame 1 goes without instances: ")
    assert message in told


@pytest.mark.parametrize("option", ["instances", "masks", "occluders"])
def test_scores_of_an_object_are_refused_in_files_as_in_memory(tmp_path, log, option):
    scores = np.where(rope(0) > 0, 0.99, 0.01).astype(np.float32)
    save(tmp_path / "f0.png", picture())
    np.save(tmp_path / "f0_mask_0.npy", scores > 0.5)
    np.save(tmp_path / "f0_mask_1.npy", scores)
    with pytest.raises(InputError, match=r"got float32; threshold it first: x > 0\.5"):
        Frame(instances=[scores])
    (frame,) = read(tmp_path / "f0.png", **{option: "{stem}_mask_*.npy"})
    assert frame.mask is frame.instances is frame.occluders is None
    expected = "f0_mask_1.npy: the mask of an object must be bool or integer, got float32; threshold it first: x > 0.5"
    assert expected in log.text


def test_label_images_of_a_lossy_codec_are_refused(tmp_path, log):
    save(tmp_path / "f0.png", picture())
    save(tmp_path / "f0_labels.jpg", labels().astype(np.uint8))
    (frame,) = read(tmp_path / "f0.png", instances="{stem}_labels.jpg")
    assert frame.instances is None
    assert "a lossy codec changes numbers: save labels as PNG" in log.text


def test_folders_and_stacks_of_label_images(tmp_path, log):
    write(tmp_path / "labels", "labels")
    np.save(tmp_path / "labels.npy", np.stack([labels(t) for t in range(3)]))
    np.savez(tmp_path / "labels.npz", instances=np.stack([labels(t) for t in range(3)]))
    for t in range(3):
        save(tmp_path / "rgb" / f"f{t}.png", picture())
    for where in ("labels", "labels/*.png", "labels.npy", "labels.npz"):
        for t, frame in enumerate(read(tmp_path / "rgb", instances=tmp_path / where)):
            np.testing.assert_array_equal(frame.instances, labels(t))
    assert log.messages == []


def test_beside_masks_they_only_say_who_is_who(tmp_path):
    rule = write(tmp_path, "objects", 1)
    save(tmp_path / "f0.png", picture())
    save(tmp_path / "m" / "f0.png", rope(0))
    (frame,) = read(tmp_path / "f0.png", instances=rule, masks="m/{stem}.png")
    np.testing.assert_array_equal(frame.mask, rope(0))
    np.testing.assert_array_equal(frame.instances, labels())


def test_instances_given_replace_those_of_a_stack(tmp_path):
    np.savez(tmp_path / "a.npz", images=picture()[None], instances=labels(2)[None])
    np.save(tmp_path / "labels.npy", labels()[None])
    (frame,) = read(tmp_path / "a.npz", instances=tmp_path / "labels.npy")
    np.testing.assert_array_equal(frame.instances, labels())
    np.testing.assert_array_equal(frame.mask, labels() > 0)


@pytest.mark.parametrize(
    ("where", "options", "error", "message"),
    [
        ("f0.png", {"instances": 5}, InputError, "instances must be a path or a naming rule, got 5"),
        ("f0.png", {"instances": ""}, InputError, "instances is an empty text"),
        ("f0.png", {"instances": "none.json"}, SourceError, "instances: there is no file 'none.json'"),
        ("f0.png", {"instances": "coco.json"}, SourceError, "no file_name is that of a frame"),
        ("f0.png", {"instances": "clip.mkv"}, SourceError, "instances must be image files, annotations, .npy or .npz"),
        ("f0.png", {"depth": "{stem}_*.png"}, InputError, "depth: the rule .* must name one file for a frame"),
        ("a.npy", {"instances": "{stem}_*.png"}, InputError, "needs frames in files of their own"),
        ("a.npy", {"instances": "coco.json"}, InputError, "knows frames by their names"),
        (0, {"instances": "{stem}.json"}, InputError, "instances cannot go with a camera"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, monkeypatch, where, options, error, message):
    monkeypatch.chdir(tmp_path)
    save(Path("f0.png"), picture())
    np.save("a.npy", rope(0)[None])
    Path("clip.mkv").write_bytes(b"\x1a\x45\xdf\xa3" + bytes(40))
    content = {"images": [{"id": 1, "file_name": "x.png"}, {"id": 2, "file_name": "y.png"}], "annotations": []}
    Path("coco.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(error, match=message):
        read(where, **options)
