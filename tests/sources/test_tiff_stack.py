"""TIFF files of several pages: a stream, alone and beside other frames."""

from __future__ import annotations

import io
import logging
import struct
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from picture_files import BAR, COLOUR, Image, bar, plain_tiff, save, tiff

from dloftbs import PinholeCamera, sources
from dloftbs.errors import SourceError
from dloftbs.sources import tiff_pages
from dloftbs.sources.tiff_pages import pages_of

COUNT = 5
BARS = [bar(number) for number in range(COUNT)]


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_every_page_is_a_frame(tmp_path: Path, order: str, big: bool, dtype: type) -> None:
    path = save(tmp_path / "a.tif", plain_tiff([page.astype(dtype) for page in BARS], order, big=big))
    with sources.open(path, fps=10) as source:
        assert (source.name, source.length, source.fps) == (str(path), COUNT, 10)
        for _ in range(2):
            frames = list(source)
            assert [frame.name for frame in frames] == [f"a.tif#{number}" for number in range(COUNT)]
            assert [frame.stamp for frame in frames] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
            for frame, page in zip(frames, BARS, strict=True):
                np.testing.assert_array_equal(frame.mask, page)
        assert source.skipped == 0


@pytest.mark.parametrize("options", [{}, {"compression": "tiff_lzw"}, {"compression": "tiff_adobe_deflate"}])
def test_pages_may_be_colour(tmp_path: Path, options: dict[str, str]) -> None:
    with sources.open(save(tmp_path / "a.tiff", tiff([COLOUR, COLOUR[::-1]], **options))) as source:
        first, second = source
    np.testing.assert_array_equal(first.image, COLOUR[..., ::-1])
    np.testing.assert_array_equal(second.image, COLOUR[::-1, :, ::-1])


def test_pages_of_one_bit_and_of_a_palette(tmp_path: Path) -> None:
    bits = [Image.fromarray(page > 0) for page in BARS]
    labels = [Image.fromarray((page > 0).astype(np.uint8) * 3, "P") for page in BARS]
    for image in labels:
        image.putpalette([0, 0, 0, 9, 9, 9, 9, 9, 9, 0, 0, 0])  # the objects are as black as the ground
    for name, pages in (("one", bits), ("fax", bits), ("palette", labels)):
        options = {"compression": "group4"} if name == "fax" else {}
        with sources.open(save(tmp_path / f"{name}.tif", tiff(pages, **options))) as source:
            for frame, page in zip(source, BARS, strict=True):
                np.testing.assert_array_equal(frame.mask != 0, page != 0)


