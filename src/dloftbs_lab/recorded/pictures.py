"""Files beside the truth: images, masks, depth, occluders, the camera."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SourceError, source_errors
from dloftbs.sources.image_files import IMAGE_EXTENSIONS
from dloftbs.sources.pixel_values import read_depth, read_mask
from dloftbs.sources.pixels import Picture, log_remarks, read_image_or_mask, read_picture
from dloftbs.sources.video_file import VideoFile
from dloftbs.sources.video_picture import VideoPicture
from dloftbs.support.arrays import AnyArray
from dloftbs.support.documents import parse_json
from dloftbs_lab.recorded.layout import files_in

CAMERA = "camera.json"
CAMERA_FILES = (CAMERA, "camera.yaml", "camera.yml")
PARTNERS = (".labels", ".mask", ".depth", ".occluders")
"""Endings, before the suffix, of the files that go with an image of the same name."""


def images_in(folder: Path) -> list[Path]:
    """Return the images of a folder in natural order, without those that go with others."""
    return [p for p in files_in(folder) if p.suffix.lower() in IMAGE_EXTENSIONS and Path(p.stem).suffix not in PARTNERS]


def by_stem(images: Iterable[Path]) -> dict[str, Path]:
    """Return the images of a folder by their stems, under which their truth lies.

    Raises
    ------
    SourceError
        If two have one stem.
    """
    of_stem: dict[str, Path] = {}
    for path in images:
        other = of_stem.setdefault(path.stem, path)
        if other is not path:
            raise SourceError(
                f"{path.parent}: images must have different stems, got {other.name} and {path.name}; keep one of them, "
                f"and if the other is its mask, name that {path.stem}.mask.png"
            )
    return of_stem


@dataclass(frozen=True)
class PictureFile:
    """An image or a mask in a file, with what goes with it.

    That is STEM.mask.png, STEM.depth.png or STEM.depth.npy, and STEM.occluders.png.
    """

    path: Path
    camera: PinholeCamera | None = None

    def frame(self, index: int) -> Frame:
        """Read the frame; one channel, or equal ones, are a mask, as for `sources.open`.

        Raises
        ------
        SourceError
            If a file cannot be read.
        """
        image, mask = read_image_or_mask(self.path, "auto")
        beside = mask_beside(self.path)
        if beside is not None:
            mask, image = beside, photograph(self.path, beside.shape)
        depth, occluders = depth_beside(self.path), occluders_beside(self.path)
        return Frame(image, mask, depth, occluders, self.camera, index=index, name=self.path.name)


def photograph(path: Path, size: tuple[int, int]) -> AnyArray:
    """Read a photograph, shape (H, W, 3), whose truth has a size, (H, W): as it was stored, or as viewers show it.

    People label what a viewer shows them, and programs what the sensor gave; where both have the size, it is as stored.

    Raises
    ------
    SourceError
        If it cannot be read.
    """
    picture = read_picture(path, "image")
    if _size(picture) != size and _size(upright := read_picture(path, "image", upright=True)) == size:
        picture = upright
    log_remarks(path, picture)
    assert picture.image is not None  # as was asked for
    return picture.image


def _size(picture: Picture) -> tuple[int, ...]:
    return () if picture.image is None else picture.image.shape[:2]


def mask_beside(path: Path) -> AnyArray | None:
    """Read the mask that goes with an image, shape (H, W): STEM.mask.png; None where there is none.

    Raises
    ------
    SourceError
        If it cannot be read.
    """
    beside = path.with_name(f"{path.stem}.mask.png")
    return read_mask(beside) if os.path.exists(beside) else None


def depth_beside(path: Path) -> AnyArray | None:
    """Read the depth that goes with an image: STEM.depth.png of 16 bits, or STEM.depth.npy; None where there is none.

    Raises
    ------
    SourceError
        If it cannot be read.
    """
    for suffix in (".png", ".npy"):
        beside = path.with_name(f"{path.stem}.depth{suffix}")
        if os.path.exists(beside):
            return read_depth(beside)
    return None


def occluders_beside(path: Path) -> AnyArray | None:
    """Read the occluders that go with an image: STEM.occluders.png; None where there are none.

    Raises
    ------
    SourceError
        If they cannot be read.
    """
    beside = path.with_name(f"{path.stem}.occluders.png")
    return read_mask(beside) if os.path.exists(beside) else None


def camera_in(folder: Path) -> PinholeCamera | None:
    """Read camera.json or camera.yaml in any form that `PinholeCamera.from_file` takes; None where there is none.

    Raises
    ------
    SourceError
        If it cannot be read.
    """
    paths = (folder / name for name in CAMERA_FILES)
    return next((PinholeCamera.from_file(path) for path in paths if os.path.exists(path)), None)


def decoded(path: Path, kind: Any) -> Any:
    """Read a JSON file as a type.

    Raises
    ------
    SourceError
        If it cannot be read, or holds something else.
    """
    with source_errors(path, (OSError, InputError)):
        return parse_json(path.read_bytes(), kind)


class VideoFrames:
    """The pictures of a video by number, in any order; a later one costs least.

    A video is decoded from its start, since seeking in one is exact with some codecs only.

    Parameters
    ----------
    path : Path

    Raises
    ------
    SourceError
        If it cannot be opened as a video.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = VideoFile(path)
        self.fps = self._file.fps
        self.count = self._file.count()
        self._pictures: Iterator[VideoPicture] | None = None
        self._next = 0

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.path,)

    def read(self, number: int) -> AnyArray:
        """Return a picture, shape (H, W, 3), BGR.

        Raises
        ------
        SourceError
            If there is none of the number, or it cannot be decoded.
        """
        if self._pictures is None or number < self._next:
            self.close()
            self._pictures = self._file.pictures(lambda first, count: None, lambda known, damage: None)
        for picture in self._pictures:
            self._next = picture.index + 1
            if picture.index == number:
                return picture.bgr()
            if picture.index > number:
                break
        count = self._next
        self.close()
        raise SourceError(f"{self.path}: has no picture {number}; {count} could be decoded")

    def close(self) -> None:
        """Let go of the file; reading again opens it again."""
        self._file.close()
        self._pictures = None
        self._next = 0
