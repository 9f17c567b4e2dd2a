"""What runs side by side writes what one loop after the other would write, whatever ends it."""

from __future__ import annotations

import json
import time

import av
import cv2
import numpy as np
import pytest
from cli.cli_inputs import RED, mask, photo, run, save

from dloftbs import Config, HsvRange, Pipeline, sinks, sources
from dloftbs.config import SegmentationConfig
from dloftbs.errors import SinkError
from dloftbs.support import overlap

CONFIG = Config(segmentation=SegmentationConfig(hsv=(HsvRange.parse(RED),)))
OUTS = ("curves.jsonl", "curves.npz", "curves.csv", "overlay.mp4")


def in_turn(where, folder):
    """Read, track and write frame by frame, and say how many frames were skipped."""
    pipeline = Pipeline(CONFIG)
    opened = [sinks.open(folder / name, **({"fps": 30.0} if name == "overlay.mp4" else {})) for name in OUTS]
    with sources.open(where, fps=30.0) as source, sinks.MultiSink(opened) as sink:
        for frame in source:
            sink.write(frame, pipeline.process(frame))
        return source.skipped


def side_by_side(where, folder, code=0):
    outs = [f"--out={folder / name}" for name in OUTS[:-1]]
    return run("track", where, "--hsv", RED, "--fps", 30, *outs, "--overlay", folder / OUTS[-1], code=code)


def lines(path):
    """The lines of JSON without their times, which are never the same."""
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    return [{key: value for key, value in row.items() if key != "stage_ms"} for row in rows]


def moving(number):
    return photo(40 + number % 25) if number % 9 else photo(40, colour=(90, 120, 90))


def video(path):
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), 30.0, (200, 100))
    for number in range(40):
        writer.write(moving(number))
    writer.release()
    return path


def folder_with_holes(path):
    for number in range(30):
        save(path / f"{number}.png", moving(number))
    for number in (0, 7, 8, 29):
        (path / f"{number}.png").write_bytes(b"no picture")
    return path


@pytest.mark.parametrize("cores", [1, 2, 4])
@pytest.mark.parametrize("make", [video, folder_with_holes])
def test_the_bytes_are_those_of_one_loop(tmp_path, monkeypatch, make, cores):
    monkeypatch.setattr(overlap, "cores", lambda: cores)
    where = make(tmp_path / ("in.mp4" if make is video else "in"))
    (tmp_path / "a").mkdir()
    skipped = in_turn(where, tmp_path / "a")
    result = side_by_side(where, tmp_path / "b", code=0 if make is video else 1)
    assert skipped == (0 if make is video else 4)
    assert f"{skipped} skipped" in result.stderr
    for name in OUTS[1:]:
        assert (tmp_path / "b" / name).read_bytes() == (tmp_path / "a" / name).read_bytes(), name
    rows = lines(tmp_path / "b" / "curves.jsonl")
    assert rows == lines(tmp_path / "a" / "curves.jsonl")
    assert len(rows) == (40 if make is video else 26)


def test_a_limit_reads_no_frame_that_is_not_wanted(tmp_path):
    where = folder_with_holes(tmp_path / "in")
    result = run("track", where, "--hsv", RED, "--limit", 6, "--out", tmp_path / "curves.jsonl", code=1)
    assert [row["index"] for row in lines(tmp_path / "curves.jsonl")] == [1, 2, 3, 4, 5, 6]
    assert "frames     6, 1 skipped" in result.stderr
    assert "frame 7" not in result.stderr


@pytest.mark.parametrize("cores", [1, 2])
def test_a_sink_that_fails_ends_the_run_with_what_was_written_before(tmp_path, monkeypatch, cores):
    monkeypatch.setattr(overlap, "cores", lambda: cores)
    where = folder_with_holes(tmp_path / "in")
    write = sinks.CsvSink._write

    def full(self, frame, result):
        if frame.index == 12:
            raise SinkError("the disk is full")
        write(self, frame, result)

    monkeypatch.setattr(sinks.CsvSink, "_write", full)
    result = side_by_side(where, tmp_path / "out", code=1)
    assert result.stderr.splitlines()[-1] == "error: the disk is full"
    # A sink that fails costs the others nothing: they have the frame at which it did.
    assert [row["index"] for row in lines(tmp_path / "out" / "curves.jsonl")] == [*range(1, 7), *range(9, 13)]
    assert "frames     9, " in result.stderr
    assert len(sinks.read_npz(tmp_path / "out" / "curves.npz")) > 0


