"""Videos, cameras and streams: stamps, failures in the middle, ends that come too early."""

from __future__ import annotations

import logging
import time

import cv2
import numpy as np
import pytest
import videos

from dloftbs import sources
from dloftbs.errors import InputError, SourceError
from dloftbs.sources import video

COUNT = 20


def write_video(path, code="mp4v", count=COUNT):
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*code), 20.0, (96, 64))
    assert writer.isOpened()
    rng = np.random.default_rng(0)
    for number in range(count):
        pixels = rng.integers(0, 40, (64, 96, 3), dtype=np.uint8)
        cv2.circle(pixels, (10 + 4 * number, 32), 8, (255, 255, 255), -1)
        writer.write(pixels)
    writer.release()
    return path


def centre_x(frame) -> float:
    return float(np.nonzero(frame.image[32, :, 1] > 128)[0].mean())


class FakeCapture:
    """Plays a list, None standing for a failed read, and fails when it is through."""

    def __init__(self, opened, reads, fps=0.0, count=0.0):
        self.reads, self.at, self.released = reads, 0, False
        self.values = {cv2.CAP_PROP_FPS: fps, cv2.CAP_PROP_FRAME_COUNT: count}
        opened.append(self)

    def isOpened(self):
        return self.reads is not None

    def read(self):
        assert not self.released
        pixels = self.reads[self.at] if self.at < len(self.reads) else None
        self.at += 1
        return pixels is not None, pixels

    def get(self, key):
        if key == cv2.CAP_PROP_POS_MSEC:
            return 1000.0 * (self.at - 1) / self.values[cv2.CAP_PROP_FPS]
        return self.values.get(key, 0.0)

    def release(self):
        self.released = True


@pytest.fixture
def fake(monkeypatch):
    """Have cv2 open fakes with the given arguments; return those that were opened."""

    def install(*args, **kwargs):
        opened = []
        monkeypatch.setattr(cv2, "VideoCapture", lambda where: FakeCapture(opened, *args, **kwargs))
        monkeypatch.setattr(video, "RETRY_S", 0.0)
        return opened

    return install


def pictures(text: str):
    """One picture per character; a dot is a failed read."""
    return [None if c == "." else np.full((4, 6, 3), 50, np.uint8) for c in text]


def test_streams_that_are_read_together_have_one_clock(fake, monkeypatch):
    clock = iter([10.0, 12.5, 13.0, 13.01])  # two openings, then a picture of each
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    fake(pictures("a"))
    left, right = sources.open(0), sources.open(1)
    right.opened_s = left.opened_s
    assert next(iter(right)).stamp - next(iter(left)).stamp == pytest.approx(-0.01)


@pytest.mark.parametrize(("said", "fps"), [(30.0, 30.0), (90000.0, None), (0.0, None), (float("nan"), None)])
def test_the_tick_of_a_clock_is_no_rate(fake, said, fps):
    fake(pictures("a"), fps=said)
    assert sources.open(0).fps == fps


@pytest.mark.parametrize("password", ["secret", "p@ss", "a:b@c"])
def test_a_password_stands_in_no_name(fake, password):
    fake(pictures("a"))
    name = sources.open(f"rtsp://admin:{password}@10.0.0.1/stream").name
    assert name == "rtsp://***@10.0.0.1/stream"


def test_video(tmp_path):
    path = write_video(tmp_path / "видео 1.mp4")
    with sources.open(path) as source:
        assert (source.name, source.fps, source.length) == (str(path), 20.0, COUNT)
        frames = list(source)
        assert source.skipped == 0
    assert [frame.index for frame in frames] == list(range(COUNT))
    assert [frame.name for frame in frames[:2]] == ["видео 1.mp4#0", "видео 1.mp4#1"]
    np.testing.assert_allclose([frame.stamp for frame in frames], np.arange(COUNT) / 20, atol=1e-6)
    np.testing.assert_allclose([centre_x(frame) for frame in frames], 10 + 4 * np.arange(COUNT), atol=1.5)


