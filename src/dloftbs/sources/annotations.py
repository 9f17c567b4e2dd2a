"""Masks of objects in files of annotation tools and data sets: COCO, SAM, labelme, YOLO.

Coordinates of polygons are pixels, rounded to whole ones; the pixels that an outline runs through belong to the object,
so that no thin cable is broken. Lines are drawn by their exact width.
"""

from __future__ import annotations

import base64
import binascii
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

import msgspec
import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_pixels import curve_mask
from dloftbs.data.instance_labels import Labels, Size, as_labels, paint
from dloftbs.errors import InputError, SourceError, source_errors
from dloftbs.sources.pixels import MAX_PIXELS, check_pixels, decode, read_bytes
from dloftbs.sources.source import logger
from dloftbs.support.arrays import AnyArray
from dloftbs.support.documents import parse_json
from dloftbs.support.values import check_size, shown

ANNOTATION_SUFFIXES = (".json", ".txt")
"""Of files that hold the masks of a frame as polygons or run lengths."""
_WIDTH = re.compile(r"width_px=(\d{1,4}(?:\.\d{1,6})?)")
"""Description of a line that is as wide as an object."""
_WHOLE = re.compile(r"0|[1-9][0-9]{0,17}")
"""Text of a whole number of 64 bits."""
_THINNEST_PX = 1.0
"""Width of the thinnest line that is drawn, px.

Source: geometry; thinner ones lie between the centres of pixels, and are broken.
"""
_CORNERS = 3
"""Corners of the smallest polygon with an area.

Source: geometry.
"""
_BOX_VALUES = 4
"""Values of a box: the two of its centre, width, height.

Source: YOLO's format of detection.
"""


class _Image(msgspec.Struct):
    file_name: str = ""
    id: int | float | str | None = None
    height: int | float | None = None
    width: int | float | None = None

    @property
    def size(self) -> Size | None:
        return _size(self.height, self.width)


class _Annotation(msgspec.Struct):
    """Annotation of COCO or SAM, or bare run lengths, which are its segmentation."""

    image_id: int | float | str | None = None
    segmentation: Any = None
    size: Any = None
    counts: Any = None

    def __post_init__(self) -> None:
        if self.segmentation is None and self.counts is not None:
            self.segmentation = {"size": self.size, "counts": self.counts}


class _Shape(msgspec.Struct):
    points: Any = None
    shape_type: str | None = "polygon"
    label: int | float | str | None = None
    group_id: int | float | str | None = None
    mask: str | None = None
    description: str | None = None


class _Document(msgspec.Struct, rename={"height": "imageHeight", "width": "imageWidth"}):
    """Any of the formats: COCO has images, SAM's data set an image, labelme shapes."""

    images: list[_Image] | None = None
    annotations: list[_Annotation] | None = None
    image: _Image | None = None
    shapes: list[_Shape] | None = None
    height: int | float | None = None
    width: int | float | None = None


def read_annotations(path: Path, size: Size | None = None) -> Labels:
    """Return the label image (H, W) of one frame's file.

    Parameters
    ----------
    path : Path
        JSON of labelme (polygons and masks; all other shapes are left out with a warning), JSON of SAM (a list of
        dictionaries, or a file of its data set), COCO with one image; or text of YOLO (``class x y x y ...``, in shares
        of the frame's size; a confidence and the number of a track behind the last corner are left out).
    size : (int, int), optional
        ``(H, W)`` of the frame; needed by YOLO, and by a file that does not say it.

    Raises
    ------
    SourceError
        If the file cannot be read or is of another format, or its size differs from the frame's.
    """
    with source_errors(path, (InputError, SourceError)):
        if path.suffix.lower() == ".txt":
            return _of_yolo(read_bytes(path), size, path)
        return _of_json(_parse(read_bytes(path)), size, path)


def read_coco(path: Path) -> CocoFile | None:
    """Return the annotations of COCO in a file; None where it is of another format.

    Raises
    ------
    SourceError
        If the file cannot be read, or is no JSON of annotations.
    """
    with source_errors(path, (InputError, SourceError)):
        document = _parse(read_bytes(path))
    if isinstance(document, list) or document.images is None or document.annotations is None:
        return None
    return CocoFile(path, document.images, document.annotations)


