"""Animated PNG and WebP files: all frames, with their times."""

from __future__ import annotations

import io
import logging
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from dloftbs import sources
from dloftbs.errors import SourceError
from dloftbs.sources import animations
from dloftbs.sources.image_header import is_lossy, read_durations

Image = pytest.importorskip("PIL.Image")
needs_opencv = pytest.mark.skipif(not hasattr(cv2, "imdecodeanimation"), reason="needs OpenCV 4.11")

COUNT = 5
MS = [40, 60, 100, 40, 20]


def picture(number: int) -> np.ndarray:
    """A bar that goes down, BGR."""
    pixels = np.full((40, 60, 3), (90, 60, 30), np.uint8)
    pixels[4 + 6 * number : 8 + 6 * number, 5:50] = (20, 20, 200)
    return pixels


def animation(format: str, *, mode: str = "RGB", count: int = COUNT, **options: Any) -> bytes:
    frames = [Image.fromarray(picture(number)[..., ::-1]).convert(mode) for number in range(count)]
    stream = io.BytesIO()
    options = {"duration": MS[:count], **({"lossless": True} if format == "WEBP" else {}), **options}
    frames[0].save(stream, format, save_all=True, append_images=frames[1:], **options)
    return stream.getvalue()


def save(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


@needs_opencv
@pytest.mark.parametrize(("name", "format"), [("a.png", "PNG"), ("a.webp", "WEBP")])
@pytest.mark.parametrize("piece", [1 << 26, 40 * 60 * 2, 1], ids=["at once", "by twos", "one by one"])
def test_every_frame_comes_with_its_time(tmp_path, monkeypatch, name, format, piece):
    monkeypatch.setattr(animations, "_MAX_PIXELS", piece)
    path = save(tmp_path / name, animation(format))
    with sources.open(path) as source:
        assert (source.name, source.length, source.live) == (str(path), COUNT, False)
        assert source.fps == pytest.approx(COUNT / 0.26)
        frames = list(source)
        again = list(source)
        assert source.skipped == 0
    assert len(frames) == len(again) == COUNT
    for number, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.image, picture(number))
        assert (frame.index, frame.name, frame.mask) == (number, f"{name}#{number}", None)
    assert [frame.stamp for frame in frames] == pytest.approx([0.0, 0.04, 0.1, 0.2, 0.24])


@needs_opencv
def test_fps_replaces_the_files_times(tmp_path):
    with sources.open(save(tmp_path / "a.png", animation("PNG")), fps=10) as source:
        assert source.fps == 10
        assert [frame.stamp for frame in source] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])


@needs_opencv
def test_frames_that_are_shown_for_no_time_have_no_stamps(tmp_path):
    with sources.open(save(tmp_path / "a.png", animation("PNG", duration=0))) as source:
        assert source.fps is None
        assert [frame.stamp for frame in source] == [None] * COUNT


@needs_opencv
@pytest.mark.parametrize("mode", ["L", "RGBA", "P"])
@pytest.mark.parametrize("format", ["PNG", "WEBP"])
def test_masks_and_images_of_any_mode(tmp_path, mode, format):
    path = save(tmp_path / f"a.{format.lower()}", animation(format, mode=mode))
    with sources.open(path) as source:
        assert [frame.image is None for frame in source] == [False] * COUNT
    with sources.open(path, kind="mask") as source:
        masks = [frame.mask for frame in source]
    assert all(mask.shape == (40, 60) and mask.dtype == np.uint8 for mask in masks)


@needs_opencv
def test_masks_of_a_lossy_animation_begin_at_half_brightness(tmp_path):
    frames = [np.zeros((40, 60), np.uint8) for _ in range(3)]
    for number, frame in enumerate(frames):
        frame[10 + number : 14 + number, 5:50] = 255
    images = [Image.fromarray(frame).convert("RGB") for frame in frames]
    images[0].save(tmp_path / "a.webp", save_all=True, append_images=images[1:], duration=40, quality=60)
    assert is_lossy((tmp_path / "a.webp").read_bytes())
    with sources.open(tmp_path / "a.webp", kind="mask") as source:
        for frame, expected in zip(source, frames, strict=True):
            assert (frame.mask != (expected > 0)).mean() < 0.01


