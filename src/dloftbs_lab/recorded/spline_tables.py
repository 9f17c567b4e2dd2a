"""A table of splines beside a video or images, as the authors of DLOFTBs write it, and a plain form of it.

The authors' form was read off their public repository (PPI-PUT/cable_observer): the script that writes ``spline.csv``,
and the one such file in it. A row is a frame; the unnamed first column is its number. ``control_points_x`` and so on
hold the 25 coefficients of a cubic fit without its knots, so that only ``points_on_curve_x`` and so on, 256 points,
show the curve. Two things to know:

- What such a table holds is what their method found in each frame: a reference, but no truth by hand.
- Tables without z come from an older version, which wrote the row of the image as x and the column as y. In those with
  z, x is the column, and z is the depth in millimetres.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SourceError, source_errors
from dloftbs.sources.image_files import IMAGE_EXTENSIONS
from dloftbs.sources.source import logger
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.recorded.csv_rows import header_of, number, rows_of, whole
from dloftbs_lab.recorded.layout import Layout, RecordedSequence, files_in, folders_in, listed
from dloftbs_lab.recorded.pictures import PictureFile, VideoFrames, camera_in, images_in
from dloftbs_lab.recorded.through_points import truth_of
from dloftbs_lab.truth import Truth

TREE = """\
spline tables: one CSV file beside a video, images, or one folder of images
  folder/
    spline.csv            as the authors of DLOFTBs write it: a row per frame, whose lists points_on_curve_x, _y (and
                          _z, depth in millimetres) are in brackets, with image_filename or the frame's number first;
                          or columns frame,object,i,x,y or frame,object,i,x,y,z (z: depth in metres), a row per point
    cable.mp4             or images *.png, or one folder of images; camera.json may lie beside"""

VIDEO_EXTENSIONS = (".mp4", ".avi", ".mov", ".mkv", ".webm", ".m4v")
OUTPUT_FOLDER = "spline"
"""Here the authors' code writes pictures of its splines, which are no frames."""
LONG = ("frame", "object", "i", "x", "y")
AUTHORS = ("points_on_curve_x", "points_on_curve_y")
AUTHORS_Z = "points_on_curve_z"
AUTHORS_NAME = "image_filename"
AUTHORS_FRAME = ""
MILLIMETRE = 0.001


@dataclass(frozen=True)
class _Known:
    """Curves that a table has for one frame."""

    line: int
    frame: int
    image: str | None
    polylines: dict[int, FloatArray]


class SplineTable(RecordedSequence):
    """The frames of a video or of images that a table has curves for.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    SourceError
        If there is not one table and one video or set of images, or the table is wrong or speaks of other frames.
        Frames that are not in the table are left out, with a warning.
    """

    def __init__(self, folder: Path) -> None:
        tables = _tables_in(folder)
        if len(tables) != 1:
            raise SourceError(
                f"{folder}: needs one table of splines, found {listed([p.name for p in tables]) or 'none'}"
            )
        self._table = tables[0]
        self._camera = camera_in(folder)
        self._known = _read_table(self._table)
        self._video, images = _open_pictures(folder)
        self._images = {path.name: path for path in images}
        self._order = images
        super().__init__(folder, len(self._known), None if self._video is None else self._video.fps)
        self._check_frames(len(images) if self._video is None else self._video.count)

    def close(self) -> None:
        """Let go of the video."""
        super().close()
        if self._video is not None:
            self._video.close()

    def _check_frames(self, count: int | None) -> None:
        for known in self._known:
            named = self._video is None and known.image is not None
            if named and known.image not in self._images:
                raise SourceError(f"{self._table}, line {known.line}: there is no image {known.image!r}")
            if not named and not 0 <= known.frame < (math.inf if count is None else count):
                raise SourceError(f"{self._table}, line {known.line}: frame {known.frame} is none of the {count} there")
        if count is not None and count > len(self._known):
            logger.warning("%s: left out %d frames that are not in it", self._table, count - len(self._known))

    def _frame(self, index: int) -> Frame:
        known = self._known[index]
        if self._video is not None:
            image = self._video.read(known.frame)
            return Frame(image, camera=self._camera, index=index, name=f"{self._video.path.name}#{known.frame}")
        path = self._order[known.frame] if known.image is None else self._images[known.image]
        return PictureFile(path, self._camera).frame(index)

    def _truth(self, index: int) -> Truth:
        known = self._known[index]
        with source_errors(f"{self._table}, line {known.line}", InputError):
            return truth_of(list(known.polylines.values()), list(known.polylines), self._camera)


