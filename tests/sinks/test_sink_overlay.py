from __future__ import annotations

import logging
from dataclasses import replace

import av
import cv2
import numpy as np
import pytest
import sinks.sink_examples as examples

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SinkError
from dloftbs.sinks import OverlayImagesSink, OverlayVideoSink, _mp4, overlay_pictures

VIDEOS = ["a.mp4", "a.mov", "A.MP4"]


def read(path):
    capture = cv2.VideoCapture(str(path))
    count, fps = capture.get(cv2.CAP_PROP_FRAME_COUNT), capture.get(cv2.CAP_PROP_FPS)
    pictures = []
    while True:
        there, picture = capture.read()
        if not there:
            break
        pictures.append(picture)
    assert len(pictures) == count
    return pictures, fps


@pytest.mark.parametrize("name", VIDEOS)
def test_a_video_comes_back(tmp_path, name):
    path = tmp_path / "neu ł 電" / name
    with OverlayVideoSink(path, fps=12.5, draw=examples.draw) as sink:
        for i in range(10):
            sink.write(examples.frame(i), examples.detected(i))
    pictures, fps = read(path)
    assert fps == pytest.approx(12.5, rel=1e-3)
    assert [round(float(picture.mean())) for picture in pictures] == pytest.approx(
        [40 + 3 * i for i in range(10)], abs=5
    )


@pytest.mark.parametrize("name", VIDEOS[:2])
def test_the_first_size_holds_and_others_get_bars(tmp_path, name, caplog):
    with OverlayVideoSink(tmp_path / name, draw=examples.draw) as sink:
        for size in ((48, 64), (96, 128), (48, 32), (10, 100), (48, 64)):
            sink.write(Frame(image=np.full((*size, 3), 200, np.uint8)), examples.nothing())
    pictures, _ = read(tmp_path / name)
    assert {picture.shape for picture in pictures} == {(48, 64, 3)}
    left, middle = pictures[2][:, :12], pictures[2][:, 24:40]
    assert left.max() < 30
    assert middle.min() > 170
    assert pictures[1].min() > 170
    assert pictures[3][:16].max() < 30
    warnings = [record for record in caplog.records if record.levelno == logging.WARNING]
    assert len(warnings) == 1


@pytest.mark.parametrize("name", VIDEOS[:2])
def test_odd_sizes(tmp_path, name):
    with OverlayVideoSink(tmp_path / name, draw=examples.draw) as sink:
        for i in range(3):
            sink.write(examples.frame(i, (47, 63)), examples.nothing())
    pictures, _ = read(tmp_path / name)
    assert pictures[2][:46, :62].mean() == pytest.approx(46, abs=4)


@pytest.mark.parametrize("name", VIDEOS[:2])
def test_without_frames_there_is_no_file(tmp_path, name):
    with OverlayVideoSink(tmp_path / name):
        pass
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("fps", [0, -1.0, float("nan"), float("inf"), "30"])
def test_fps_out_of_range(tmp_path, fps):
    with pytest.raises(InputError, match="fps"):
        OverlayVideoSink(tmp_path / "a.mp4", fps=fps)


def times(path):
    """Return when each picture of a video is shown, seconds."""
    with av.open(str(path)) as video:
        return [float(picture.time) for picture in video.decode(video=0)]


@pytest.mark.parametrize("name", VIDEOS[:2])
def test_a_video_without_a_rate_shows_its_pictures_at_their_stamps(tmp_path, name):
    stamps = [5.0, 5.05, 5.25, 6.0, 6.000001, 8.5]
    with OverlayVideoSink(tmp_path / name, fps=None, draw=examples.draw) as sink:
        for i, stamp in enumerate(stamps):
            sink.write(replace(examples.frame(i), stamp=stamp), examples.nothing())
    assert times(tmp_path / name) == pytest.approx([stamp - 5.0 for stamp in stamps], abs=1e-4)


