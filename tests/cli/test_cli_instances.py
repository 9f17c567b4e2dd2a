"""`--instances` of the commands: a mask per object, in files."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
from cli.cli_inputs import mask, photo, run, save

RULE = "{stem}_mask_*.png"


@pytest.fixture
def folder(tmp_path):
    """Return a folder with two masks for each of three frames."""
    for t in range(3):
        for k, y in enumerate((30, 70)):
            save(tmp_path / "in" / f"frame_{t:04d}_mask_{k}.png", mask(y + t))
    return tmp_path / "in"


def results(path):
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


@pytest.mark.parametrize("command", ["track", "detect"])
def test_a_folder_of_masks_of_objects_alone(folder, tmp_path, command):
    run(command, folder, "--instances", RULE, "--out", tmp_path / "a.jsonl")
    found = results(tmp_path / "a.jsonl")
    assert [one["name"] for one in found] == ["frame_0000", "frame_0001", "frame_0002"]
    assert [len(one["detections"]) for one in found] == [2, 2, 2]
    if command == "track":
        assert [track["id"] for track in found[-1]["tracks"]] == [1, 2]


def test_without_the_option_the_remedy_is_told(folder, tmp_path):
    result = run("track", folder, "--out", tmp_path / "a.jsonl")
    assert len(results(tmp_path / "a.jsonl")) == 6
    assert f'--instances "{RULE}"' in result.stderr


def test_in_place_of_a_colour(folder, tmp_path):
    for t in range(3):
        save(folder / f"frame_{t:04d}.jpg", photo(30 + t))
    run("track", folder, "--instances", RULE, "--out", tmp_path / "a.jsonl")
    assert [len(one["tracks"]) for one in results(tmp_path / "a.jsonl")] == [2, 2, 2]
    (folder / "frame_0001_mask_0.png").unlink()
    (folder / "frame_0001_mask_1.png").unlink()
    result = run("track", folder, "--instances", RULE, "--out", tmp_path / "b.jsonl", code=1)
    assert "skipped frame 1 (frame_0001.jpg): it has no mask, and there is no --hsv" in result.stderr
    assert [one["index"] for one in results(tmp_path / "b.jsonl")] == [0, 2]


def test_as_masks_two_parts_of_a_cable_that_touch_are_one_cable(tmp_path):
    whole = mask()
    left, right = whole.copy(), whole.copy()
    left[:, 100:] = right[:, :100] = 0
    save(tmp_path / "photo.jpg", photo())
    for name, pixels in (("mask_0", left), ("mask_1", right), ("whole", whole)):
        save(tmp_path / f"photo_{name}.png", pixels)
    found = []
    for masks in (RULE, "{stem}_whole.png"):
        run("detect", tmp_path / "photo.jpg", "--masks", masks, "--out", tmp_path / "a.jsonl")
        (result,) = results(tmp_path / "a.jsonl")
        found.append([one["confidence"] for one in result["detections"]])
    assert found[0] == found[1]
    assert len(found[0]) == 1


def test_files_that_a_shell_lists_need_the_folder(folder, tmp_path):
    result = run("track", *sorted(folder.glob("*.png")), "--instances", RULE, code=1)
    assert "where there are no pictures, name the folder" in result.stderr


def test_several_pictures_share_a_rule_and_no_file(folder, tmp_path):
    photos = [save(folder / f"frame_{t:04d}.jpg", photo(30)) for t in range(2)]
    run("detect", *photos, "--instances", RULE, "--out", tmp_path / "a.jsonl")
    assert [len(one["detections"]) for one in results(tmp_path / "a.jsonl")] == [2, 2]
    result = run("detect", *photos, "--instances", "coco.json", code=2)
    assert "must be rules" in result.stderr


def test_a_batch(folder, tmp_path):
    run("batch", folder, "--instances", RULE, "--out", tmp_path / "out")
    (path,) = (tmp_path / "out").glob("*.jsonl")
    assert [len(one["detections"]) for one in results(path)] == [2, 2, 2]


@pytest.mark.parametrize("name", ["coco.json", "photo_mask_1.png", "labels.npz"])
def test_no_output_replaces_them(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    save(tmp_path / "photo.png", photo())
    cv2.imwrite("photo_mask_1.png", mask())
    np.savez("labels.npz", instances=mask()[None])
    run("detect", "photo.png", "--instances", RULE, "--out", "curves.npz")
    images = [{"id": 1, "file_name": "photo.png"}]
    (tmp_path / "coco.json").write_text(json.dumps({"images": images, "annotations": []}), encoding="utf-8")
    given = RULE if name.endswith(".png") else name
    (tmp_path / "linked.csv").symlink_to(name)
    option = "--overlay" if name.endswith(".png") else "--out"
    before = (tmp_path / name).read_bytes()
    result = run(
        "detect", "photo.png", "--instances", given, option, name if option == "--overlay" else "linked.csv", code=2
    )
    assert "would replace the input" in result.stderr
    assert (tmp_path / name).read_bytes() == before