def _open_pictures(folder: Path) -> tuple[VideoFrames | None, list[Path]]:
    videos = [path for path in files_in(folder) if path.suffix.lower() in VIDEO_EXTENSIONS]
    images = {place: images_in(place) for place in (folder, *folders_in(folder)) if place.name != OUTPUT_FOLDER}
    found = [*videos, *(place for place, files in images.items() if files)]
    if len(found) != 1:
        kinds = f"one video ({', '.join(VIDEO_EXTENSIONS)}) or one folder of images ({', '.join(IMAGE_EXTENSIONS)})"
        raise SourceError(f"{folder}: needs {kinds}, found {listed([path.name for path in found]) or 'none'}")
    return (VideoFrames(videos[0]), []) if videos else (None, images[found[0]])


def _read_table(path: Path) -> list[_Known]:
    read: Callable[[Path], list[_Known]] = _read_authors if _is_authors(path) else _read_long
    known = sorted(read(path), key=lambda row: row.frame)
    if not known:
        raise SourceError(f"{path}: has no rows")
    for before, after in pairwise(known):
        if before.frame == after.frame:
            raise SourceError(f"{path}, line {after.line}: frame {after.frame} comes a second time")
    return known


def _read_authors(path: Path) -> list[_Known]:
    names = header_of(path)
    known = []
    for position, (line, row) in enumerate(rows_of(path, AUTHORS)):
        first, second = (_list(path, line, row, name) for name in AUTHORS)
        columns = [second, first]
        if AUTHORS_Z in names:
            columns = [first, second, _list(path, line, row, AUTHORS_Z) * MILLIMETRE]
        if len({len(column) for column in columns}) > 1:
            raise SourceError(f"{path}, line {line}: the lists differ in length: {[len(c) for c in columns]}")
        frame = whole(path, line, row, AUTHORS_FRAME) if AUTHORS_FRAME in names else position
        known.append(_Known(line, frame, row.get(AUTHORS_NAME), {1: np.stack(columns, axis=1)}))
    return known


def _list(path: Path, line: int, row: dict[str, str], name: str) -> FloatArray:
    """Return a list as Python or numpy writes it: in brackets, with or without commas."""
    text = row[name].strip()
    with source_errors(f"{path}, line {line}: {name} must be a list of numbers in brackets", ValueError):
        if not (text.startswith("[") and text.endswith("]")):
            raise ValueError("no brackets")
        values = np.array(text[1:-1].replace(",", " ").split(), dtype=np.float64)
    return values


def _read_long(path: Path) -> list[_Known]:
    columns = ["x", "y", "z"] if "z" in header_of(path) else ["x", "y"]
    lines: dict[int, int] = {}
    points: dict[int, dict[int, list[tuple[int, list[float]]]]] = {}
    for line, row in rows_of(path, LONG):
        frame, item, order = (whole(path, line, row, name) for name in LONG[:3])
        lines.setdefault(frame, line)
        point = [number(path, line, row, name) for name in columns]
        points.setdefault(frame, {}).setdefault(item, []).append((order, point))
    return [
        _Known(lines[frame], frame, None, {item: _in_order(rows) for item, rows in sorted(objects.items())})
        for frame, objects in points.items()
    ]


def _in_order(rows: list[tuple[int, list[float]]]) -> FloatArray:
    return np.array([point for _, point in sorted(rows, key=lambda row: row[0])])


def _is_authors(path: Path) -> bool:
    return set(AUTHORS) <= set(header_of(path))


def _tables_in(folder: Path) -> list[Path]:
    tables = [path for path in files_in(folder) if path.suffix == ".csv"]
    return [path for path in tables if _is_authors(path) or set(LONG) <= set(header_of(path))]


def _fits(folder: Path) -> bool:
    return bool(_tables_in(folder))


LAYOUT = Layout("spline tables", TREE, _fits, SplineTable)
