"""The layout that `dloftbs_lab.write_sequence` leaves."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SourceError, source_errors
from dloftbs.sources.pixels import load_npy, read_pixels
from dloftbs.sources.source import logger
from dloftbs.support.arrays import AnyArray
from dloftbs.support.documents import parse_json
from dloftbs.support.values import MILLIMETRE_M
from dloftbs_lab.recorded.layout import Layout, RecordedSequence
from dloftbs_lab.recorded.pictures import VideoFrames, decoded
from dloftbs_lab.truth import Truth

TREE = """\
written: what dloftbs_lab.write_sequence leaves
  folder/
    sequence.json
    truth.jsonl           a line per frame
    images/000000.png     or images.mp4; beside it masks/, depth/, occluders/, instances/, visible/ as there are"""

HEADER = "sequence.json"
RECORDS = "truth.jsonl"
VIDEO = "images.mp4"
_TYPE = re.compile("[<>|][biuf](1|2|4|8|16)")
"""Of masks and depth, as numpy writes it."""
PER_METRE = 1000
"""Depth in PNG is in millimetres."""


class _Header(msgspec.Struct):
    format: Literal["dloftbs sequence 1"]
    name: str
    fps: float | None
    length: int


class _Stored(msgspec.Struct):
    file: str
    type: str


class _Record(msgspec.Struct):
    index: int
    stamp: float | None
    name: str
    size: tuple[int, int]
    camera: dict[str, Any] | None
    mask: _Stored | None
    depth: _Stored | None
    occluders: _Stored | None
    visible: str | None
    truth: dict[str, Any]
    image: str | None
    mask_is: str = "auto"
    depth_unit_m: float = MILLIMETRE_M
    instances: _Stored | None = None
    grippers: list[list[float]] | None = None


class WrittenSequence(RecordedSequence):
    """A sequence that `dloftbs_lab.write_sequence` wrote; one whose writing was interrupted has the frames so far.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    SourceError
        If the header or the list of frames cannot be read, or there is no whole frame.
    """

    def __init__(self, folder: Path) -> None:
        header = decoded(folder / HEADER, _Header)
        self.folder = folder
        self._starts = _line_starts(folder / RECORDS)
        self._video = VideoFrames(folder / VIDEO) if os.path.exists(folder / VIDEO) and self._uses_video() else None
        count = len(self._starts)
        if self._video is not None:
            count = min(count, self._video.count)  # a killed writer owes the video its last picture
        if count == 0 < header.length:
            raise SourceError(f"{folder}: holds none of its {header.length} frames; its writing was interrupted")
        super().__init__(folder, count, header.fps)
        if count != header.length:
            logger.warning("%s: holds %d of %d frames; its writing was interrupted", folder, count, header.length)
        self.name = header.name

    def close(self) -> None:
        """Let go of the video."""
        super().close()
        if self._video is not None:
            self._video.close()

    def _frame(self, index: int) -> Frame:
        record = self._record(index)
        return Frame(
            image=None if record.image is None else self._image(index, record),
            mask=None if record.mask is None else self._mask(record.mask),
            depth=None if record.depth is None else self._depth(record.depth),
            occluders=None if record.occluders is None else self._mask(record.occluders),
            camera=None if record.camera is None else PinholeCamera.from_dict(record.camera),
            index=record.index,
            stamp=record.stamp,
            name=record.name,
            depth_unit_m=record.depth_unit_m,
            mask_is=record.mask_is,
            instances=None if record.instances is None else self._mask(record.instances),
            grippers=None if record.grippers is None else np.reshape(record.grippers, (-1, 4)),
        )

    def _truth(self, index: int) -> Truth:
        record = self._record(index)
        masks: tuple[AnyArray, ...] = ()
        if record.visible is not None:
            labels = self._pixels(record.visible)
            masks = tuple(labels == number for number in range(1, len(record.truth.get("ids", ())) + 1))
        return Truth.from_dict(record.truth, masks)

    def _uses_video(self) -> bool:
        return bool(self._starts) and self._record(0).image == VIDEO

    def _record(self, index: int) -> _Record:
        path = self.folder / RECORDS
        with source_errors(f"{path}, line {index + 1}", (OSError, InputError)), path.open("rb") as file:
            file.seek(self._starts[index])
            return parse_json(file.readline(), _Record)

    def _image(self, index: int, record: _Record) -> AnyArray:
        if record.image != VIDEO or self._video is None:
            return self._pixels(str(record.image))
        rows, columns = record.size
        return self._video.read(index)[:rows, :columns]  # videos have even sizes

    def _mask(self, stored: _Stored) -> AnyArray:
        pixels = self._pixels(stored.file)
        return pixels > 0 if stored.type == np.dtype(np.bool_).str else pixels

    def _depth(self, stored: _Stored) -> AnyArray:
        pixels = self._pixels(stored.file)
        if pixels.dtype.str == stored.type:
            return pixels
        return (pixels / PER_METRE).astype(_type(stored))

    def _pixels(self, name: str) -> AnyArray:
        path = self.folder / name
        if path.suffix == ".npy":
            return load_npy(path)
        with source_errors(path):
            return read_pixels(path)


def _type(stored: _Stored) -> np.dtype[Any]:
    with source_errors(stored.file, TypeError):
        if _TYPE.fullmatch(stored.type) is None:
            raise TypeError(f"its type must be such as '|b1', '<u2' or '<f4', got {stored.type!r}")
        return np.dtype(stored.type)


def _line_starts(path: Path) -> list[int]:
    """Return where the whole lines of a file begin; what a killed writer left of another is none."""
    try:
        with path.open("rb") as file:
            ends = [0]
            for line in file:
                if line.endswith(b"\n"):
                    ends.append(ends[-1] + len(line))
    except OSError as error:
        raise SourceError(f"{path}: cannot be read: {error.strerror or error}") from error
    return ends[:-1]


def _fits(folder: Path) -> bool:
    return os.path.isfile(folder / HEADER)


LAYOUT = Layout("written", TREE, _fits, WrittenSequence)
