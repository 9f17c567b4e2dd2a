"""What OpenCV does not decode is named, with what to do; black pixels are not made up for it."""

from __future__ import annotations

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
from picture_files import BAR, COLOUR, Image, only, pillow, plain_tiff, save

from dloftbs import sources
from dloftbs.errors import SourceError
from dloftbs.sources.pixels import decode

JPEG_DATA = pillow(COLOUR, "JPEG")
BEGINS = {
    "JPEG XL": (b"\xff\x0a" + bytes(40), b"\0\0\0\x0cJXL \r\n\x87\n" + bytes(40)),
    "JPEG 2000": (b"\0\0\0\x0cjP  \r\n\x87\n" + bytes(40), b"\xff\x4f\xff\x51" + bytes(40)),
    "HEIC": (b"\0\0\0\x18ftypheic" + bytes(40), b"\0\0\0\x18ftypmif1\0\0\0\0mif1heic" + bytes(40)),
    "OpenEXR": (b"\x76\x2f\x31\x01\x02" + bytes(40),),
    "Photoshop": (b"8BPS" + bytes(40),),
    "raw data": (b"II\x2a\0\x10\0\0\0CR\x02\0" + bytes(40), b"FUJIFILMCCD-RAW " + bytes(40), b"\0\0\0\x18ftypcrx "),
}


def refusal(path: Path, **options: Path) -> str:
    with pytest.raises(SourceError) as caught, sources.open(path, **options) as source:
        list(source)
    return str(caught.value)


@pytest.mark.parametrize("name", BEGINS)
@pytest.mark.parametrize("suffix", [".png", ".bin", ""])
def test_formats_are_named_whatever_the_ending(tmp_path: Path, name: str, suffix: str) -> None:
    for data in BEGINS[name]:
        path = save(tmp_path / f"a{suffix}", data)
        message = refusal(path)
        assert str(path) in message
        assert name in message
        assert "save it as" in message
        assert "corrupt" not in message
    image = save(tmp_path / "image.png", pillow(BAR, "PNG"))
    if suffix != ".png":
        assert name in refusal(image, depth=path)
        assert name in refusal(image, masks=path)


def test_a_preview_in_raw_data_is_no_picture(tmp_path: Path) -> None:
    assert "raw data" in refusal(save(tmp_path / "a.dng", plain_tiff([BAR], t50706=1)))
    assert "raw data" in refusal(save(tmp_path / "a.tif", plain_tiff([BAR], t50706=1)))


@pytest.mark.parametrize(
    ("number", "name"),
    [(9, "JBIG"), (34712, "JPEG 2000"), (34926, "zstd"), (50002, "JPEG XL"), (52546, "JPEG XL"), (12345, "unknown")],
)
def test_a_compression_of_which_opencv_makes_black_pixels_is_refused(tmp_path: Path, number: int, name: str) -> None:
    message = refusal(save(tmp_path / "a.tif", plain_tiff([BAR], t259=number)))
    assert f"{name}" in message
    assert f"(number {number})" in message
    assert "save it with LZW, deflate or no compression" in message


@pytest.mark.parametrize(
    ("number", "name"),
    [(6, "TIFF 6.0"), (34887, "LERC"), (34925, "LZMA"), (50000, "zstd"), (50001, "WebP"), (34661, "JBIG")],
)
def test_a_compression_that_only_some_builds_read_is_named(tmp_path: Path, number: int, name: str) -> None:
    assert f"compressed by {name}" in refusal(save(tmp_path / "a.tif", plain_tiff([BAR], t259=number))).replace(
        "JPEG in the way of ", ""
    )


def test_types_of_numbers_are_named(tmp_path: Path) -> None:
    halves = plain_tiff([BAR.astype(np.float16)])
    assert "floating point of 16 bits" in refusal(save(tmp_path / "a.tif", halves))
    assert "TIFF of 2 bits a value" in refusal(save(tmp_path / "a.tif", plain_tiff([BAR], t258=2)))


@pytest.mark.parametrize(
    ("marker", "bits", "name"), [(0xC3, 8, "lossless"), (0xC5, 8, "hierarchical"), (0xC1, 12, "JPEG of 12 bits")]
)
def test_processes_of_jpeg_are_named(monkeypatch: pytest.MonkeyPatch, marker: int, bits: int, name: str) -> None:
    data = bytearray(JPEG_DATA)
    at = data.index(b"\xff\xc0")
    data[at + 1], data[at + 4] = marker, bits
    monkeypatch.setattr(cv2, "imdecode", lambda *_: None)  # some builds do read them
    with pytest.raises(SourceError, match=f"it is a .*{name}.* this OpenCV does not read; save it as PNG"):
        decode(bytes(data))


def test_what_is_cut_off_is_said_to_be(tmp_path: Path) -> None:
    for name, data in (("a.jpg", JPEG_DATA), ("a.png", pillow(COLOUR, "PNG")), ("a.webp", pillow(COLOUR, "WEBP"))):
        assert "cut off" in refusal(save(tmp_path / name, data[: len(data) // 2]))


@pytest.mark.parametrize("mode", ["JPEG", "TIFF"])
def test_cmyk_is_read(tmp_path: Path, mode: str) -> None:
    path = tmp_path / f"a.{mode.lower()}"
    Image.fromarray(COLOUR).convert("CMYK").save(path)
    image = only(sources.open(path)).image
    assert image is not None
    assert np.abs(image.astype(int) - COLOUR[..., ::-1]).mean() < 12


@pytest.mark.parametrize("suffix", ["", ".jfif", ".bin"])
def test_an_image_is_one_by_its_content(tmp_path: Path, suffix: str) -> None:
    frame = only(sources.open(save(tmp_path / f"faint{suffix}", pillow(BAR // 100, "PNG"))))
    np.testing.assert_array_equal(frame.mask, BAR // 100)  # as a video, cable would begin at half brightness


def test_depth_of_floating_point_in_pfm(tmp_path: Path) -> None:
    metres = np.linspace(0.5, 2.0, BAR.size, dtype=np.float32).reshape(BAR.shape)
    done, data = cv2.imencode(".pfm", metres)
    assert done
    mask = save(tmp_path / "a.png", pillow(BAR, "PNG"))
    path = save(tmp_path / "depth" / "a.pfm", data.tobytes())
    for where in (path, path.parent):
        np.testing.assert_array_equal(only(sources.open(mask, depth=where)).depth, metres)


def test_a_tag_of_a_type_without_numbers_is_skipped(tmp_path: Path) -> None:
    data = plain_tiff([BAR], t305=0)
    at = data.index(struct.pack("<HHII", 305, 4, 1, 0))
    text = data[:at] + struct.pack("<HHI", 305, 2, 4) + b"abc\0" + data[at + 12 :]
    np.testing.assert_array_equal(only(sources.open(save(tmp_path / "a.tif", text))).mask, BAR)
