"""Depth, masks and occluders beside a video, whose frames are counted while they are read."""

from __future__ import annotations

import logging

import av
import numpy as np
import pytest
import videos
from videos import COUNT, RATE

from dloftbs import sources
from dloftbs.errors import SourceError

PAUSES = [number / RATE + 7.0 * (number >= 10) for number in range(COUNT)]


def mask_picture(number: int) -> np.ndarray:
    """A block that lies where that of the picture of the same number does."""
    return np.where(videos.picture(number) == 255, 255, 0).astype(np.uint8)


def paused(folder):
    """A WebM whose header lets more frames be expected than it has."""
    path = videos.write_vp9(folder / "pause.webm", times=PAUSES)
    with sources.open(path) as source:
        assert source.length > COUNT
    return path


def write_masks(path, count, **options):
    return videos.write(path, pictures=[mask_picture(number) for number in range(count)], **options)


def agree(frames):
    """Whether the mask of each frame is that of its picture."""
    return [bool(((frame.image[..., 1] > 128) == (frame.mask != 0)).mean() > 0.97) for frame in frames]


def test_a_stack_beside_a_recording_with_pauses(tmp_path, caplog):
    np.save(tmp_path / "m.npy", np.stack([mask_picture(number)[..., 0] for number in range(COUNT)]))
    with caplog.at_level(logging.WARNING), sources.open(paused(tmp_path), masks=tmp_path / "m.npy") as source:
        frames = list(source)
        assert source.skipped == 0
    assert agree(frames) == [True] * COUNT
    assert not caplog.records


@pytest.mark.parametrize("count", [COUNT - 3, COUNT + 5])
def test_a_stack_of_another_length_is_reported_when_all_frames_were_given(tmp_path, caplog, count):
    np.save(tmp_path / "m.npy", np.stack([mask_picture(number)[..., 0] for number in range(count)]))
    with sources.open(paused(tmp_path), masks=tmp_path / "m.npy", occluders=tmp_path / "m.npy") as source:
        frames = list(source)
        assert source.skipped == 2 * max(count - COUNT, 0)
    assert [frame.mask is None for frame in frames] == [number >= count for number in range(COUNT)]
    for what in ("mask", "occluders"):
        assert f"{what} must have as many frames as {source.name}, which has {COUNT}; got {count}" in caplog.text
        assert caplog.text.count(f"goes without {what}") == (count < COUNT)


def test_whoever_stops_early_hears_of_no_length(tmp_path, caplog):
    np.save(tmp_path / "m.npy", np.zeros((COUNT - 3, 64, 96), np.uint8))
    with sources.open(paused(tmp_path), masks=tmp_path / "m.npy") as source:
        for frame in source:
            if frame.index == 5:
                break
    assert not caplog.records


@pytest.mark.parametrize("what", ["masks", "occluders"])
def test_a_video_beside_a_video(tmp_path, caplog, what):
    path = write_masks(tmp_path / "m.mp4", COUNT, between=2)
    with caplog.at_level(logging.WARNING), sources.open(paused(tmp_path), **{what: path}) as source:
        frames, again = list(source), list(source)
        assert source.skipped == 0
    field = "mask" if what == "masks" else what
    for number, frame in enumerate(frames):
        assert ((getattr(frame, field) != 0) == (mask_picture(number)[..., 0] > 0)).mean() > 0.97
        np.testing.assert_array_equal(getattr(frame, field), getattr(again[number], field))
    assert not caplog.records


def test_a_video_beside_a_video_is_read_at_two_places(tmp_path):
    path = write_masks(tmp_path / "m.mp4", COUNT)
    with sources.open(paused(tmp_path), masks=path) as source:
        first, second = iter(source), iter(source)
        ahead = [next(first) for _ in range(15)]
        turns = [frame for _ in range(10) for frame in (next(first), next(second))]
    assert agree(ahead + turns) == [True] * 35


@pytest.mark.parametrize("count", [COUNT - 3, COUNT + 5])
def test_a_video_of_another_length_is_reported_at_the_end(tmp_path, caplog, count):
    path = write_masks(tmp_path / "m.mkv", count)
    with sources.open(paused(tmp_path), masks=path) as source:
        frames = list(source)
        assert source.skipped == max(count - COUNT, 0)
    assert [frame.mask is None for frame in frames] == [number >= count for number in range(COUNT)]
    assert f"mask must have as many frames as {source.name}, which has {COUNT}; got {count}" in caplog.text


def test_a_video_of_masks_beside_a_stack(tmp_path):
    np.save(tmp_path / "frames.npy", np.stack([videos.picture(number) for number in range(6)]))
    path = write_masks(tmp_path / "m.mp4", 6)
    with sources.open(tmp_path / "frames.npy", masks=path) as source:
        assert agree(source) == [True] * 6


def test_a_lost_mask_is_missed_by_its_frame_alone(tmp_path, caplog):
    large = np.ones((4, 4, 1), np.uint8)
    masks = [np.kron(mask_picture(number), large) for number in range(COUNT)]
    damaged = videos.blank(videos.write(tmp_path / "m.mp4", pictures=masks, group=1), 0.5, 600)
    images = [np.kron(videos.picture(number), large) for number in range(COUNT)]
    colour = videos.write(tmp_path / "a.mp4", pictures=images)
    with sources.open(colour, masks=damaged) as source:
        frames = list(source)
    missing = [frame.index for frame in frames if frame.mask is None]
    assert 0 < len(missing) < 10
    assert agree(frame for frame in frames if frame.mask is not None) == [True] * (COUNT - len(missing))
    assert caplog.text.count("cannot be decoded") == 1
    assert f"frame {missing[0]} goes without mask: {damaged} lacks it" in caplog.text


def test_depth_in_a_video_has_16_bits(tmp_path):
    depth = [np.full((64, 96), 1000 + number, np.uint16) for number in range(COUNT)]
    frames = [av.VideoFrame.from_ndarray(pixels, format="gray16le") for pixels in depth]
    path = videos.write(tmp_path / "d.mkv", "ffv1", pictures=frames, pixel_format="gray16le")
    with sources.open(paused(tmp_path), depth=path) as source:
        for number, frame in enumerate(source):
            np.testing.assert_array_equal(frame.depth, depth[number])
            assert frame.depth_unit_m == 0.001
    with pytest.raises(SourceError, match=r"m\.mp4: depth in a video must have one channel of 16 bits"):
        sources.open(tmp_path / "pause.webm", depth=write_masks(tmp_path / "m.mp4", COUNT))
