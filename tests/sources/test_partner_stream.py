"""Masks from a video or an animation beside other frames."""

from __future__ import annotations

import io
import logging
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from picture_files import Image, bar, pillow, save

from dloftbs import sources
from dloftbs.errors import SourceError

MASKS = [bar(number) // 200 * 255 for number in range(8)]


def video(path: Path, frames: list[np.ndarray]) -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25)
        stream.height, stream.width = frames[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        for frame in frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.dstack([frame] * 3), "bgr24")))
        container.mux(stream.encode())
    return path


def rows(source: sources.Source, what: str = "mask") -> list[int | None]:
    found = [getattr(frame, what) for frame in source]
    return [None if mask is None else int(np.argmax((mask != 0).any(axis=1))) for mask in found]


@pytest.mark.parametrize("what", ["masks", "occluders"])
def test_masks_of_a_video_beside_a_video(tmp_path: Path, what: str) -> None:
    colour, beside = video(tmp_path / "a.mp4", MASKS), video(tmp_path / "m.mp4", MASKS)
    with sources.open(colour, **{what: beside}) as source:
        for _ in range(2):
            assert rows(source, what.replace("masks", "mask")) == list(range(20, 28))


def test_beside_images_and_arrays(tmp_path: Path) -> None:
    beside = video(tmp_path / "m.mp4", MASKS)
    for number in range(8):
        save(tmp_path / "images" / f"{number}.jpg", pillow(np.dstack([MASKS[number]] * 3), "JPEG"))
    np.save(tmp_path / "a.npy", np.zeros((8, 48, 64, 3), np.uint8))
    for where in (tmp_path / "images", tmp_path / "a.npy"):
        with sources.open(where, masks=beside) as source:
            assert rows(source) == list(range(20, 28))


@pytest.mark.skipif(not hasattr(cv2, "imdecodeanimation"), reason="needs OpenCV 4.11")
def test_masks_of_an_animation(tmp_path: Path) -> None:
    stream = io.BytesIO()
    frames = [Image.fromarray(mask) for mask in MASKS]
    frames[0].save(stream, "PNG", save_all=True, append_images=frames[1:])
    beside = save(tmp_path / "m.png", stream.getvalue())
    with sources.open(video(tmp_path / "a.mp4", MASKS), masks=beside) as source:
        assert rows(source) == list(range(20, 28))
    np.save(tmp_path / "b.npy", np.zeros((5, 48, 64, 3), np.uint8))
    with pytest.raises(SourceError, match=r"mask must have as many frames as .*, which has 5; got 8"):
        sources.open(tmp_path / "b.npy", masks=beside)


def test_what_is_too_short_or_too_long_is_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    colour, short = video(tmp_path / "a.mp4", MASKS[:6]), video(tmp_path / "m.mp4", MASKS[:4])
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(colour, masks=short) as source:
        assert rows(source) == [20, 21, 22, 23, None, None]
    assert f"mask must have as many frames as {colour}, which has 6; got 4" in caplog.text
    caplog.clear()
    long = video(tmp_path / "l.mp4", MASKS)
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(colour, masks=long) as source:
        assert rows(source) == list(range(20, 26))
    assert f"mask must have as many frames as {colour}, which has 6; got 8" in caplog.text


def test_depth_does_not_come_from_a_video_of_eight_bits(tmp_path: Path) -> None:
    colour = video(tmp_path / "a.mp4", MASKS)
    with pytest.raises(
        SourceError, match=r"m\.mp4: depth in a video must have one channel of 16 bits.* a TIFF of several pages"
    ):
        sources.open(colour, depth=video(tmp_path / "m.mp4", MASKS))