@needs_opencv
def test_a_hidden_first_picture_is_no_frame(tmp_path):
    data = animation("PNG", default_image=True)
    assert len(read_durations(data)) == COUNT - 1
    with sources.open(save(tmp_path / "a.png", data)) as source:
        assert [int(frame.image[..., 2].argmax(axis=0)[20]) for frame in source] == [10, 16, 22, 28]


@needs_opencv
def test_one_that_is_cut_off_is_reported(tmp_path, caplog):
    data = animation("PNG")
    at = data.rindex(b"fdAT")
    with sources.open(save(tmp_path / "a.png", data[: at + 20] + data[-12:])) as source:
        assert len(list(source)) == source.length - source.skipped
    path = save(tmp_path / "b.webp", animation("WEBP"))
    path.write_bytes(path.read_bytes()[:-100])
    with sources.open(path) as source, pytest.raises(SourceError, match=r"b\.webp: cannot be decoded"):
        list(source)


@needs_opencv
def test_closing_ends_it(tmp_path):
    source = sources.open(save(tmp_path / "a.png", animation("PNG")))
    frames = iter(source)
    next(frames)
    source.close()
    assert list(frames) == []
    with pytest.raises(SourceError, match="closed"):
        iter(source)


def test_in_a_folder_the_first_frame_is_read_and_it_is_said(tmp_path, caplog):
    save(tmp_path / "a.png", animation("PNG"))
    cv2.imwrite(str(tmp_path / "b.png"), picture(1))
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(tmp_path) as source:
        assert [frame.name for frame in source] == ["a.png", "b.png"]
    assert "a.png: only the first of its 5 frames is read" in caplog.text
    assert len(caplog.records) == 1


def test_an_older_opencv_says_what_it_needs(tmp_path, monkeypatch):
    monkeypatch.delattr(cv2, "imdecodeanimation", raising=False)
    with pytest.raises(SourceError, match=r"a\.webp: this is OpenCV .* needs OpenCV 4\.11 or newer: pip install"):
        sources.open(save(tmp_path / "a.webp", animation("WEBP")))


def test_a_still_picture_is_no_animation(tmp_path):
    for name in ("a.png", "a.webp"):
        cv2.imwrite(str(tmp_path / name), picture(0))
        assert read_durations((tmp_path / name).read_bytes()) == ()
        with sources.open(tmp_path / name) as source:
            assert isinstance(source, sources.FileSource)
    assert len(read_durations(animation("PNG", count=1))) <= 1


@pytest.mark.parametrize("format", ["PNG", "WEBP"])
def test_a_header_that_is_cut_off_or_changed_does_no_harm(format):
    data = animation(format)
    for length in range(len(data)):
        assert len(read_durations(data[:length])) <= COUNT
    rng = np.random.default_rng(0)
    for _ in range(2000):
        noisy = bytearray(data)
        for at in rng.integers(0, len(data), 3):
            noisy[at] = rng.integers(256)
        assert all(seconds >= 0.0 for seconds in read_durations(bytes(noisy)))
        is_lossy(bytes(noisy))


def test_lossy_is_what_rings():
    pixels = picture(0)
    lossless = [cv2.imencode(".webp", pixels, [cv2.IMWRITE_WEBP_QUALITY, 101])[1], cv2.imencode(".png", pixels)[1]]
    lossy = [cv2.imencode(".webp", pixels, [cv2.IMWRITE_WEBP_QUALITY, 60])[1], cv2.imencode(".jpg", pixels)[1]]
    assert [is_lossy(bytes(data)) for data in lossless + lossy] == [False, False, True, True]
    assert not is_lossy(animation("WEBP"))
    assert is_lossy(animation("WEBP", lossless=False))