def test_a_mask_from_jpeg_in_a_tiff_begins_at_half_brightness(tmp_path: Path) -> None:
    for count in (1, 2):
        data = tiff([BAR // 200 * 255] * count, compression="jpeg", quality=30)
        ringing = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
        assert (ringing > 0).sum() > (BAR > 0).sum()
        with sources.open(save(tmp_path / "a.tif", data)) as source:
            for frame in source:
                np.testing.assert_array_equal(frame.mask, BAR > 0)


def test_pages_of_other_sizes_are_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = save(tmp_path / "a.tif", tiff([BAR, np.zeros((10, 20), np.uint8), BAR]))
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(path) as source:
        assert [frame.size for frame in source] == [(48, 64), (10, 20), (48, 64)]
    assert "a.tif#1 has 20 x 10 pixels, a.tif#0 before it 64 x 48" in caplog.text


def test_a_smaller_copy_of_a_page_is_no_frame(tmp_path: Path) -> None:
    whole = plain_tiff([BAR, BAR[::2, ::2]])
    page = pages_of(whole).frames[1]
    assert len(pages_of(whole).frames) == 2
    tag = struct.pack("<HHII", 256, 4, 1, 32)
    at = whole.index(tag, page.at)
    reduced = whole[:at] + struct.pack("<HHII", 254, 4, 1, 1) + whole[at + len(tag) :]
    with sources.open(save(tmp_path / "a.tif", reduced)) as source:
        (frame,) = source
    assert frame.name == "a.tif"


def test_one_that_is_cut_off_is_reported(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    data = plain_tiff(BARS)
    second, third = pages_of(data).frames[1:3]
    for cut, whole in ((data[: third.at + 9], 2), (data[: second.at + 9], 1)):
        caplog.clear()
        with caplog.at_level(logging.WARNING, "dloftbs.sources"):
            with sources.open(save(tmp_path / "a.tif", cut)) as source:
                frames = list(source)
            assert (len(frames), source.skipped) == (whole, 1)
        assert f"what follows page {whole - 1} of {tmp_path / 'a.tif'}: it is cut off or damaged" in caplog.text


def test_pages_that_lead_back_to_each_other_end(tmp_path: Path) -> None:
    data = bytearray(plain_tiff(BARS[:2]))
    data[-4:] = struct.pack("<I", pages_of(bytes(data)).frames[0].at)
    with sources.open(save(tmp_path / "a.tif", bytes(data))) as source:
        assert len(list(source)) == 2
        assert source.skipped == 1


def test_more_pages_than_any_recording_has_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tiff_pages, "MAX_PAGES", 4)
    with pytest.raises(SourceError, match=r"a\.tif: a TIFF must have at most 4 pages"):
        sources.open(save(tmp_path / "a.tif", plain_tiff(BARS)))


def test_a_page_that_is_damaged_is_skipped(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    data = bytearray(plain_tiff(BARS))
    form, at = pages_of(bytes(data)).frames[2].places[tiff_pages.COMPRESSION]
    struct.pack_into(form, data, at, 34712)
    with caplog.at_level(logging.WARNING, "dloftbs.sources"):
        with sources.open(save(tmp_path / "a.tif", bytes(data))) as source:
            assert [frame.index for frame in source] == [0, 1, 3, 4]
        assert source.skipped == 1
    assert "a.tif: page 2: " in caplog.text
    assert "JPEG 2000" in caplog.text


def test_in_a_folder_the_first_page_is_read_and_it_is_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for name in ("a", "b"):
        save(tmp_path / f"{name}.tif", plain_tiff(BARS))
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(tmp_path) as source:
        assert [frame.name for frame in source] == ["a.tif", "b.tif"]
    assert "a.tif: only the first of its 5 pages is read" in caplog.text
    assert len(caplog.records) == 1


def test_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(plain_tiff(BARS))))
    with sources.open("-") as source:
        assert [frame.name for frame in source] == [f"stdin#{number}" for number in range(COUNT)]


@pytest.mark.parametrize("dtype", [np.uint16, np.float32])
def test_depth_beside_frames(tmp_path: Path, dtype: type) -> None:
    depths = [np.full(BAR.shape, 700 + number, dtype) for number in range(COUNT)]
    masks, depth = save(tmp_path / "a.tif", plain_tiff(BARS)), save(tmp_path / "d.tif", plain_tiff(depths, ">"))
    camera = PinholeCamera(50, 50, 32, 24)
    with sources.open(masks, depth=depth, camera=camera) as source:
        frames = list(source)
    for frame, expected in zip(frames, depths, strict=True):
        np.testing.assert_array_equal(frame.depth, expected)
    save(depth, plain_tiff(depths[:3]))
    with pytest.raises(SourceError, match=r"depth must have as many frames as .*a\.tif, which has 5; got 3"):
        sources.open(masks, depth=depth)


def test_a_page_that_is_no_depth_leaves_its_frame_without(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    masks, depth = save(tmp_path / "a.tif", plain_tiff(BARS[:2])), save(tmp_path / "d.tif", plain_tiff(BARS[:2]))
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(masks, depth=depth) as source:
        assert [frame.depth for frame in source] == [None, None]
    assert "d.tif: page 1: depth must have one channel of 16 bits" in caplog.text


@pytest.mark.parametrize("what", ["masks", "occluders"])
def test_masks_beside_a_stack_of_images(tmp_path: Path, what: str) -> None:
    images = np.stack([COLOUR] * COUNT)
    np.save(tmp_path / "a.npy", images)
    beside = {what: save(tmp_path / "m.tif", plain_tiff(BARS))}
    with sources.open(tmp_path / "a.npy", **beside) as source:
        for frame, page in zip(source, BARS, strict=True):
            np.testing.assert_array_equal(frame.mask if what == "masks" else frame.occluders, page)


def test_pages_are_what_is_said_of_their_values(tmp_path: Path) -> None:
    pages = [np.full((16, 16), share, np.float32) for share in (0.3, 0.6)]
    assert cv2.imwritemulti(str(tmp_path / "a.tif"), pages)
    for mask_is, expected in (("auto", [False, True]), ("probability", [False, True]), ("binary", [True, True])):
        with sources.open(tmp_path / "a.tif", mask_is=mask_is) as source:
            assert [bool(frame.is_cable.all()) for frame in source] == expected
