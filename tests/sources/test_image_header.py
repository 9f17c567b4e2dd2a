"""The size that the header of an image says, against what OpenCV decodes; and headers that promise gigabytes."""

from __future__ import annotations

import logging
import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from bounded import run_bounded

from dloftbs import sources
from dloftbs.errors import SourceError
from dloftbs.sources.image_header import read_size

EXTENSIONS = (".png", ".jpg", ".bmp", ".tif", ".webp", ".pbm", ".pgm", ".ppm", ".pfm")
LARGE = 30_000
"""OpenCV itself would make room for so many rows and columns, 2.7 GB."""


def encoded(extension: str, rows: int, columns: int, *options: int) -> bytes:
    rng = np.random.default_rng(rows)
    pixels = rng.integers(0, 256, (rows, columns, 3), dtype=np.uint8)
    if extension in (".pbm", ".pgm", ".pfm"):
        pixels = pixels[..., 0]
    if extension == ".pfm":
        pixels = pixels.astype(np.float32)
    done, data = cv2.imencode(extension, pixels, options)
    assert done
    return bytes(data)


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("size", [(1, 1), (30, 50), (300, 7), (257, 1025)])
def test_the_size_is_that_of_the_pixels(extension: str, size: tuple[int, int]) -> None:
    assert read_size(encoded(extension, *size)) == size


@pytest.mark.parametrize("quality", [50, 101])
def test_both_kinds_of_webp_are_read(quality: int) -> None:
    assert read_size(encoded(".webp", 33, 44, cv2.IMWRITE_WEBP_QUALITY, quality)) == (33, 44)
    extended = b"RIFF\0\0\0\0WEBPVP8X\x0a\0\0\0" + bytes(4) + (43).to_bytes(3, "little") + (32).to_bytes(3, "little")
    assert read_size(extended) == (33, 44)


def test_what_stands_before_the_size_is_stepped_over() -> None:
    jpeg = encoded(".jpg", 30, 50)
    thumbnail = b"\xff\xe1" + struct.pack(">H", 2 + len(encoded(".jpg", 4, 5))) + encoded(".jpg", 4, 5)
    for between in (thumbnail, b"\xff\xff\xff", b"junk", b"\xff\x01"):
        assert read_size(jpeg[:20] + between + jpeg[20:]) == (30, 50)  # behind the first segment
    assert read_size(b"P5 # 7 8\n# 9\n 50\t#\n30\n255\n") == (30, 50)
    assert read_size(encoded(".jpg", 30, 50, cv2.IMWRITE_JPEG_PROGRESSIVE, 1)) == (30, 50)


def tiff(order: str, *, big: bool, tags: dict[int, int]) -> bytes:
    begin = b"II" if order == "<" else b"MM"
    if big:
        entries = b"".join(struct.pack(f"{order}HHQQ", tag, 16, 1, value) for tag, value in tags.items())
        return begin + struct.pack(f"{order}HHHQQ", 43, 8, 0, 16, len(tags)) + entries + bytes(8)
    entries = b"".join(struct.pack(f"{order}HHII", tag, 4, 1, value) for tag, value in tags.items())
    return begin + struct.pack(f"{order}HIH", 42, 8, len(tags)) + entries + bytes(4)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("big", [False, True])
def test_tiffs_of_both_orders_are_read(order: str, big: bool) -> None:
    assert read_size(tiff(order, big=big, tags={256: 50, 257: 30})) == (30, 50)
    assert read_size(tiff(order, big=big, tags={256: 50, 257: 30, 322: 64, 323: 16})) == (30, 64)
    assert read_size(tiff(order, big=big, tags={256: 50})) is None


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_what_is_cut_off_or_changed_has_some_size_or_none(extension: str) -> None:
    data = encoded(extension, 30, 50)
    assert all(read_size(data[:length]) in (None, (30, 50)) for length in range(200))
    rng = np.random.default_rng(0)
    for _ in range(2000):
        noisy = bytearray(data)
        for at in rng.integers(0, min(len(data), 300), 3):
            noisy[at] = rng.integers(256)
        size = read_size(bytes(noisy))
        assert size is None or min(size) >= 0
    assert read_size(b"GIF89a" + data) is None