class CocoFile:
    """Annotations of many frames in one file of COCO, by the names of their pictures.

    Parameters
    ----------
    path : Path
        For messages.
    images, annotations : sequence
        As the file holds them.
    """

    def __init__(self, path: Path, images: Sequence[_Image], annotations: Sequence[_Annotation]) -> None:
        self.count = len(images)
        self._path = path
        self._images: dict[str, list[_Image]] = {}
        for image in images:
            self._images.setdefault(_base_name(image.file_name), []).append(image)
        self._annotations: dict[int | float | str | None, list[_Annotation]] = {}
        known = {_key(image.id) for image in images}
        boxes = sum(not annotation.segmentation for annotation in annotations)
        if boxes:
            logger.warning(
                "%s: left out %d of %d annotations, which have no segmentation", path, boxes, len(annotations)
            )
        for annotation in annotations:
            self._annotations.setdefault(_key(annotation.image_id), []).append(annotation)
        lost = sum(len(some) for key, some in self._annotations.items() if key not in known)
        if lost:
            logger.warning(
                "%s: left out %d of %d annotations, whose image_id is the id of no image", path, lost, len(annotations)
            )

    def check_names(self, paths: Sequence[Path]) -> None:
        """Refuse a file in which no image is named as a frame.

        Raises
        ------
        SourceError
            With a name of either.
        """
        if not any(path.name in self._images for path in paths):
            has = f"such as {next(iter(self._images))!r}" if self._images else "none at all"
            raise SourceError(f"{self._path}: no file_name is that of a frame, such as {paths[0].name!r}; it has {has}")

    def read(self, frame: Path | None, size: Size | None) -> Labels:
        """Return the label image (H, W) of the frame in a file, by its name; of several of one name, by its folders.

        Where the folders of several are those of the frame, it is the image with most of them. Without a file, it is
        the only image.

        Raises
        ------
        SourceError
            If it is not among the images, or more than once, or an annotation is wrong.
        """
        image = self._only_image() if frame is None else self._image_of(frame)
        try:
            return self.labels_of(image, size)
        except InputError as error:
            name = "" if frame is None else f"{frame.name}: "
            raise SourceError(f"{self._path}: {name}{error}") from error

    def labels_of(self, image: _Image, size: Size | None) -> Labels:
        """Return the label image (H, W) of one of the images.

        Raises
        ------
        InputError
            If an annotation is wrong.
        """
        return _of_annotations(self._annotations.get(_key(image.id), []), size, image.size, self._path)

    def _only_image(self) -> _Image:
        ((image,),) = self._images.values()
        return image

    def _image_of(self, frame: Path) -> _Image:
        images = self._images.get(frame.name, [])
        if len(images) > 1:
            fitting = [image for image in images if _ends_with(frame, image.file_name)]
            most = max((len(_parts(image.file_name)) for image in fitting), default=0)
            images = [image for image in fitting if len(_parts(image.file_name)) == most]
        if len(images) != 1:
            count = f"{len(images)} images that are" if images else "no image that is"
            raise SourceError(f"{self._path}: has {count} named {frame.name!r}")
        return images[0]


def _key(number: float | str | None) -> int | float | str | None:
    """Return an id as a number where it is the text of a whole one, as tools write it in one place of two."""
    return int(number) if isinstance(number, str) and _WHOLE.fullmatch(number) else number


def _parse(data: bytes) -> Any:
    return parse_json(data, _Document | list[_Annotation])


def _of_json(document: _Document | list[_Annotation], size: Size | None, path: Path) -> Labels:
    if isinstance(document, list):
        _check_listed(document)
        return _of_annotations(document, size, None, path)
    if document.shapes is not None:
        known = _one_size(size, _size(document.height, document.width))
        return paint(_of_shapes(document.shapes, known, path), known)
    images = [document.image] if document.image is not None else document.images or []
    if document.annotations is None or len(images) != 1:
        raise InputError("must be JSON of labelme ('shapes'), of SAM, or of COCO with one image ('annotations')")
    (image,) = images
    if image.id is None:
        return _of_annotations(document.annotations, size, image.size, path)
    return CocoFile(path, images, document.annotations).labels_of(image, size)


def _check_listed(annotations: Sequence[_Annotation]) -> None:
    """Refuse a list that holds something else than the masks of one image.

    Raises
    ------
    InputError
        If one has no mask, or they belong to several images.
    """
    boxes = [number for number, one in enumerate(annotations) if one.segmentation is None]
    if boxes:
        raise InputError(
            f"[{boxes[0]}] must have the key 'segmentation', or 'size' and 'counts'; a box alone is no mask"
        )
    images = {_key(one.image_id) for one in annotations}
    if len(images) > 1:
        raise InputError(
            f"must hold the masks of one image, got a list with {len(images)} different image_id; give COCO's file "
            "with 'images' and these as its 'annotations', or a list in a file for each frame"
        )