def test_video_can_be_read_again(tmp_path):
    with sources.open(write_video(tmp_path / "a.mp4")) as source:
        next(iter(source))
        first, second = list(source), list(source)
    assert len(first) == len(second) == COUNT
    np.testing.assert_array_equal(first[5].image, second[5].image)


def test_fps_replaces_the_container_times(tmp_path):
    with sources.open(write_video(tmp_path / "a.mp4"), fps=10) as source:
        assert source.fps == 10
        np.testing.assert_allclose([frame.stamp for frame in source], np.arange(COUNT) / 10)


def test_video_of_masks(tmp_path):
    path = write_video(tmp_path / "a.mp4")
    with sources.open(path, kind="mask") as source:
        frame = next(iter(source))
    assert frame.image is None
    assert 150 < (frame.mask != 0).sum() < 260  # a disc of radius 8, not the noise around it


def test_black_frame_is_no_mask(tmp_path):
    path = videos.write(tmp_path / "a.mp4", pictures=[np.zeros((64, 96, 3), np.uint8)])
    with sources.open(path) as source:
        assert next(iter(source)).image is not None


def test_cut_off_mp4_is_refused(tmp_path):
    path = write_video(tmp_path / "a.mp4")
    path.write_bytes(path.read_bytes()[:-300])  # the index is at the end
    with pytest.raises(SourceError, match=r"a\.mp4: cannot be opened.*cut off"):
        sources.open(path)


def test_mp4_whose_data_end_early_is_reported(tmp_path, caplog):
    path = write_video(tmp_path / "a.mp4")
    data = bytearray(path.read_bytes())
    half = len(data) // 2
    data[half:-2000] = bytes(len(data) - 2000 - half)  # the index stays
    path.write_bytes(data)
    with sources.open(path) as source:
        read = len(list(source))
        assert 0 < read < COUNT
        assert source.skipped == COUNT - read
    assert f"a.mp4: read {read} frames of the {COUNT}" in caplog.text


def test_cut_off_avi_is_reported(tmp_path, caplog):
    path = write_video(tmp_path / "a.avi", "MJPG")
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with sources.open(path) as source:
        read = len(list(source))
        assert 0 < read < COUNT
        assert read + source.skipped == source.length == COUNT
    assert f"read {read} frames of the {COUNT}" in caplog.text


def test_damage_in_the_middle_leaves_a_hole(tmp_path, caplog):
    path = write_video(tmp_path / "a.mp4", count=40)
    data = bytearray(path.read_bytes())
    start, stop = int(0.4 * len(data)), int(0.6 * len(data))
    data[start:stop] = bytes(stop - start)
    path.write_bytes(data)
    with sources.open(path) as source:
        frames = list(source)
        assert source.skipped == 40 - len(frames) > 0
    assert frames[-1].index == 39
    np.testing.assert_allclose([frame.stamp for frame in frames], [frame.index / 20 for frame in frames], atol=1e-6)
    assert "cannot be decoded" in caplog.text


def test_not_a_video(tmp_path):
    path = tmp_path / "a.mp4"
    path.write_text("a letter, not a film")
    with pytest.raises(SourceError, match=r"a\.mp4: cannot be opened as a video"):
        sources.open(path)


@pytest.mark.parametrize("where", [0, "0", np.int64(0)])
def test_camera(fake, where):
    opened = fake(pictures("xx"), fps=30.0)
    before = time.monotonic()
    source = sources.open(where)
    assert (source.name, source.fps, source.length) == ("camera 0", 30.0, None)
    frames = list(source)
    assert [(frame.index, frame.name) for frame in frames] == [(0, "camera 0#0"), (1, "camera 0#1")]
    assert 0.0 <= frames[0].stamp <= frames[1].stamp <= time.monotonic() - before
    assert opened[0].released
    assert source.single_pass
    with pytest.raises(SourceError, match="only once"):
        iter(source)


