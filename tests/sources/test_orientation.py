"""EXIF orientation: what stands beside a picture is for its pixels as stored, and a picture alone is turned."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from picture_files import BAR, COLOUR, Image, only, pillow, plain_tiff, save, tiff

from dloftbs import PinholeCamera, detect, sources
from dloftbs.errors import InputError
from dloftbs.sources.orientation import MEANINGS, read_orientation
from dloftbs_lab import open_labelled

ImageOps = pytest.importorskip("PIL.ImageOps")
FORMATS = ("JPEG", "PNG", "WEBP", "TIFF")
LOSSLESS: dict[str, dict[str, Any]] = {"JPEG": {"quality": 95, "subsampling": 0}, "WEBP": {"lossless": True}}
CAMERA = PinholeCamera(60.0, 60.0, 20.0, 30.0, size=(48, 64))


def picture(path: Path, orientation: int | None, pixels: np.ndarray = COLOUR) -> Path:
    format = {".jpg": "JPEG", ".tif": "TIFF"}.get(path.suffix, path.suffix[1:].upper())
    return save(path, pillow(pixels, format, orientation=orientation, **LOSSLESS.get(format, {})))


def near(image: np.ndarray | None, expected: np.ndarray) -> bool:
    return image is not None and image.shape == expected.shape and np.abs(image.astype(int) - expected).max() < 60


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_picture_alone_is_as_viewers_show_it(tmp_path: Path, format: str, orientation: int) -> None:
    path = picture(tmp_path / f"a.{format.lower()}", orientation)
    with Image.open(path) as opened:
        shown = np.asarray(ImageOps.exif_transpose(opened))[..., ::-1]
    assert read_orientation(path.read_bytes()) == orientation
    assert near(only(sources.open(path)).image, shown)
    stored = only(sources.open(path, camera=PinholeCamera(60, 60, 20, 30))).image
    assert near(stored, COLOUR[..., ::-1])


@pytest.mark.parametrize("beside", ["camera", "depth", "occluders"])
def test_detect_takes_stored_pixels_where_something_stands_beside_them(tmp_path: Path, beside: str) -> None:
    path = picture(tmp_path / "a.png", 3)
    given = {"camera": CAMERA, "depth": np.full(BAR.shape, 700, np.uint16), "occluders": np.zeros(BAR.shape, np.uint8)}
    alone = detect(path, hsv="0:179,0:255,0:255")
    assert near(alone.frame.image, COLOUR[::-1, ::-1, ::-1])
    stored = detect(path, hsv="0:179,0:255,0:255", **{beside: given[beside]})
    assert near(stored.frame.image, COLOUR[..., ::-1])


@pytest.mark.parametrize("name", ["a.jpg", "a.png", "a.webp", "a.tif"])
@pytest.mark.parametrize("beside", ["camera", "depth", "masks", "occluders"])
@pytest.mark.parametrize("orientation", [3, 6])
def test_what_stands_beside_a_picture_is_for_its_stored_pixels(
    tmp_path: Path, name: str, beside: str, orientation: int, caplog: pytest.LogCaptureFixture
) -> None:
    path = picture(tmp_path / name, orientation)
    depth = save(tmp_path / "depth.tif", plain_tiff([np.full(BAR.shape, 700, np.uint16)]))
    mask = save(tmp_path / "mask.png", pillow(BAR, "PNG"))
    given = {"camera": CAMERA, "depth": depth, "masks": mask, "occluders": mask}
    with caplog.at_level(logging.WARNING, "dloftbs.sources"):
        frame = only(sources.open(path, **{beside: given[beside]}))
    assert near(frame.image, COLOUR[..., ::-1])
    if beside != "camera":
        assert getattr(frame, {"masks": "mask"}.get(beside, beside)) is not None
    assert caplog.text.count(f"{name}: viewers and cv2.imread show it {MEANINGS[orientation]}") == 1
    assert "cv2.IMREAD_IGNORE_ORIENTATION" in caplog.text


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.webp", "a.tif"])
def test_metres_do_not_depend_on_the_orientation(tmp_path: Path, name: str) -> None:
    rows = np.linspace(700, 1400, 48)[:, None]  # a plane that is not level, and a camera off its centre
    save(tmp_path / "d.tif", plain_tiff([np.broadcast_to(rows, (48, 64)).astype(np.uint16)]))
    lengths = []
    for orientation in (None, *range(2, 9)):
        mask = picture(tmp_path / name, orientation, BAR // 200 * 255)
        (found,) = detect(only(sources.open(mask, depth=tmp_path / "d.tif", camera=CAMERA)))
        assert found.curve_3d is not None
        lengths.append((found.curve_3d.length, *found.curve_3d(0.0)))
    assert len(set(lengths)) == 1
    assert lengths[0][0] == pytest.approx(54 * 1.02 / CAMERA.fx, rel=0.1)


def test_pictures_of_a_folder_are_reported_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for number, orientation in enumerate((1, 3, 3, 6, 6)):
        picture(tmp_path / f"{number}.jpg", orientation)
    with caplog.at_level(logging.WARNING, "dloftbs.sources"), sources.open(tmp_path, camera=CAMERA) as source:
        assert [frame.size for frame in source] == [(48, 64)] * 5
    assert [record.message.split(":")[0] for record in caplog.records] == ["1.jpg", "3.jpg"]


def test_pages_are_turned_as_files_are(tmp_path: Path) -> None:
    path = save(tmp_path / "a.tif", tiff([COLOUR, COLOUR], tiffinfo={274: 6}))
    with sources.open(path) as source:
        assert [frame.size for frame in source] == [(64, 48)] * 2
    with sources.open(path, camera=CAMERA) as source:
        assert [frame.size for frame in source] == [(48, 64)] * 2


def test_a_camera_of_turned_pictures_is_refused_with_what_helps(tmp_path: Path) -> None:
    turned = PinholeCamera(60.0, 60.0, 30.0, 20.0, size=(64, 48))
    with (
        sources.open(picture(tmp_path / "a.jpg", 6), camera=turned) as source,
        pytest.raises(InputError, match=r"sides are swapped.*turned by 90 degrees.*cv2\.IMREAD_IGNORE_ORIENTATION"),
    ):
        list(source)


def test_labels_and_palettes_are_turned_like_colours(tmp_path: Path) -> None:
    image = Image.fromarray((BAR > 0).astype(np.uint8), "P")
    image.putpalette([0, 0, 0, 255, 0, 0])
    exif = Image.Exif()
    exif[274] = 6
    image.save(tmp_path / "a.png", exif=exif)
    np.testing.assert_array_equal(only(sources.open(tmp_path / "a.png")).mask, cv2.rotate(BAR, 0) > 0)
    np.testing.assert_array_equal(only(sources.open(tmp_path / "a.png", camera=CAMERA)).mask, BAR > 0)


def test_a_broken_block_is_no_orientation() -> None:
    data = pillow(COLOUR, "JPEG", orientation=6)
    assert read_orientation(data) == 6
    assert all(read_orientation(data[:end]) in (1, 6) for end in range(200))
    at = data.index(b"Exif\0\0") + 6
    rng = np.random.default_rng(0)
    for _ in range(500):
        noisy = bytearray(data)
        noisy[at + int(rng.integers(40))] = int(rng.integers(256))
        assert read_orientation(bytes(noisy)) in range(1, 9)


@pytest.mark.parametrize(("ending", "layout"), [(".labels", "labels"), ("_mask_all", "ariadne"), (".mask", "auto")])
@pytest.mark.parametrize("labelled_upright", [False, True])
def test_truth_is_for_the_stored_pixels_or_for_those_of_a_viewer_by_its_size(
    tmp_path: Path, ending: str, layout: str, labelled_upright: bool
) -> None:
    path = picture(tmp_path / "0.jpg", 6)
    with Image.open(path) as opened:
        shown = np.asarray(ImageOps.exif_transpose(opened))[..., ::-1]
    labels = np.rot90(BAR, -1) if labelled_upright else BAR
    save(tmp_path / f"0{ending}.png", pillow(np.ascontiguousarray(labels), "PNG"))
    (tmp_path / "0.txt").write_text("2 1 1 9 9\n")
    if layout == "auto":
        (tmp_path / "0.json").write_text('{"curves": [[[1, 1], [9, 9]]]}')
        (tmp_path / "0.txt").unlink()
    frame = open_labelled(tmp_path, layout).frame(0)
    assert near(frame.image, shown if labelled_upright else COLOUR[..., ::-1])
    np.testing.assert_array_equal(frame.mask != 0, labels > 0)
