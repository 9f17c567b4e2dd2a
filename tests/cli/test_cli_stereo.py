"""The command stereo: two streams, or one with both views, to curves in metres."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
import yaml
from cli.cli_inputs import run, save
from stereo_views import BENT, SIZE, distances_m, masks, rig

from dloftbs import BSplineCurve, Frame, StereoPipeline
from dloftbs.cli.stereo_run import halves_of, pairs_of
from dloftbs.errors import InputError


def moved(step):
    return BENT + np.array([0.004 * step, 0.0, 0.0])


@pytest.fixture
def scene(tmp_path):
    """Return a folder with two folders of masks and images, and the file of their rig."""
    r = rig()
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(r.to_dict()))
    for step in range(4):
        for side, mask in zip(("left", "right"), masks(r, moved(step)), strict=True):
            save(tmp_path / side / f"{step}.png", mask.astype(np.uint8) * 255)
            image = np.where(mask[..., None], (0, 0, 255), (90, 120, 90)).astype(np.uint8)
            save(tmp_path / f"{side}_images" / f"{step}.png", image)
    return tmp_path


def rows_of(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def check(rows):
    assert len(rows) == 4
    for step, row in enumerate(rows):
        assert [track["id"] for track in row["tracks"]] == [1]
        curve = BSplineCurve.from_dict(row["tracks"][0]["curve_3d"])
        assert distances_m(curve, moved(step)).mean() < 0.003
        assert row["detections"][0]["no_3d_reason"] is None


def test_two_folders(scene):
    out = scene / "a.jsonl"
    result = run("stereo", scene / "left", scene / "right", "--rig", scene / "rig.yaml", "--out", out)
    check(rows_of(out))
    assert "stereo" in result.stderr
    assert (scene / "a.config.yaml").exists()


@pytest.mark.parametrize("given", [(), ("--triggered",)])
def test_cameras_that_are_triggered_are_said_to_be(scene, given, monkeypatch):
    rigs = []

    def made(r, config):
        rigs.append(r)
        return StereoPipeline(r, config)

    monkeypatch.setattr("dloftbs.cli.stereo_run.StereoPipeline", made)
    run("stereo", scene / "left", scene / "right", "--rig", scene / "rig.yaml", *given)
    assert [r.triggered for r in rigs] == [bool(given)]


def test_standard_output_and_colour(scene):
    images = scene / "left_images", scene / "right_images"
    result = run("stereo", *images, "--rig", scene / "rig.yaml", "--hsv", "red")
    check([json.loads(line) for line in result.stdout.splitlines()])


def test_masks_beside_images(scene):
    images = scene / "left_images", scene / "right_images"
    given = "--masks", scene / "left", "--right-masks", scene / "right"
    result = run("stereo", *images, "--rig", scene / "rig.yaml", *given)
    check([json.loads(line) for line in result.stdout.splitlines()])


def test_pictures_are_read_as_stored(scene):
    pytest.importorskip("PIL")
    from picture_files import pillow  # which needs it

    for side in ("left", "right"):
        for step in range(4):
            stored = cv2.imread(str(scene / side / f"{step}.png"), cv2.IMREAD_UNCHANGED)
            (scene / side / f"{step}.png").write_bytes(pillow(stored, "PNG", orientation=3))
    result = run("stereo", scene / "left", scene / "right", "--rig", scene / "rig.yaml")
    check([json.loads(line) for line in result.stdout.splitlines()])


def test_side_by_side_and_every_sink(scene):
    for step in range(4):
        sides = [cv2.imread(str(scene / f"{side}_images" / f"{step}.png")) for side in ("left", "right")]
        save(scene / "both" / f"{step}.png", np.hstack(sides))
    outs = [scene / f"a.{kind}" for kind in ("jsonl", "npz", "csv", "ply", "mcap")]
    options = [part for out in outs for part in ("--out", out)]
    pictures = "--overlay", scene / "drawn"
    run("stereo", scene / "both", "--side-by-side", "--rig", scene / "rig.yaml", "--hsv", "red", *options, *pictures)
    check(rows_of(outs[0]))
    assert all(out.exists() for out in outs if out.suffix != ".ply")
    assert len(list((scene / "a").glob("*.ply"))) == 4
    drawn = cv2.imread(str(next((scene / "drawn").glob("*.png"))))
    assert drawn.shape[:2] == SIZE


def test_two_topics_of_a_recording(scene):
    ros = pytest.importorskip("dloftbs.ros")
    pytest.importorskip("rosbags")
    for side in ("left", "right"):
        run("track", scene / side, "--fps", "30", "--out", scene / f"{side}.mcap", "--with-input")
    assert ros.Recording(scene / "left.mcap")
    topic = "--topic", "/dloftbs/mask", "--kind", "mask"
    files = scene / "left.mcap", scene / "right.mcap"
    result = run("stereo", *files, *topic, "--rig", scene / "rig.yaml")
    check([json.loads(line) for line in result.stdout.splitlines()])


@pytest.mark.parametrize(
    ("arguments", "message", "code"),
    [
        (("left",), "name LEFT and RIGHT", 2),
        (("left", "right", "--side-by-side"), "leave out RIGHT", 2),
        (("left", "--side-by-side", "--right-masks", "right"), "leave out --right-masks", 2),
        (("left", "right", "--camera", "1,1,1,1"), "--rig has both", 2),
        (("left", "right", "--info-topic", "/info"), "--info-topic is one camera; --rig has both", 2),
        (("left_images", "right_images", "--masks", "left"), "add --right-masks, or give a naming rule", 2),
        (("left_images", "right_images", "--depth", "left"), "--depth left goes with the left view alone", 2),
        (("left_images", "right_images", "--instances", "left"), "naming rule", 2),
        (("left_images", "right_images", "--occluders", "left"), "naming rule", 2),
        (("a.mcap", "--right-topic", "/right", "--mask-topic", "/masks"), "--right-mask-topic", 2),
        (("left", "right", "--with-input"), "--with-input goes with", 2),
        (("left", "nothing"), "nothing", 1),
    ],
)
def test_what_is_refused(scene, monkeypatch, arguments, message, code):
    monkeypatch.chdir(scene)
    result = run("stereo", *arguments, "--rig", "rig.yaml", code=code)
    assert message in result.stderr


def test_a_rig_is_needed(scene):
    assert "--rig" in run("stereo", scene / "left", scene / "right", code=2).stderr
    (scene / "rig.yaml").write_text("a: 1")
    assert "is no rig" in run("stereo", scene / "left", scene / "right", "--rig", scene / "rig.yaml", code=1).stderr


def test_no_input_is_replaced(scene):
    result = run(
        "stereo", scene / "left", scene / "right", "--rig", scene / "rig.yaml", "--overlay", scene / "rig.yaml", code=2
    )
    assert "rig.yaml" in result.stderr


def frame(index, stamp=None):
    return Frame(mask=np.zeros((2, 4), bool), index=index, stamp=stamp)


def test_moments_are_paired_by_time_or_number():
    left = [frame(0, 0.0), frame(1, 0.033), frame(2, 0.066), frame(3, 0.1)]
    right = [frame(0, 0.005), frame(1, 0.071), frame(2, 0.104), frame(3, 0.2)]
    assert [(a.index, b.index) for a, b in pairs_of(iter(left), iter(right), 0.016)] == [(0, 0), (2, 1), (3, 2)]
    pairs = pairs_of(iter([frame(0), frame(2), frame(3)]), iter([frame(1), frame(2), frame(3)]), 0.016)
    assert [(a.index, b.index) for a, b in pairs] == [(2, 2), (3, 3)]


def test_a_frame_goes_with_the_nearest_one():
    left = [frame(index, index / 60.0) for index in range(8)]
    right = [frame(index - 1, index / 60.0 + 0.001) for index in range(1, 8)]
    assert [(a.index, b.index) for a, b in pairs_of(iter(left), iter(right), 0.02)] == [(k, k - 1) for k in range(1, 8)]
    assert [(a.index, b.index) for a, b in pairs_of(iter(right), iter(left), 0.02)] == [(k - 1, k) for k in range(1, 8)]


def test_of_cameras_no_frame_is_awaited_that_cannot_be_nearer():
    read = []

    def camera(delay_s):
        for index in range(5):
            read.append((delay_s, index))
            yield frame(index, index / 30.0 + delay_s)

    for number, _ in enumerate(pairs_of(camera(0.0), camera(0.01), 0.016)):
        assert max(index for _, index in read) <= max(number, 1)


def test_every_so_manieth_pair_is_taken(scene):
    (scene / "right" / "0.png").unlink()
    stamps = {"left": [0.0, 0.1, 0.2, 0.3], "right": [0.1, 0.2, 0.3]}
    for side, times in stamps.items():
        masks_of = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted((scene / side).glob("*.png"))]
        np.savez(scene / f"{side}.npz", masks=np.stack(masks_of), stamps=np.array(times))
    result = run("stereo", scene / "left.npz", scene / "right.npz", "--rig", scene / "rig.yaml", "--every", 2)
    rows = [json.loads(line) for line in result.stdout.splitlines()]
    assert [row["index"] for row in rows] == [1, 3]
    for row in rows:
        curve = BSplineCurve.from_dict(row["tracks"][0]["curve_3d"])
        assert distances_m(curve, moved(row["index"])).mean() < 0.003


def test_halves():
    both = Frame(image=np.arange(24, dtype=np.uint8).reshape(2, 4, 3), mask=np.eye(2, 4, dtype=bool), index=3)
    left, right = halves_of(both)
    assert left.image.shape == right.image.shape == (2, 2, 3)
    assert np.array_equal(np.hstack([left.mask, right.mask]), both.mask)
    assert (left.index, right.index) == (3, 3)
    with pytest.raises(InputError, match="even width, got 3"):
        halves_of(Frame(mask=np.zeros((2, 3), bool)))
