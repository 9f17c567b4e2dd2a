"""Masks in the alpha channel: used where the colour says nothing, named where it says something else."""

from __future__ import annotations

import io
import logging
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from picture_files import BAR, COLOUR, Image, only, pillow, save, tiff

from dloftbs import sources
from dloftbs.errors import SourceError

ALPHA = np.where(BAR > 0, 255, 0).astype(np.uint8)
LOSSLESS: dict[str, Any] = {"lossless": True, "exact": True}


def with_alpha(colour: Any, alpha: np.ndarray = ALPHA) -> np.ndarray:
    return np.dstack([np.broadcast_to(np.asarray(colour, np.uint8), (*BAR.shape, 3)), alpha])


def grey_alpha(grey: Any, alpha: np.ndarray = ALPHA) -> np.ndarray:
    return np.dstack([np.broadcast_to(np.asarray(grey, np.uint8), BAR.shape), alpha])


@pytest.mark.parametrize("colour", [(0, 0, 0), (255, 255, 255), (255, 0, 0)])
@pytest.mark.parametrize("kind", ["auto", "mask"])
@pytest.mark.parametrize("suffix", [".png", ".webp", ".tif", ".bmp"])
def test_alpha_beside_one_colour_is_the_mask(tmp_path: Path, colour: Any, kind: Any, suffix: str) -> None:
    pixels = with_alpha(colour)
    if suffix == ".bmp":
        data = cv2.imencode(suffix, pixels)[1].tobytes()
    else:
        options = LOSSLESS if suffix == ".webp" else {}
        data = pillow(pixels, {".tif": "TIFF"}.get(suffix, suffix[1:].upper()), **options)
    np.testing.assert_array_equal(only(sources.open(save(tmp_path / f"a{suffix}", data), kind=kind)).mask, ALPHA)


@pytest.mark.parametrize("grey", [0, 255, 90])
@pytest.mark.parametrize("format", ["PNG", "TIFF"])
def test_alpha_beside_grey(tmp_path: Path, grey: int, format: str) -> None:
    path = save(tmp_path / f"a.{format.lower()}", pillow(grey_alpha(grey), format))
    np.testing.assert_array_equal(only(sources.open(path)).mask, ALPHA)


def test_alpha_of_16_bits_and_of_a_palette(tmp_path: Path) -> None:
    deep = cv2.imencode(".png", with_alpha((255, 255, 255)).astype(np.uint16) * 257)[1].tobytes()
    np.testing.assert_array_equal(only(sources.open(save(tmp_path / "a.png", deep))).mask, ALPHA * np.uint16(257))
    keyed = pillow(np.dstack([BAR] * 3), "PNG", transparency=(0, 0, 0))  # one colour is transparent
    np.testing.assert_array_equal(only(sources.open(save(tmp_path / "b.png", keyed))).mask, ALPHA)


def test_masks_beside_images_and_pages(tmp_path: Path) -> None:
    image = save(tmp_path / "a.jpg", pillow(COLOUR, "JPEG"))
    mask = save(tmp_path / "m.png", pillow(with_alpha((255, 255, 255)), "PNG"))
    np.testing.assert_array_equal(only(sources.open(image, masks=mask)).mask, ALPHA)
    with sources.open(save(tmp_path / "a.tif", tiff([grey_alpha(255), with_alpha(0)]))) as source:
        for frame in source:
            np.testing.assert_array_equal(frame.mask, ALPHA)


@pytest.mark.parametrize("name", ["a.png", "b.png", "c.tif"])
def test_two_masks_in_one_file_are_named(tmp_path: Path, name: str) -> None:
    alpha = np.roll(ALPHA, 9, 0)
    pixels = np.dstack([BAR, BAR, BAR, alpha]) if name == "a.png" else grey_alpha(BAR, alpha)
    path = save(tmp_path / name, pillow(pixels, "TIFF" if name == "c.tif" else "PNG"))
    with pytest.raises(SourceError, match=rf"{name}: its colours and its alpha channel are two .* 220 and 220"):
        only(sources.open(path))


def test_two_masks_that_are_the_same_are_one(tmp_path: Path) -> None:
    shades = np.where(BAR > 0, np.arange(64), 0).astype(np.uint8)  # of grey, so that the colour is not one
    path = save(tmp_path / "a.png", pillow(grey_alpha(shades), "PNG"))
    np.testing.assert_array_equal(only(sources.open(path)).mask, shades)


@pytest.mark.parametrize("value", [0, 128, 255])
def test_alpha_that_is_the_same_everywhere_is_ignored(
    tmp_path: Path, value: int, caplog: pytest.LogCaptureFixture
) -> None:
    flat = np.full(BAR.shape, value, np.uint8)
    with caplog.at_level(logging.WARNING, "dloftbs.sources"):
        mask = only(sources.open(save(tmp_path / "a.png", pillow(grey_alpha(BAR, flat), "PNG")))).mask
        image = only(sources.open(save(tmp_path / "b.png", pillow(with_alpha(COLOUR, flat), "PNG")))).image
    np.testing.assert_array_equal(mask, BAR)
    np.testing.assert_array_equal(image, COLOUR[..., ::-1])
    assert caplog.text == ""


def test_a_frame_without_cable_is_empty(tmp_path: Path) -> None:
    empty = with_alpha((255, 255, 255), np.zeros(BAR.shape, np.uint8))
    mask = only(sources.open(save(tmp_path / "a.png", pillow(empty, "PNG")))).mask
    assert mask is not None
    assert not mask.any()


def test_alpha_beside_an_image_is_left_out_and_it_is_said_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    for number in range(3):
        save(tmp_path / f"{number}.png", pillow(with_alpha(COLOUR), "PNG"))
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(tmp_path) as source:
        for frame in source:
            np.testing.assert_array_equal(frame.image, COLOUR[..., ::-1])
    assert [record.message for record in caplog.records] == [
        "0.png: its alpha channel is not opaque, and is left out; save it as a grey image if it is the mask"
    ]


@pytest.mark.skipif(not hasattr(cv2, "imdecodeanimation"), reason="needs OpenCV 4.11")
@pytest.mark.parametrize("format", ["PNG", "WEBP"])
def test_animations(tmp_path: Path, format: str, caplog: pytest.LogCaptureFixture) -> None:
    alphas = [np.roll(ALPHA, number, 0) for number in range(3)]
    frames = [Image.fromarray(with_alpha((255, 255, 255), alpha)) for alpha in alphas]
    options = LOSSLESS if format == "WEBP" else {"blend": 0}
    stream = io.BytesIO()
    frames[0].save(stream, format, save_all=True, append_images=frames[1:], **options)
    path = save(tmp_path / f"a.{format.lower()}", stream.getvalue())
    with sources.open(path, kind="mask") as source:
        for frame, alpha in zip(source, alphas, strict=True):
            np.testing.assert_array_equal(frame.mask, alpha)
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(path) as source:
        assert len(list(source)) == 3
    assert caplog.text.count("its alpha channel is not opaque, and is left out") == 1
