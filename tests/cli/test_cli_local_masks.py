"""``--local``, ``--background``, and ``dloftbs background``: cables that no colour tells from their ground."""

import json
import os
import signal

import cv2
import numpy as np
import pytest
from cli.cli_inputs import photo, run, save
from uneven_pictures import iou, line, lit, picture

from dloftbs.config import BackgroundConfig, Config, LocalConfig
from dloftbs.sources.image_files import FileSource


def detections(text):
    return [json.loads(row)["detections"] for row in text.splitlines()]


@pytest.fixture
def clip(tmp_path, monkeypatch):
    """A folder of frames in which a dim cable moves downwards."""
    monkeypatch.chdir(tmp_path)
    for index in range(12):
        truth = np.roll(line(6), 6 * (index - 6), axis=0)
        save(tmp_path / "clip" / f"{index}.png", picture(truth, (70, 80, 90), -25, light=lit(), seed=index))
    return "clip"


def test_a_dim_cable_is_found_by_its_surroundings(clip):
    result = run("detect", clip, "--kind", "image", "--local", "darker")
    found = detections(result.stdout)
    assert [len(frame) for frame in found] == [1] * 12


def test_a_background_is_made_of_a_clip_and_used_by_the_command_that_comes_next(clip, tmp_path):
    made = run("background", clip, "--out", "empty.png")
    assert made.stderr.splitlines() == [
        "empty.png: the background of 12 frames",
        "next: dloftbs track clip --background empty.png --overlay overlay.mp4",
    ]
    background = cv2.imread("empty.png")
    assert iou(np.abs(background.astype(int) - cv2.imread("clip/6.png")).max(axis=2) > 12, line(6)) > 0.6
    result = run("track", clip, "--kind", "image", "--background", "empty.png", "--out", "c.jsonl")
    assert [len(frame) for frame in detections((tmp_path / "c.jsonl").read_text())] == [1] * 12
    assert "1 confirmed" in result.stderr
    used = Config.from_file("c.config.yaml")
    assert used.segmentation.background == BackgroundConfig(file="empty.png")


def test_options_and_settings_say_the_same(tmp_path):
    (tmp_path / "c.yaml").write_text("segmentation: {local: darker}")
    words = ("--config", tmp_path / "c.yaml", "--set", "segmentation.local.join=or", "--local", "brighter")
    config = Config.from_yaml(run("config", "print", *words, "--background", "a.png", "--hsv", "red").stdout)
    assert config.segmentation.local == LocalConfig(tone="brighter", join="or")
    assert config.segmentation.background == BackgroundConfig(file="a.png")
    assert len(config.segmentation.hsv) == 1
    assert "Invalid value for '--local'" in run("config", "print", "--local", "dark", code=2).stderr


def test_errors_name_the_background(clip):
    run("background", clip, "--out", "empty.png")
    missing = run("detect", clip, "--kind", "image", "--background", "missing.png", code=1)
    assert "error: segmentation.background.file: cannot read 'missing.png'" in missing.stderr
    save_small = cv2.imread("empty.png")[:100]
    cv2.imwrite("small.png", save_small)
    other = run("track", clip, "--kind", "image", "--background", "small.png", code=1)
    assert "segmentation.background is 320 x 100 px, the frame 320 x 240" in other.stderr


def test_a_background_replaces_no_input_and_no_result_replaces_a_background(clip, tmp_path):
    refused = run("background", clip, "--out", "clip/3.png", code=2)
    assert "would replace the input clip/3.png" in refused.stderr
    assert "must end in .png" in run("background", clip, "--out", "empty.jpg", code=2).stderr
    run("background", clip, "--out", "empty.png")
    run("background", clip, "--out", "empty.png")  # what it wrote it may replace
    words = ("--kind", "image", "--background", "empty.png", "--overlay", "empty.png")
    assert "would replace the input empty.png" in run("detect", "clip/1.png", *words, code=2).stderr


def test_frames_that_cannot_be_read_are_reported_and_the_rest_makes_a_background(clip, tmp_path):
    (tmp_path / "clip" / "4.png").write_bytes(b"no picture")
    made = run("background", clip, "--out", "empty.png", code=1)
    assert "empty.png: the background of 11 frames" in made.stderr
    assert "4.png" in made.stderr
    limited = run("background", clip, "--limit", 3, "--out", "first.png")
    assert "first.png: the background of 3 frames" in limited.stderr


@pytest.mark.parametrize("endless", [None, "live", "single_pass"])
def test_after_ctrl_c_a_camera_has_a_background_and_a_recording_has_none(clip, tmp_path, monkeypatch, endless):
    class Interrupted(FileSource):
        def _read(self, path):
            if path.name == "4.png":
                os.kill(os.getpid(), signal.SIGINT)
            return super()._read(path)

    monkeypatch.setattr("dloftbs.sources.FileSource", Interrupted)
    if endless is not None:
        monkeypatch.setattr(Interrupted, endless, True)
    (tmp_path / "empty.png").write_bytes(b"precious")
    ended = run("background", clip, "--out", "empty.png", code=130 if endless is None else 0)
    assert ("the background of 5 frames" in ended.stderr) == (endless is not None)
    assert ((tmp_path / "empty.png").read_bytes() == b"precious") == (endless is None)


def test_a_background_of_nothing_is_refused(tmp_path):
    save(tmp_path / "photo.png", photo())
    run("background", tmp_path / "photo.png", "--out", tmp_path / "empty.png")
    assert np.array_equal(cv2.imread(str(tmp_path / "empty.png")), photo())
    assert "error:" in run("background", tmp_path / "missing.mp4", "--out", tmp_path / "b.png", code=1).stderr
    assert not (tmp_path / "b.png").exists()