def test_an_image_without_a_colour_in_mid_stream_ends_the_run_after_what_came_before(tmp_path):
    for number in range(6):
        save(tmp_path / "in" / f"{number}.png", mask() if number < 5 else photo())
    result = run("track", tmp_path / "in", "--out", tmp_path / "curves.jsonl", code=1)
    assert "error: 5.png is a colour image" in result.stderr
    assert [row["index"] for row in lines(tmp_path / "curves.jsonl")] == [0, 1, 2, 3, 4]


class FastCamera:
    """A camera with a frame every 2 ms, and an end."""

    def __init__(self, where):
        self.left, self.released = 60, False

    def isOpened(self):
        return True

    def read(self):
        assert not self.released
        time.sleep(0.002)
        self.left -= 1
        return self.left >= 0, photo() if self.left >= 0 else None

    def get(self, key):
        return 0.0

    def release(self):
        self.released = True


@pytest.mark.parametrize(
    ("where", "live"), [("0", True), ("rtsp://host/cable", True), ("http://host/cable.mp4", False)]
)
def test_frames_of_a_camera_are_left_out_rather_than_late(tmp_path, monkeypatch, where, live):
    monkeypatch.setattr(cv2, "VideoCapture", FastCamera)
    monkeypatch.setattr("dloftbs.sources.video.RETRY_S", 0.0)
    process = Pipeline.process

    def slowly(self, frame):
        time.sleep(0.02)
        return process(self, frame)

    monkeypatch.setattr(Pipeline, "process", slowly)
    result = run("track", where, "--hsv", RED, "--out", tmp_path / "curves.jsonl")
    indices = [row["index"] for row in lines(tmp_path / "curves.jsonl")]
    assert indices == sorted(set(indices))
    if live:
        assert len(indices) < 60
        assert indices[-1] == 59
        assert f", {60 - len(indices)} left out to keep up with the camera" in result.stderr
    else:  # it may be a file
        assert indices == list(range(60))
        assert "left out" not in result.stderr


class SlowCamera(FastCamera):
    """A camera that comes at a tenth of the rate that it says."""

    def read(self):
        time.sleep(0.02)
        return super().read()

    def get(self, key):
        return 200.0 if key == cv2.CAP_PROP_FPS else 0.0


def test_the_overlay_video_of_a_camera_lasts_as_long_as_what_it_shows(tmp_path, monkeypatch):
    monkeypatch.setattr(cv2, "VideoCapture", SlowCamera)
    monkeypatch.setattr("dloftbs.sources.video.RETRY_S", 0.0)
    run("track", "0", "--hsv", RED, "--out", tmp_path / "curves.jsonl", "--overlay", tmp_path / "overlay.mp4")
    stamps = np.array([row["stamp"] for row in lines(tmp_path / "curves.jsonl")])
    with av.open(str(tmp_path / "overlay.mp4")) as overlay:
        times = [float(picture.time) for picture in overlay.decode(video=0)]
    assert times == pytest.approx(stamps - stamps[0], abs=1e-3)


def test_a_batch_in_several_threads_gives_what_one_gives(tmp_path):
    paths = [save(tmp_path / "in" / f"{number}.png", moving(number)) for number in range(20)]
    paths[4].write_bytes(b"no picture")
    given = [*paths[:10], tmp_path / "missing.png", tmp_path / "in", *paths[10:]]
    found = {}
    for jobs in (1, 2, 5):
        pictures = tmp_path / f"pictures{jobs}"
        result = run("detect", *given, "--hsv", RED, "--jobs", jobs, "--overlay", pictures, "--out", "-", code=1)
        rows = [json.loads(line) for line in result.stdout.splitlines()]
        for row in rows:
            row.pop("stage_ms")
        drawn = {path.name: path.read_bytes() for path in pictures.iterdir()}
        messages, _, summary = result.stderr.partition("frames  ")
        assert summary.startswith("   38, 3 skipped")
        found[jobs] = (rows, messages, drawn)
    assert len(found[1][0]) == 38
    assert [row["index"] for row in found[1][0]] == sorted(row["index"] for row in found[1][0])
    assert found[2] == found[1]
    assert found[5] == found[1]


@pytest.mark.parametrize("jobs", ["0", "x"])
def test_jobs_must_be_a_count(tmp_path, jobs):
    assert "--jobs" in run("detect", save(tmp_path / "a.png", mask()), "--jobs", jobs, code=2).stderr


def test_masks_of_other_sizes_in_one_batch(tmp_path):
    sizes = [(60 + 10 * (number % 4), 90 + 20 * (number % 3)) for number in range(16)]
    for number, size in enumerate(sizes):
        save(tmp_path / f"{number}.png", mask(30, size))
    rows = [json.loads(line) for line in run("detect", tmp_path, "-j", 3).stdout.splitlines()]
    assert [tuple(row["size"]) for row in rows] == sizes
    assert all(len(row["detections"]) == 1 for row in rows)