def _size(height: float | None, width: float | None) -> Size | None:
    """Return the size that a file says, in whole numbers; None where it says none."""
    if height is None or width is None:
        return None
    return check_size("size of the picture", (int(height), int(width)))


def _one_size(size: Size | None, own: Size | None) -> Size:
    """Return the size of the frame, if a file says no other."""
    if size is not None and own not in (None, size):
        raise InputError(f"is for pictures of the size {own} (rows, columns), and the frame has {size}")
    found = size or own
    if found is None:
        raise InputError("does not say the size of the picture, which is needed beside it")
    check_pixels(*found)
    return found


def _of_annotations(annotations: Sequence[_Annotation], size: Size | None, own: Size | None, path: Path) -> Labels:
    if size is None and own is None:
        own = next((_size_of(one.segmentation) for one in annotations), None)
    known = _one_size(size, own)
    return paint((_of_segmentation(one.segmentation, known, path) for one in annotations), known)


def _size_of(segmentation: Any) -> Size | None:
    """Return the size that run lengths say; None of polygons."""
    match segmentation:
        case {"size": [int(rows), int(columns)]}:
            return _size(rows, columns)
    return None


def _of_segmentation(segmentation: Any, size: Size, path: Path) -> AnyArray:
    """Return the mask (H, W) of run lengths, or of polygons, which are the parts of one object."""
    if isinstance(segmentation, dict):
        return as_labels([{"segmentation": segmentation}], size)
    segmentation = segmentation or []  # a box alone
    if not isinstance(segmentation, list):
        raise InputError(f"a segmentation must be run lengths or polygons, got {shown(segmentation)}")
    polygons = segmentation if not segmentation or isinstance(segmentation[0], list) else [segmentation]
    canvas = np.zeros(size, np.uint8)
    for polygon in polygons:
        _fill(canvas, polygon, path)
    return canvas


def _of_shapes(shapes: Sequence[_Shape], size: Size, path: Path) -> Iterator[AnyArray]:
    """Yield the mask (H, W) of each object of labelme; shapes of one group are its parts."""
    groups: dict[object, list[_Shape]] = {}
    for number, shape in enumerate(shapes):
        kind = shape.shape_type or "polygon"
        if kind in ("polygon", "mask") or _width_of(shape) is not None:
            key = number if shape.group_id is None else (shape.label, shape.group_id)
            groups.setdefault(key, []).append(shape)
        else:
            what = "only polygons, masks, and lines that are described by width_px=... have an area"
            logger.warning("%s: left out the %s %r: %s", path, kind, shape.label, what)
    for group in groups.values():
        canvas = np.zeros(size, np.uint8)
        for shape in group:
            width = _width_of(shape)
            if width is not None:
                _draw(canvas, shape.points, width, path)
            elif shape.shape_type == "mask":
                _paste(canvas, shape)
            else:
                _fill(canvas, shape.points, path)
        yield canvas


def _fill(canvas: AnyArray, polygon: Any, path: Path) -> None:
    """Set the pixels of a polygon, [x, y, x, y, ...] or [[x, y], ...]; one below three corners has a warning alone."""
    points = _points_of("a polygon", polygon)
    if len(points) < _CORNERS:
        logger.warning("%s: left out a polygon of %d corners: three or more have an area", path, len(points))
        return
    import cv2

    cv2.fillPoly(canvas, [np.rint(points).astype(np.int32)], 1)


def _draw(canvas: AnyArray, line: Any, width: float, path: Path) -> None:
    """Set the pixels whose centre lies within half a width, px, of a line [[x, y], ...]; its ends are flat."""
    points = _points_of("a linestrip", line)
    steps = np.hypot(*np.diff(points, axis=0).T)
    moves = steps > 0.0
    if not moves.any():
        logger.warning("%s: left out a linestrip: it has no two points that differ", path)
        return
    points = points[np.append(True, moves)]
    places = np.append(0.0, np.cumsum(steps[moves])) / steps.sum()
    is_loop = np.array_equal(points[0], points[-1])
    curve = BSplineCurve(np.pad(places, 1, "edge"), points, 1, closed=is_loop)
    size = (int(canvas.shape[0]), int(canvas.shape[1]))
    canvas |= curve_mask(curve, max(width, _THINNEST_PX), size)


def _points_of(what: str, given: Any) -> AnyArray:
    try:
        points = np.array(given, np.float64).reshape(-1, 2)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{what} must be pairs of numbers, got {shown(given)}") from error
    if not (np.abs(points) <= MAX_PIXELS).all():
        raise InputError(f"{what} must be in pixels, {-MAX_PIXELS} to {MAX_PIXELS}, got {shown(given)}")
    return points