def lying(name: str) -> bytes:
    sides = struct.pack(">II", LARGE, LARGE)
    if name == "png":
        head = b"IHDR" + sides + b"\x08\x02\0\0\0"
        rows = zlib.compress(bytes(1000))
        return b"".join([
            b"\x89PNG\r\n\x1a\n", struct.pack(">I", 13), head, struct.pack(">I", zlib.crc32(head)),
            struct.pack(">I", len(rows)), b"IDAT", rows, struct.pack(">I", zlib.crc32(b"IDAT" + rows)),
        ])  # fmt: skip
    if name == "jpg":
        data = bytearray(encoded(".jpg", 30, 50))
        at = data.index(b"\xff\xc0")
        data[at + 5 : at + 9] = struct.pack(">HH", LARGE, LARGE)
        return bytes(data)
    if name == "bmp":
        data = bytearray(encoded(".bmp", 30, 50))
        data[18:26] = struct.pack("<ii", LARGE, -LARGE)
        return bytes(data)
    if name == "tif":
        return tiff(
            "<", big=False, tags={256: LARGE, 257: LARGE, 258: 8, 259: 1, 262: 1, 273: 8, 277: 1, 278: 1, 279: 9}
        )
    if name == "webp":
        return b"RIFF\x20\0\0\0WEBPVP8X\x0a\0\0\0" + bytes(4) + 2 * LARGE.to_bytes(3, "little") + b"VP8L" + bytes(8)
    return f"P5\n{LARGE} {LARGE}\n255\n".encode() + bytes(100)


READ = """
import sys
for path in sys.argv[1:]:
    try:
        with sources.open(path) as source:
            list(source)
    except SourceError as error:
        assert "must have at most 134217728 pixels, got" in str(error), error
        print("refused")
"""
FIRST = "import cv2, numpy\nfrom dloftbs import sources\nfrom dloftbs.errors import SourceError"
LIES = ("png", "jpg", "bmp", "tif", "webp", "pgm")


def test_a_header_that_promises_gigabytes_is_refused(tmp_path: Path) -> None:
    for name in LIES:
        (tmp_path / f"a.{name}").write_bytes(lying(name))
    paths = [tmp_path / f"a.{name}" for name in LIES]
    assert run_bounded(READ, *paths, first=FIRST, extra_bytes=300 << 20) == "refused\n" * len(LIES)


def test_in_a_folder_it_is_reported_and_skipped(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for number, name in enumerate(LIES):
        (tmp_path / f"{number}.{name}").write_bytes(lying(name))
    (tmp_path / "9.png").write_bytes(encoded(".png", 30, 50))
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(tmp_path) as source:
        assert [frame.name for frame in source] == ["9.png"]
        assert source.skipped == len(LIES)
    assert caplog.text.count("must have at most 134217728 pixels") == len(LIES)


def test_a_file_of_gigabytes_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "a.png").open("wb") as file:
        file.truncate((1 << 30) + 1)  # takes no room on the disk
    with sources.open(tmp_path / "a.png") as source, pytest.raises(SourceError, match="at most 1073741824 bytes"):
        list(source)


def test_a_chunk_that_is_longer_than_its_png_is_not_made_room_for(tmp_path: Path) -> None:
    data = encoded(".png", 30, 50)
    at = data.index(b"IDAT") - 4
    chunk = struct.pack(">I", 2**31 - 1) + b"tEXt"
    for place in (at, len(data) - 12):
        path = tmp_path / "a.png"
        path.write_bytes(data[:place] + chunk + data[place:])
        with sources.open(path) as source, pytest.raises(SourceError, match="the PNG is cut off after"):
            list(source)
    path.write_bytes(data + b"what somebody put behind the end")
    with sources.open(path) as source:
        assert len(list(source)) == 1


def test_other_formats_are_named(tmp_path: Path) -> None:
    done, gif = (
        cv2.imencode(".gif", np.zeros((3, 4, 3), np.uint8)) if cv2.haveImageWriter("a.gif") else (True, b"GIF89a")
    )
    assert done
    (tmp_path / "a.png").write_bytes(bytes(gif))
    with sources.open(tmp_path / "a.png") as source, pytest.raises(SourceError, match=r"a\.png: .*no PNG, JPEG, BMP"):
        list(source)


def test_an_avif_that_is_cut_off_or_changed_does_no_harm(tmp_path: Path) -> None:
    Image = pytest.importorskip("PIL.Image")
    Image.fromarray(np.full((30, 50, 3), 90, np.uint8)).save(tmp_path / "a.avif")
    data = (tmp_path / "a.avif").read_bytes()
    assert read_size(data) == (30, 50)
    for length in range(len(data)):
        assert read_size(data[:length]) in (None, (30, 50))
    large = data.replace(struct.pack(">II", 50, 30), struct.pack(">II", LARGE, LARGE))
    (tmp_path / "b.avif").write_bytes(large)
    with sources.open(tmp_path / "b.avif") as source, pytest.raises(SourceError, match=r"b\.avif: must have at most"):
        list(source)


def test_a_video_that_promises_gigabytes_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.y4m"
    path.write_bytes(b"YUV4MPEG2 W15000 H15000 F30:1 Ip A0:0 C420jpeg\nFRAME\n" + bytes(1000))
    with pytest.raises(SourceError, match=r"a\.y4m: must have at most 134217728 pixels, got 15000 x 15000"):
        sources.open(path)