def test_camera_goes_on_after_failures(fake, monkeypatch, caplog):
    monkeypatch.setattr(video, "MAX_FAILURES", 4)
    opened = fake(pictures("x...x....x"))
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(1) as source:
        assert [frame.index for frame in source] == [0, 4]
        assert source.skipped == 3
    assert "frames 1 to 3 of camera 1" in caplog.text
    assert "camera 1 ended: 4 reads in a row failed" in caplog.text
    assert opened[0].released


def test_camera_closed_by_its_user(fake, caplog):
    opened = fake(pictures("xxx"))
    source = sources.open(0)
    frames = iter(source)
    next(frames)
    source.close()
    assert opened[0].released
    assert list(frames) == []
    assert not caplog.records


def test_address_keeps_its_password(fake):
    fake(pictures("x"))
    with sources.open("rtsp://me:secret@10.0.0.1/live") as source:
        assert source.name == "rtsp://***@10.0.0.1/live"
        assert "secret" not in next(iter(source)).name


@pytest.mark.parametrize(
    ("where", "count", "length"),
    [("http://host/a.mp4", 3.0, 3), ("http://host/a.mjpg", -1.0, None), ("rtsp://host/a", 3.0, None), (0, 3.0, None)],
)
def test_a_file_at_an_address_has_a_length_and_a_stream_has_none(fake, where, count, length):
    fake(pictures("xyz"), fps=30.0, count=count)
    source = sources.open(where)
    assert (source.length, source.exact_length) == (length, None)
    assert (source.live, source.single_pass) == (not str(where).startswith("http"), True)


def test_a_recording_at_an_address_has_its_own_times_and_a_quiet_end(fake, caplog):
    fake(pictures("xyz"), fps=10.0, count=3.0)
    with sources.open("http://host/a.mp4") as source:
        assert [frame.stamp for frame in source] == pytest.approx([0.0, 0.1, 0.2])
    with sources.open("http://host/a.mp4", fps=4) as source:
        assert (source.fps, [frame.stamp for frame in source]) == (4, [0.0, 0.25, 0.5])
    assert not caplog.records
    fake(pictures("xyz"), fps=10.0, count=9.0)
    with sources.open("http://host/a.mp4") as source:
        assert len(list(source)) == 3
    (record,) = caplog.records
    assert record.getMessage() == "http://host/a.mp4 ended after 3 frames, and states about 9"


def test_a_stream_at_an_address_takes_no_rate(fake):
    opened = fake(pictures("xyz"), count=-1.0)
    with pytest.raises(InputError, match="fps cannot go with a camera or a stream"):
        sources.open("http://host/a.mjpg", fps=10)
    assert opened[0].released


def test_an_address_of_this_machine_is_its_file(tmp_path):
    path = write_video(tmp_path / "a b.mp4")
    for address in (path.as_uri(), f"file://localhost{path}"):
        with sources.open(address, fps=10) as source:
            assert isinstance(source, sources.VideoSource)
            assert (source.name, next(iter(source)).stamp) == (str(path), 0.0)


def test_what_cannot_be_opened(fake):
    opened = fake(None)
    with pytest.raises(SourceError, match="camera 7 cannot be opened"):
        sources.open(7)
    with pytest.raises(SourceError, match=r"//\*\*\*@host/x cannot be opened"):
        sources.open("http://a:b@host/x")
    assert all(capture.released for capture in opened)


def test_live_takes_no_files_beside(fake):
    opened = fake(pictures("x"))
    with pytest.raises(InputError, match="depth and mask cannot go with a camera"):
        sources.open(0, depth="d", masks="m")
    with pytest.raises(InputError, match="fps cannot go with a camera"):
        sources.open("rtsp://host", fps=10)
    assert not opened