def _width_of(shape: _Shape) -> float | None:
    """Return the width of a line, px, as `sinks.LabelmeSink` describes it; None of all else."""
    found = _WIDTH.fullmatch(shape.description or "") if shape.shape_type == "linestrip" else None
    return None if found is None else float(found[1])


def _paste(canvas: AnyArray, shape: _Shape) -> None:
    """Set the pixels of a mask of labelme, a PNG between two corners."""
    try:
        pixels = decode(base64.b64decode(shape.mask or "", validate=True))
        (left, top), _ = np.rint(np.array(shape.points, np.float64).reshape(2, 2)).astype(np.int64).tolist()
    except (binascii.Error, TypeError, ValueError, OverflowError) as error:
        raise InputError(f"a mask must be a PNG between two corners, got {shown(shape.points)}") from error
    if pixels.ndim != 2:
        raise InputError(f"a mask must have one channel, got {pixels.shape}")
    x, y = max(left, 0), max(top, 0)
    inside = canvas[y : max(top + pixels.shape[0], 0), x : max(left + pixels.shape[1], 0)]
    inside |= pixels[y - top :, x - left :][: inside.shape[0], : inside.shape[1]] != 0


def _of_yolo(data: bytes, size: Size | None, path: Path) -> Labels:
    if size is None:
        raise InputError("coordinates of YOLO are shares of the picture's size, which is needed beside it")
    try:
        rows = [[float(word) for word in line.split()] for line in data.decode("utf-8-sig").splitlines()]
    except ValueError as error:
        raise InputError(f"is no text of YOLO, lines of numbers: {error}") from error
    return paint(_of_lines(rows, size, path), size)


def _of_lines(rows: Sequence[Sequence[float]], size: Size, path: Path) -> Iterator[AnyArray]:
    """Yield the mask (H, W) of each polygon."""
    lines = [(number, row) for number, row in enumerate(rows, 1) if row]
    extra = 2 if _end_with_tracks([row for _, row in lines]) else 0
    outlines = [(number, _coordinates(number, row, extra)) for number, row in lines]
    boxes = [number for number, outline in outlines if len(outline) == _BOX_VALUES]
    if boxes:
        logger.warning("%s: left out %d boxes (line %d): only polygons have an area", path, len(boxes), boxes[0])
    for number, outline in outlines:
        if len(outline) == _BOX_VALUES:
            continue
        corners = np.array(outline, np.float64).reshape(-1, 2) * size[::-1]
        if not ((corners >= -1.0) & (corners <= np.array(size[::-1]) + 1.0)).all():
            raise InputError(
                f"line {number} must have coordinates in 0..1, shares of the picture's size, got {max(outline):g}"
            )
        canvas = np.zeros(size, np.uint8)
        _fill(canvas, corners, path)
        yield canvas


def _coordinates(number: int, row: Sequence[float], extra: int) -> Sequence[float]:
    """Return the values of a line between its class and a confidence, a track's number or both, which are `extra`."""
    values = row[1:]
    if len(values) % 2 and (_is_confidence(values[-1]) or _is_track(values[-1])):
        extra = 1
    outline = values[: len(values) - extra]
    if len(outline) < _BOX_VALUES or len(outline) % 2:
        raise InputError(
            f"line {number} must be a class and three points or more, behind which a confidence in 0..1 and the number "
            f"of a track may stand, got {len(row)} numbers"
        )
    return outline


def _end_with_tracks(rows: Sequence[Sequence[float]]) -> bool:
    """Return whether all lines end with a confidence and the number of a track, and not with one more corner.

    The tracks of a frame have different numbers from 1 on. A number 1 alone may also be the lower border of the
    picture, which an outline that is cut off there touches at two corners or more.
    """
    tracks = [row[-1] for row in rows]
    if not all(
        len(row) >= 1 + _BOX_VALUES + 2 and len(row) % 2 and _is_confidence(row[-2]) and _is_track(row[-1])
        for row in rows
    ):
        return False
    return len(set(tracks)) == len(tracks) and (tracks != [1.0] or max(rows[0][2:-2:2]) < 1.0)


def _is_confidence(value: float) -> bool:
    return 0.0 <= value <= 1.0


def _is_track(value: float) -> bool:
    return value >= 1.0 and value.is_integer()


def _base_name(file_name: str) -> str:
    return PurePosixPath(file_name.replace("\\", "/")).name


def _parts(file_name: str) -> tuple[str, ...]:
    return PurePosixPath(file_name.replace("\\", "/")).parts


def _ends_with(frame: Path, file_name: str) -> bool:
    parts = _parts(file_name)
    return Path(os.path.abspath(frame)).parts[-len(parts) :] == parts
