"""The command on videos: pauses, masks beside them, what is cut off, frames that are left out."""

from __future__ import annotations

import json

import numpy as np
import pytest
import videos
from cli.cli_inputs import RED, mask, photo, run

from dloftbs.sinks import read_json_lines

COUNT = 24
PAUSES = [number / 20 + 7.0 * (number >= 8) + 4.0 * (number >= 16) for number in range(COUNT)]


def lines(path):
    return list(read_json_lines(path))


def cable(number):
    return photo(30 + number)


WRITERS = {"pause.webm": videos.write_vp9, "pause.mkv": videos.write, "pause.mp4": videos.write_av1}


def paused(folder, name):
    return WRITERS[name](folder / name, pictures=[cable(number) for number in range(COUNT)], times=PAUSES)


@pytest.mark.parametrize("name", WRITERS)
def test_a_recording_with_pauses_is_followed_without_a_warning(tmp_path, name):
    path = paused(tmp_path, name)
    result = run("track", path, "--hsv", RED, "--out", tmp_path / "curves.jsonl", code=0)
    assert "warning" not in result.stderr
    rows = lines(tmp_path / "curves.jsonl")
    assert [row["stamp"] for row in rows] == pytest.approx(PAUSES, abs=2e-3)
    assert f"frames     {COUNT}, 0 skipped" in result.stderr


def test_masks_go_with_a_recording_with_pauses(tmp_path):
    path = paused(tmp_path, "pause.webm")
    stack = np.stack([mask(30 + number) for number in range(COUNT)])
    np.save(tmp_path / "masks.npy", stack)
    videos.write(tmp_path / "masks.mp4", pictures=[np.dstack([255 * (one > 0).astype(np.uint8)] * 3) for one in stack])
    for name in ("masks.npy", "masks.mp4"):
        result = run("track", path, "--masks", tmp_path / name, "--out", tmp_path / f"{name}.jsonl", code=0)
        assert "warning" not in result.stderr
        assert len(lines(tmp_path / f"{name}.jsonl")) == COUNT


@pytest.mark.parametrize("count", [COUNT - 4, COUNT + 4])
def test_masks_of_another_number_are_reported_at_the_end(tmp_path, count):
    path = paused(tmp_path, "pause.webm")
    np.save(tmp_path / "masks.npy", np.stack([mask(30 + number) for number in range(count)]))
    result = run("track", path, "--masks", tmp_path / "masks.npy", "--out", tmp_path / "curves.jsonl", code=1)
    assert f"mask must have as many frames as {path}, which has {COUNT}; got {count}" in result.stderr
    assert [row["index"] for row in lines(tmp_path / "curves.jsonl")] == list(range(min(count, COUNT)))
    run("track", path, "--masks", tmp_path / "masks.npy", "--out", tmp_path / "few.jsonl", "--limit", 10, code=0)


def test_a_video_that_is_cut_off_is_reported(tmp_path):
    path = videos.cut(paused(tmp_path, "pause.mkv"), 0.6)
    result = run("track", path, "--hsv", RED, "--out", tmp_path / "curves.jsonl", code=1)
    assert "warning: " in result.stderr
    assert "it is cut off after" in result.stderr
    assert 0 < len(lines(tmp_path / "curves.jsonl")) < COUNT


def test_every_and_limit_go_by_frames(tmp_path):
    path = paused(tmp_path, "pause.webm")
    run("track", path, "--hsv", RED, "--every", 5, "--limit", 4, "--out", tmp_path / "curves.jsonl")
    assert [row["index"] for row in lines(tmp_path / "curves.jsonl")] == [0, 5, 10, 15]
    result = run("detect", path, "--hsv", RED, "--every", 5)
    rows = [json.loads(line) for line in result.stdout.splitlines() if line.startswith("{")]
    assert [row["index"] for row in rows] == [0, 5, 10, 15, 20]


def test_an_avif_image_is_read(tmp_path):
    Image = pytest.importorskip("PIL.Image")
    Image.fromarray(photo(50)[..., ::-1]).save(tmp_path / "photo.avif")
    Image.fromarray(255 * (mask(50) > 0).astype(np.uint8)).save(tmp_path / "mask.avif")
    for options in (("photo.avif", "--hsv", RED), ("mask.avif",)):
        run("detect", tmp_path / options[0], *options[1:], "--out", tmp_path / "curves.jsonl")
        (row,) = lines(tmp_path / "curves.jsonl")
        assert len(row["detections"]) == 1


def test_sound_without_pictures_is_an_error(tmp_path):
    import av

    with av.open(str(tmp_path / "a.mp4"), "w") as output:
        stream = output.add_stream("aac", rate=16000)
        sound = av.AudioFrame.from_ndarray(np.zeros((1, 16000), np.float32), format="fltp", layout="mono")
        sound.sample_rate = 16000
        output.mux(stream.encode(sound))
        output.mux(stream.encode())
    result = run("track", tmp_path / "a.mp4", "--hsv", RED, code=1)
    assert "a.mp4: has no moving pictures; it holds audio" in result.stderr
