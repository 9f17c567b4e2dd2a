"""Containers, codecs, times and pixel formats of video files, and what is wrong with damaged ones."""

from __future__ import annotations

import logging
import os
import shutil
import sys
from fractions import Fraction
from pathlib import Path
from threading import Thread
from time import sleep

import av
import cv2
import numpy as np
import pytest
import videos
from videos import COLUMNS, COUNT, RATE, ROWS

from dloftbs import sources
from dloftbs.errors import SourceError
from dloftbs.sources import video_file

PAUSES = [number / RATE + 7.0 * (number >= 10) + 6.0 * (number >= 30) for number in range(COUNT)]
"""Times of a recording that is paused twice."""


def read(path, caplog, **options):
    """Return the frames of a file of which nothing is reported."""
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(path, **options) as source:
        frames = list(source)
        assert source.skipped == 0
    assert [record.getMessage() for record in caplog.records] == []
    assert [frame.index for frame in frames] == list(range(len(frames)))
    return frames


def stamps(frames):
    return [frame.stamp for frame in frames]


WRITERS = {
    "a.mp4": lambda path, **options: videos.write(path, between=2, **options),
    "a.mkv": videos.write,
    "a.webm": videos.write_vp9,
    "av1.mp4": videos.write_av1,
    "av1.mkv": videos.write_av1,
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_recording_with_pauses_is_whole(tmp_path, caplog, name):
    frames = read(WRITERS[name](tmp_path / name, times=PAUSES), caplog)
    assert stamps(frames) == pytest.approx(PAUSES, abs=2e-3)
    assert [videos.number_in(frame.image) for frame in frames[:20]] == list(range(20))


@pytest.mark.parametrize("name", ["a.mp4", "a.mkv", "a.ts"])
def test_times_count_from_the_first_frame(tmp_path, caplog, name):
    times = [5.0 + number / RATE for number in range(COUNT)]
    container = "mpegts" if name == "a.ts" else None
    frames = read(videos.write(tmp_path / name, times=times, between=2, container=container), caplog)
    assert stamps(frames) == pytest.approx([time - 5.0 for time in times], abs=2e-3)


def test_an_mp4_that_was_trimmed_without_encoding_gives_what_it_shows(tmp_path, caplog):
    whole = videos.write(tmp_path / "a.mp4", between=2)
    frames = read(videos.trim(whole, tmp_path / "b.mp4", first=5, count=12), caplog)
    assert [videos.number_in(frame.image) for frame in frames] == list(range(5, 17))
    assert stamps(frames) == pytest.approx([number / RATE for number in range(12)], abs=1e-6)


def test_different_pictures_that_share_a_time_come_at_the_rate(tmp_path, caplog):
    times = [number / 1000 for number in range(4) for _ in range(3)]
    path = videos.write(tmp_path / "a.mkv", "ffv1", count=12, times=times, pixel_format="bgr0")
    with sources.open(path) as source:
        found = stamps(source)
        step_s = 1 / source.fps
    assert np.diff(found) == pytest.approx(np.full(11, step_s), abs=1e-3)
    assert min(np.diff(found)) > 1e-5
    (record,) = caplog.records
    assert "frame 1 differs from the one before it and has the same time, 0 s" in record.getMessage()


def test_repeated_pictures_share_a_time(tmp_path, caplog):
    times = [number / 1000 for number in range(4) for _ in range(2)]
    pictures = [videos.picture(number) for number in range(4) for _ in range(2)]
    path = videos.write(tmp_path / "a.mkv", "ffv1", pictures=pictures, times=times, pixel_format="bgr0")
    assert stamps(read(path, caplog)) == pytest.approx(times)


def test_joined_recordings_go_on_in_time(tmp_path, caplog):
    data = videos.write(tmp_path / "a.ts", container="mpegts", between=2).read_bytes()
    (tmp_path / "b.ts").write_bytes(data + data)
    frames = read(tmp_path / "b.ts", caplog)
    assert stamps(frames) == pytest.approx([number / RATE for number in range(2 * COUNT)], abs=2e-3)


def test_a_recording_that_begins_between_key_frames_gives_what_decodes(tmp_path, caplog):
    data = videos.write(tmp_path / "a.ts", container="mpegts").read_bytes()
    first = len(data) // 188 * 3 // 10
    (tmp_path / "b.ts").write_bytes(data[188 * first :])
    frames = read(tmp_path / "b.ts", caplog)
    assert 0 < len(frames) < COUNT
    assert np.diff(stamps(frames)) == pytest.approx(1 / RATE, abs=2e-3)


def test_frames_that_an_avi_leaves_out_are_a_pause(tmp_path, caplog):
    times = [number / RATE + 0.5 * (number >= 10) for number in range(20)]
    path = videos.write(tmp_path / "a.avi", "mpeg4", count=20, times=times, unit_s=Fraction(1, RATE))
    assert stamps(read(path, caplog)) == pytest.approx(times)


def test_a_stream_without_times_has_those_of_its_rate(tmp_path, caplog):
    frames = read(videos.write(tmp_path / "a.h264", container="h264"), caplog)
    assert stamps(frames) == pytest.approx([number / 25 for number in range(COUNT)])  # FFmpeg's rate for such streams


def test_an_animated_avif_is_a_stream_and_a_still_one_an_image(tmp_path, caplog):
    Image = pytest.importorskip("PIL.Image")
    shown = [Image.fromarray(videos.picture(number)[..., ::-1]) for number in range(5)]
    for mode in ("RGB", "RGBA"):  # the alpha channel is a stream of its own
        first, *others = (image.convert(mode) for image in shown)
        first.save(tmp_path / "a.avif", save_all=True, append_images=others, duration=[40, 60, 100, 40, 20])
        frames = read(tmp_path / "a.avif", caplog)
        assert stamps(frames) == pytest.approx([0.0, 0.04, 0.1, 0.2, 0.24])
        assert [videos.number_in(frame.image) for frame in frames] == list(range(5))
    shown[3].save(tmp_path / "b.avif", quality=95)
    (frame,) = read(tmp_path / "b.avif", caplog)
    assert np.abs(frame.image.astype(int) - videos.picture(3)).mean() < 12
    disc = cv2.circle(np.zeros((64, 96), np.uint8), (40, 30), 12, 255, -1)
    Image.fromarray(disc).save(tmp_path / "c.avif")
    (frame,) = read(tmp_path / "c.avif", caplog)
    assert frame.image is None
    assert (frame.mask != (disc > 0)).mean() < 0.01
    (tmp_path / "d.avif").write_bytes((tmp_path / "b.avif").read_bytes()[:-30])
    with sources.open(tmp_path / "d.avif") as source, pytest.raises(SourceError, match=r"d\.avif: cannot be decoded"):
        list(source)
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(f"{tmp_path}/[ac].avif") as source:
        assert [frame.name for frame in source] == ["a.avif", "c.avif"]
    assert "a.avif: only the first of its frames is read" in caplog.text


FORMATS = [
    ("a.mov", "libx264", "yuv444p", 3),
    ("a.mov", "libx264", "yuv422p", 3),
    ("a.mov", "libx264", "yuv420p10le", 3),
    ("a.mov", "libx265", "yuv444p12le", 3),
    ("a.mov", "libx264rgb", "rgb24", 3),
    ("a.mov", "png", "rgb24", 0),
    ("a.mov", "png", "rgba", 0),
    ("a.mkv", "ffv1", "gray", 1),
    ("a.mkv", "ffv1", "gray16le", 1),
    ("a.mkv", "ffv1", "bgr0", 0),
    ("a.webm", "libvpx-vp9", "yuva420p", 4),
]


LOSSLESS = {
    "libx264": {"qp": "0"},
    "libx264rgb": {"qp": "0"},
    "libx265": {"x265-params": "lossless=1:log-level=none"},
    "libvpx-vp9": {"lossless": "1"},
}


@pytest.mark.parametrize(("name", "codec", "pixel_format", "most"), FORMATS)
@pytest.mark.parametrize("odd", [0, 1])
def test_pixels_of_any_format_come_as_bgr(tmp_path, caplog, name, codec, pixel_format, most, odd):
    if odd and ("420" in pixel_format or "422" in pixel_format):
        pytest.skip("the encoders take even sizes alone")
    rows, columns = ROWS - odd, COLUMNS - odd
    ramp = np.linspace(20, 220, columns).astype(np.uint8)[None, :].repeat(rows, 0)
    shown = np.dstack([ramp, ramp, ramp] if "gray" in pixel_format else [ramp, 255 - ramp, ramp // 2 + 60])
    options = LOSSLESS.get(codec)
    path = videos.write(tmp_path / name, codec, pictures=[shown] * 3, pixel_format=pixel_format, codec_options=options)
    for frame in read(path, caplog):
        assert frame.image.shape == shown.shape
        assert frame.image.flags.c_contiguous
        assert np.abs(frame.image.astype(int) - shown)[2:-2, 2:-2].mean() <= most


MATRICES = {1: (0.2126, 0.0722), 6: (0.299, 0.114), 9: (0.2627, 0.0593)}
"""Shares of red and blue in the luminance: BT.709, BT.601, BT.2020, by FFmpeg's numbers."""


@pytest.mark.parametrize("matrix", MATRICES)
@pytest.mark.parametrize("full", [False, True])
def test_matrix_and_range_are_the_streams(tmp_path, matrix, full):
    blue, green, red = np.array([30, 60, 200]) / 255
    of_red, of_blue = MATRICES[matrix]
    luma = of_red * red + (1 - of_red - of_blue) * green + of_blue * blue
    chroma = [(blue - luma) / (2 - 2 * of_blue), (red - luma) / (2 - 2 * of_red)]
    scales = [(255, 0), (255, 128), (255, 128)] if full else [(219, 16), (224, 128), (224, 128)]
    counts = [round(k * value + zero) for (k, zero), value in zip(scales, [luma, *chroma], strict=True)]
    frame = av.VideoFrame(96, 64, "yuv420p")
    for plane, value in zip(frame.planes, counts, strict=True):
        plane.update(bytes([value]) * plane.buffer_size)
    frame.colorspace, frame.color_range = matrix, 2 if full else 1
    with av.open(str(tmp_path / "a.mkv"), "w") as output:
        stream = output.add_stream("ffv1", rate=RATE)
        stream.width, stream.height, stream.pix_fmt = 96, 64, "yuv420p"
        stream.codec_context.colorspace, stream.codec_context.color_range = matrix, 2 if full else 1
        output.mux(stream.encode(frame))
        output.mux(stream.encode())
    with sources.open(tmp_path / "a.mkv") as source:
        (frame,) = source
    assert np.abs(frame.image[32, 48].astype(int) - [30, 60, 200]).max() <= 3


@pytest.mark.parametrize("turn", [0, 90, 180, 270])
@pytest.mark.parametrize("mirror", [False, True])
def test_pictures_are_turned_as_they_are_shown(tmp_path, caplog, turn, mirror):
    if not hasattr(av.VideoStream, "set_display_rotation"):
        pytest.skip("this PyAV writes no rotation")
    shown = np.full((64, 96, 3), 30, np.uint8)
    shown[5:25, 10:30] = (220, 40, 40)
    shown[5:15, 60:90] = (40, 220, 40)
    path = videos.write(tmp_path / "a.mp4", pictures=[shown] * 3, rotation=turn or 360)
    expected = np.rot90(shown, turn // 90)
    if mirror:  # from left to right, in the file's matrix: its first column, of x
        data = bytearray(path.read_bytes())
        at = data.index(b"tkhd") + 4 + 40
        matrix = np.frombuffer(data, ">i4", 9, at).reshape(3, 3).copy()
        matrix[:, 0] *= -1
        data[at : at + 36] = matrix.tobytes()
        path.write_bytes(data)
        expected = expected[:, ::-1]
    frames = read(path, caplog)
    assert len(frames) == 3
    assert frames[0].image.shape == expected.shape
    assert np.abs(frames[0].image.astype(int) - expected).mean() < 15


def test_one_of_several_streams_is_read_and_it_is_said(tmp_path, caplog):
    with av.open(str(tmp_path / "a.mkv"), "w") as output:
        streams = [output.add_stream("libx264", rate=RATE) for _ in range(2)]
        for stream, size in zip(streams, [(96, 64), (64, 48)], strict=True):
            (stream.width, stream.height), stream.pix_fmt = size, "yuv420p"
        for number in range(10):
            for stream in streams:
                output.mux(stream.encode(videos.as_frame(videos.picture(number, stream.height, stream.width))))
        for stream in streams:
            output.mux(stream.encode())
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(tmp_path / "a.mkv") as source:
        assert [frame.size for frame in source] == [(64, 96)] * 10
        assert source.skipped == 0
    assert "a.mkv: of its streams 0 (96 x 64) is read, and not 1 (64 x 48); to read another" in caplog.text


@pytest.mark.parametrize("disposition", [1 << 10, 0])
def test_a_cover_picture_is_not_the_video(tmp_path, disposition):
    path = tmp_path / ("a.mp4" if disposition else "a.mkv")
    with av.open(str(path), "w") as output:
        cover, stream = output.add_stream("mjpeg", rate=1), output.add_stream("libx264", rate=RATE)
        cover.width, cover.height, cover.pix_fmt = 32, 32, "yuvj420p"
        stream.width, stream.height, stream.pix_fmt = 96, 64, "yuv420p"
        if disposition:
            cover.disposition = disposition
        output.mux(cover.encode(videos.as_frame(np.full((32, 32, 3), 200, np.uint8)).reformat(format="yuvj420p")))
        output.mux(cover.encode())
        for number in range(10):
            output.mux(stream.encode(videos.as_frame(videos.picture(number))))
        output.mux(stream.encode())
    with sources.open(path) as source:
        assert [videos.number_in(frame.image) for frame in source] == list(range(10))


def test_sound_alone_is_refused(tmp_path):
    with av.open(str(tmp_path / "a.mp4"), "w") as output:
        stream = output.add_stream("aac", rate=16000)
        sound = av.AudioFrame.from_ndarray(np.zeros((1, 16000), np.float32), format="fltp", layout="mono")
        sound.sample_rate = 16000
        output.mux(stream.encode(sound))
        output.mux(stream.encode())
    with pytest.raises(SourceError, match=r"a\.mp4: has no moving pictures; it holds audio"):
        sources.open(tmp_path / "a.mp4")


def test_a_container_without_frames_is_refused_or_reported(tmp_path, caplog):
    for name in ("a.mp4", "a.mkv", "a.avi"):
        with av.open(str(tmp_path / name), "w") as output:
            stream = output.add_stream("mpeg4", rate=RATE)
            stream.width, stream.height, stream.pix_fmt = 96, 64, "yuv420p"
            output.start_encoding()
        try:
            with sources.open(tmp_path / name) as source:
                assert list(source) == []
                assert source.skipped == 1
        except SourceError as error:
            assert name in str(error)  # noqa: PT017 - some containers open without frames, others do not


def test_frames_may_change_their_size(tmp_path, caplog):
    small = videos.write(tmp_path / "a.ts", container="mpegts", count=10)
    large = videos.write(
        tmp_path / "b.ts", container="mpegts", pictures=[videos.picture(number, 128, 160) for number in range(10)]
    )
    (tmp_path / "c.ts").write_bytes(small.read_bytes() + large.read_bytes())
    assert [frame.size for frame in read(tmp_path / "c.ts", caplog)] == [(64, 96)] * 10 + [(128, 160)] * 10


@pytest.mark.skipif(sys.platform != "linux", reason="other file systems forbid such names")
@pytest.mark.parametrize("name", [b"concat:a.mp4", b"http:b.mp4", b"a%03d.mp4", "видео.mp4".encode(), b"\xff\xe4.mp4"])
def test_a_file_may_have_any_name(tmp_path, caplog, name):
    path = os.path.join(os.fsencode(tmp_path), name)
    os.rename(videos.write(tmp_path / "plain.mp4"), path)
    frames = read(os.fsdecode(path), caplog)
    assert len(frames) == COUNT


@pytest.mark.skipif(not hasattr(os, "sched_getscheduler"), reason="only Linux has it")
def test_a_test_that_encodes_leaves_the_priority_of_the_process_as_it_was(tmp_path):
    before = os.sched_getscheduler(0)
    videos.write_av1(tmp_path / "a.mkv")
    assert os.sched_getscheduler(0) == before == os.SCHED_OTHER


CONTAINERS = {
    "index first": ("a.mp4", {"options": {"movflags": "faststart"}}),
    "fragments": ("a.mp4", {"options": {"movflags": "frag_keyframe+empty_moov"}}),
    "matroska": ("a.mkv", {}),
    "webm": ("a.webm", {"codec": "libvpx-vp9", "codec_options": {"cpu-used": "8"}}),
    "avi": ("a.avi", {"codec": "mjpeg", "pixel_format": "yuvj420p", "unit_s": Fraction(1, RATE)}),
    "flash": ("a.flv", {"codec": "flv"}),
    "av1": ("a.mkv", {"codec": "libsvtav1", "codec_options": {"preset": "12"}}),
}


@pytest.mark.parametrize("kind", CONTAINERS)
@pytest.mark.parametrize("share", [0.6, 0.9])
def test_a_file_that_is_cut_off_is_reported(tmp_path, caplog, kind, share):
    name, options = CONTAINERS[kind]
    path = videos.cut(videos.write(tmp_path / name, **options), share)
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(path) as source:
        frames = list(source)
        assert 0 < len(frames) < COUNT
        assert source.skipped >= 1
    assert f"{name}: read {len(frames)} frames of the" in caplog.text
    assert "it is cut off" in caplog.text
    assert [videos.number_in(frame.image) for frame in frames[:20]] == list(range(min(len(frames), 20)))


@pytest.mark.parametrize("name", ["a.mp4", "a.mkv", "a.ts"])
def test_what_follows_the_last_part_is_no_damage(tmp_path, caplog, name):
    path = videos.write(tmp_path / name, container="mpegts" if name == "a.ts" else None)
    with path.open("ab") as file:
        file.write(bytes(100) + b"junk" * 25)
    assert len(read(path, caplog)) == COUNT


@pytest.mark.parametrize("kind", ["index first", "matroska", "webm", "av1"])
def test_damage_in_the_middle_is_reported(tmp_path, caplog, kind):
    name, options = CONTAINERS[kind]
    path = videos.blank(videos.write(tmp_path / name, **{**options, "count": 120}), 0.5, 1500)
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(path) as source:
        frames = list(source)
        assert source.skipped >= 1
    assert 60 < len(frames) < 120
    assert frames[-1].stamp == pytest.approx(119 / RATE, abs=2e-3)
    assert caplog.records


def flipped(path, seed):
    """Turn some bits of the pictures."""
    rng, data = np.random.default_rng(seed), bytearray(path.read_bytes())
    for at in rng.integers(len(data) // 8, len(data) * 7 // 8, 4):
        data[at] ^= 1 << int(rng.integers(8))
    path.write_bytes(data)
    return path


@pytest.fixture(scope="module")
def hundred_pictures(tmp_path_factory):
    """Return a recording so large that its decoder works in several threads."""
    pictures = [videos.picture(number, 360, 640) for number in range(100)]
    quick = {"preset": "veryfast"}
    return videos.write(tmp_path_factory.mktemp("whole") / "a.mp4", pictures=pictures, between=2, codec_options=quick)


@pytest.mark.parametrize("seed", range(6))
def test_lost_frames_leave_holes_where_they_were(tmp_path, hundred_pictures, seed):
    path = flipped(Path(shutil.copy(hundred_pictures, tmp_path)), seed)
    found = []
    for _ in range(2):
        with sources.open(path) as source:
            frames = list(source)
            assert len(frames) + source.skipped == 100
        # The index is that of the picture, as its time shows, whatever is lost before it.
        assert stamps(frames) == pytest.approx([frame.index / RATE for frame in frames], abs=1e-6)
        found.append([(frame.index, hash(frame.image.tobytes())) for frame in frames])
    assert found[1:] == found[:-1]


class FailingDisk:
    """A container of PyAV that cannot be read any more after some packets."""

    def __init__(self, container, after):
        self._container, self._after, self.reads = container, after, 0

    def __getattr__(self, name):
        return getattr(self._container, name)

    def demux(self, stream):
        for packet in self._container.demux(stream):
            self.reads += 1
            if self.reads > self._after:
                raise av.error.OSError(5, "Input/output error")
            yield packet


def test_patience_is_bounded(tmp_path, monkeypatch, caplog):
    path, opened, open_file = videos.write(tmp_path / "a.mp4"), [], av.open

    def failing(*args, **options):
        opened.append(FailingDisk(open_file(*args, **options), 10))
        return opened[-1]

    monkeypatch.setattr(av, "open", failing)
    monkeypatch.setattr(video_file, "MAX_FAILURES", 3)
    with sources.open(path) as source:
        assert [frame.index for frame in source] == list(range(10))
        assert source.skipped == COUNT - 10
    assert max(container.reads for container in opened) < 20
    assert "a.mp4: read 10 frames of the 40 that it should have; it is cut off" in caplog.text


def test_reading_lets_go_of_its_files(tmp_path):
    if not os.path.isdir("/proc/self/fd"):
        pytest.skip("needs /proc")
    path = videos.write(tmp_path / "a.mp4")
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(5):
        source = sources.open(path)
        frames = iter(source)
        next(frames)
        other = iter(source)
        next(other)
        source.close()
        assert list(frames) == list(other) == []
        with pytest.raises(SourceError, match="closed"):
            iter(source)
    assert len(os.listdir("/proc/self/fd")) == before


def test_a_file_is_closed_while_another_thread_reads(tmp_path):
    path = videos.write(tmp_path / "a.mp4", pictures=[videos.picture(number, 360, 640) for number in range(60)])
    for pause in (1, 5, 20):
        source = sources.open(path)
        counts = []

        def work(source=source, counts=counts):
            counts.extend(frame.index for frame in source)

        thread = Thread(target=work, daemon=True)
        thread.start()
        while len(counts) < pause and thread.is_alive():
            sleep(1e-4)  # so that the other thread need not wait for this one
        source.close()
        thread.join(20.0)
        assert not thread.is_alive()
        assert counts == list(range(len(counts)))


def test_the_length_is_an_estimate(tmp_path):
    with sources.open(videos.write(tmp_path / "a.mkv", times=PAUSES)) as source:
        assert source.length > COUNT  # the rate times the duration, pauses and all
        assert source.exact_length is None
        assert len(list(source)) == COUNT


def test_masks_of_16_bits_are_counts(tmp_path):
    labels = np.zeros((64, 96), np.uint16)
    labels[10:20, 10:80], labels[40:50, 10:80] = 1, 2
    frames = [av.VideoFrame.from_ndarray(np.roll(labels, shift, 0), format="gray16le") for shift in range(5)]
    path = videos.write(tmp_path / "a.mkv", "ffv1", pictures=frames, pixel_format="gray16le")
    with sources.open(path, kind="mask") as source:
        for shift, frame in enumerate(source):
            np.testing.assert_array_equal(frame.mask, np.roll(labels, shift, 0))


@pytest.mark.parametrize("pixel_format", ["gray", "bgr0"])
def test_masks_of_8_bits_keep_their_numbers_where_the_codec_loses_none(tmp_path, pixel_format):
    labels = np.zeros((64, 96), np.uint8)
    labels[10:20, 10:80], labels[40:50, 10:80] = 1, 2
    pictures = [np.dstack([np.roll(labels, shift, 0)] * 3) for shift in range(5)]
    path = videos.write(tmp_path / "a.mkv", "ffv1", pictures=pictures, pixel_format=pixel_format)
    for mask_is in ("auto", "labels"):
        with sources.open(path, kind="mask", mask_is=mask_is) as source:
            for shift, frame in enumerate(source):
                np.testing.assert_array_equal(frame.mask, np.roll(labels, shift, 0))
                assert (frame.instances is None) == (mask_is == "auto")


@pytest.mark.parametrize(("name", "codec"), [("a.mp4", "libx264"), ("a.mkv", "ffv1")])
def test_masks_of_a_video_in_yuv_are_what_is_said_of_them(tmp_path, name, codec):
    soft = np.zeros((64, 96, 3), np.uint8)
    soft[24:40, 10:80], soft[24:40, 40:60] = 255, 100
    path = videos.write(tmp_path / name, codec, pictures=[soft] * 5)
    with sources.open(path, kind="mask", mask_is="probability") as source:
        assert all(np.abs(frame.mask[28:36, 44:56].astype(int) - 100).max() <= 5 for frame in source)
    with sources.open(path, kind="mask") as source:
        assert all(not frame.mask[28:36, 44:56].any() and frame.mask[28:36, 14:36].all() for frame in source)
    refused = pytest.raises(SourceError, match=f"{name}: a lossy codec changes numbers: save labels as PNG")
    with sources.open(path, kind="mask", mask_is="labels") as source, refused:
        list(source)