def test_a_stamp_that_is_missing_or_does_not_rise_is_a_step_after_the_one_before(tmp_path):
    with OverlayVideoSink(tmp_path / "a.mp4", fps=None, draw=examples.draw) as sink:
        for i, stamp in enumerate([None, 7.0, 7.0, 3.0, 3.5, None, 9.0, 9.1]):
            sink.write(replace(examples.frame(i), stamp=stamp), examples.nothing())
    since = [1 / 30, 1 / 30, 1 / 30, 0.5, 1 / 30, 1 / 30, 0.1]
    assert np.diff(times(tmp_path / "a.mp4")) == pytest.approx(since, abs=1e-4)


@pytest.mark.parametrize("name", VIDEOS[:2])
def test_a_picture_that_cannot_be_encoded_leaves_the_older_video(tmp_path, name):
    (tmp_path / name).write_bytes(b"precious")
    sink = OverlayVideoSink(tmp_path / name, draw=lambda frame, result: np.zeros((2, 40_000, 3), np.uint8))
    with pytest.raises(SinkError, match="cannot write"), sink:
        sink.write(examples.frame(), examples.nothing())
    assert (tmp_path / name).read_bytes() == b"precious"


def test_without_the_encoder_the_older_video_stays(tmp_path, monkeypatch):
    monkeypatch.setattr(_mp4, "CODEC", "libx264_of_nobody")
    (tmp_path / "a.mp4").write_bytes(b"precious")
    with (
        pytest.raises(SinkError, match="has no encoder libx264_of_nobody"),
        OverlayVideoSink(tmp_path / "a.mp4") as sink,
    ):
        sink.write(examples.frame(), examples.nothing())
    assert (tmp_path / "a.mp4").read_bytes() == b"precious"


def test_suffixes_that_no_video_or_picture_has(tmp_path):
    with pytest.raises(InputError, match=r"\.mp4"):
        OverlayVideoSink(tmp_path / "a.gif")
    with pytest.raises(InputError, match=r"\.png"):
        OverlayImagesSink(tmp_path, suffix="gif")


@pytest.mark.parametrize("kind", [OverlayVideoSink, OverlayImagesSink])
@pytest.mark.parametrize("picture", [np.zeros((4, 4), np.uint8), np.zeros((4, 4, 3)), None])
def test_a_draw_that_returns_no_picture(tmp_path, kind, picture):
    with kind(tmp_path / "a.mp4", draw=lambda frame, result: picture) as sink, pytest.raises(InputError, match="image"):
        sink.write(examples.frame(), examples.nothing())


def test_pictures_are_named_after_their_frames_and_never_replace_each_other(tmp_path):
    names = ["left/a.png", "right/a.png", "A.jpg", "a_1.png", "", "", "cam: 1?.png", "..", "Kabel ł 電.png"]
    names += ["cable.mp4#12", "#3", "a#b.png"]
    with OverlayImagesSink(tmp_path / "new" / "folder", draw=examples.draw) as sink:
        for i, name in enumerate(names):
            sink.write(examples.frame(i, name=name), examples.nothing())
    found = {path.stem: path for path in sink.path.iterdir()}
    wanted = ["a", "a_1", "A_2", "a_1_1", "000004", "000005", "cam_ 1_", "000007", "Kabel ł 電"]
    wanted += ["cable_000012", "_000003", "a#b"]
    assert set(found) == set(wanted)
    for i, stem in enumerate(wanted):
        picture = cv2.imdecode(np.fromfile(found[stem], np.uint8), cv2.IMREAD_COLOR)
        assert picture.mean() == 40 + 3 * i


@pytest.mark.parametrize("suffix", overlay_pictures.IMAGE_SUFFIXES)
def test_formats_of_pictures(tmp_path, suffix):
    with OverlayImagesSink(tmp_path, draw=examples.draw, suffix=suffix) as sink:
        sink.write(examples.frame(2), examples.nothing())
    assert cv2.imread(str(tmp_path / f"000002{suffix}")).mean() == pytest.approx(46, abs=2)


def test_the_default_draws(tmp_path):
    with OverlayImagesSink(tmp_path) as sink:
        sink.write(examples.frame(), examples.detected())
    picture = cv2.imread(str(tmp_path / "000000.png"))
    assert picture.shape == (48, 64, 3)
    assert picture.std() > 0
