"""Images or masks with annotated polylines beside them, as JSON or CSV."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, source_errors
from dloftbs.sources.image_files import IMAGE_EXTENSIONS
from dloftbs.support.values import MAX_WHOLE
from dloftbs_lab.recorded.csv_rows import header_of, number, rows_of, whole
from dloftbs_lab.recorded.label_images import paired, refuse_two_truths
from dloftbs_lab.recorded.layout import Layout, RecordedSequence, files_in
from dloftbs_lab.recorded.pictures import CAMERA, PictureFile, by_stem, camera_in, decoded, images_in
from dloftbs_lab.recorded.through_points import truth_of
from dloftbs_lab.truth import Truth

TREE = """\
polylines: points (x, y) px along each object, for each image or mask
  folder/
    00.png                an image or a mask; STEM.mask.png, .depth.png, .occluders.png and camera.json may lie beside
    00.json               {"curves": [[[x, y], ...], ...], "ids": [1, ...]}, or only the list of curves
    01.png
    01.csv                columns object,x,y or object,x,y,z; points in order; z is depth in metres"""

COLUMNS = ("object", "x", "y")
Points = list[tuple[float, ...]]


class _Annotation(msgspec.Struct):
    curves: list[Points]
    ids: list[Annotated[int, msgspec.Meta(ge=-MAX_WHOLE, le=MAX_WHOLE)]] | None = None


class AnnotatedImages(RecordedSequence):
    """Images or masks, each with polylines. A polyline becomes the cubic spline through its points.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    SourceError
        If polylines are without their image, or twice there, or two images have one stem. Images without polylines are
        left out, with a warning.
    """

    def __init__(self, folder: Path) -> None:
        truths = {path.stem: path for path in _annotations_in(folder)}
        images = by_stem(images_in(folder))
        refuse_two_truths(folder, images)
        self._pairs = paired(folder, images, truths, f"an image {'|'.join(IMAGE_EXTENSIONS)}")
        self._camera = camera_in(folder)
        super().__init__(folder, len(self._pairs))

    def _frame(self, index: int) -> Frame:
        return PictureFile(self._pairs[index][0], self._camera).frame(index)

    def _truth(self, index: int) -> Truth:
        path = self._pairs[index][1]
        known = _read_json(path) if path.suffix == ".json" else _read_csv(path)
        with source_errors(path, InputError):
            return truth_of(known.curves, known.ids, self._camera)


def _read_json(path: Path) -> _Annotation:
    known = decoded(path, _Annotation | list[Points])
    return known if isinstance(known, _Annotation) else _Annotation(known)


def _read_csv(path: Path) -> _Annotation:
    objects: dict[int, Points] = {}
    columns = [*COLUMNS[1:], "z"] if "z" in header_of(path) else COLUMNS[1:]
    for line, row in rows_of(path, COLUMNS):
        point = tuple(number(path, line, row, name) for name in columns)
        objects.setdefault(whole(path, line, row, "object"), []).append(point)
    return _Annotation(list(objects.values()), list(objects))


def _annotations_in(folder: Path) -> list[Path]:
    return [path for path in files_in(folder) if path.suffix in (".json", ".csv") and path.name != CAMERA]


def _fits(folder: Path) -> bool:
    stems = {path.stem for path in images_in(folder)}
    return any(path.stem in stems for path in _annotations_in(folder))


LAYOUT = Layout("polylines", TREE, _fits, AnnotatedImages)
