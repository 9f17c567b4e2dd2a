"""Sections of the configuration made of what is edited, and the way back."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from itertools import groupby

import cv2
import msgspec
import numpy as np

from dloftbs.config import ColourConfig, ColourPicture, HsvRange, PlaneConfig, Roi, SegmentationConfig, Stroke
from dloftbs.data.detection import Detection
from dloftbs.data.frame import Frame
from dloftbs.data.frame_region import Region
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.segmentation import ColourModel, FrameSegmenter, make_segmenter, suggest_mask
from dloftbs.support.arrays import AnyArray
from dloftbs.support.text import readable
from dloftbs.ui.tune_document import RANGES, STROKES, ColourRange, DrawnStroke, Point, TuneDocument

Segment = Callable[[Frame], AnyArray]
_Drawn = tuple[tuple[DrawnStroke, ...], Roi | None, tuple[ColourPicture, ...]]
"""Strokes on a frame, the region of interest, and the other pictures, where these strokes are on ground alone."""

_BRUSH_SHARE = 0.3
"""Radius of the brush of a suggested stroke, as a share of the cable's width.

Source: by hand; within the cable, also where its curve is off by a fifth of its width.
"""
_MAX_POINTS = 400
_DRAFT_PX = 640
"""Longest side of the picture that a stroke is tried on while it is drawn, px: a mask follows within 300 ms."""


class Translator:
    """Turns documents about one source into sections, and a section into the document to begin with.

    Parameters
    ----------
    name : str
        Of the source; pictures of a model are named by it and the frame.
    frame_of : callable
        From an index to the frame.
    section : SegmentationConfig
        To begin with. What the page does not change is kept: a network, a local mask, a background, strokes on other
        pictures, ranges beside strokes, and how masks are read.
    roi : Roi, optional
        Region of interest in which the section's colours were counted.
    live : bool
        Whether the frames of earlier runs are gone: then all strokes of the section are on other pictures.
    """

    def __init__(
        self,
        name: str,
        frame_of: Callable[[int], Frame],
        section: SegmentationConfig,
        roi: Roi | None = None,
        *,
        live: bool = False,
    ) -> None:
        self._name, self._frame_of, self._live = readable(name), frame_of, live
        beside_strokes = section.hsv if section.colour is not None else ()
        self._kept = msgspec.structs.replace(section, hsv=beside_strokes, colour=None, plane=None)
        self._follows_light = section.colour is None or section.colour.follow_light
        self._stored: dict[tuple[tuple[DrawnStroke, ...], Roi | None], ColourPicture] = {}
        self._pictures: dict[_Drawn, ColourPicture] = {}
        self._drafts: dict[tuple[DrawnStroke, ...], ColourPicture] = {}
        self.first = self._document_of(section, roi)

    def _document_of(self, section: SegmentationConfig, roi: Roi | None) -> TuneDocument:
        drawn: dict[int, tuple[DrawnStroke, ...]] = {}
        others: list[ColourPicture] = []
        for picture in () if section.colour is None else section.colour.pictures:
            index = self._index_in(picture.source)
            if index is None or index in drawn:
                others.append(picture)
            else:
                strokes = tuple(DrawnStroke(index, one.points, one.cable, one.radius_px) for one in picture.strokes)
                drawn[index] = strokes
                # The frame of this name may be another one by now: a relative path is the same in many folders.
                self._stored[strokes, roi] = picture
        shown = section.hsv if section.colour is None else ()
        ranges = tuple((*box.hue, *box.saturation, *box.value) for box in shown)
        plane = section.plane
        return TuneDocument(
            method=RANGES if ranges else STROKES,
            strokes=tuple(stroke for group in drawn.values() for stroke in group),
            ranges=ranges,
            height_m=None if plane is None else plane.height_m,
            join="and" if plane is None else plane.join,
            accept_strokes=section.colour is not None and section.colour.accept_strokes,
            others=tuple(others),
            kept=self._kept.is_given,
        )

    def _source_of(self, index: int) -> str:
        return f"{self._name}, frame {index}"

    def _index_in(self, source: str) -> int | None:
        found = re.fullmatch(re.escape(self._name) + r", frame (\d{1,9})", source)
        return None if found is None or self._live else int(found[1])

    def section_of(self, document: TuneDocument) -> SegmentationConfig:
        """Return the section that says what a document does.

        Raises
        ------
        SourceError
            If a frame that was drawn on cannot be read again.
        """
        plane = None if document.height_m is None else PlaneConfig(height_m=document.height_m, join=document.join)
        if document.method == RANGES:
            hsv = (*self._kept.hsv, *map(_as_range, document.ranges))
            return msgspec.structs.replace(self._kept, hsv=hsv, plane=plane)
        pictures = ColourModel.together((*document.others, *self._drawn(document)))
        colour = None
        if any(picture.cable for picture in pictures):
            colour = ColourConfig(
                pictures=pictures, accept_strokes=document.accept_strokes, follow_light=self._follows_light
            )
        return msgspec.structs.replace(self._kept, colour=colour, plane=plane)

    def _drawn(self, document: TuneDocument) -> list[ColourPicture]:
        """Return a picture for each frame with strokes; those that are as they were are not looked at again."""
        groups = _by_frame(document.strokes)
        pictures: dict[_Drawn, ColourPicture] = {}
        found: dict[tuple[DrawnStroke, ...], ColourPicture] = {}
        for group in sorted(groups, key=_is_on_ground):
            drawn = group, document.roi, (*document.others, *found.values()) if _is_on_ground(group) else ()
            picture = self._picture(*drawn)
            if picture is not None:
                found[group] = pictures[drawn] = picture
        self._pictures = pictures
        return [found[group] for group in groups if group in found]

    def _picture(
        self, strokes: tuple[DrawnStroke, ...], roi: Roi | None, others: tuple[ColourPicture, ...]
    ) -> ColourPicture | None:
        known = self._stored.get((strokes, roi)) or self._pictures.get((strokes, roi, others))
        if known is not None:
            return known
        frame, image, inside = self._drawn_on(strokes)
        return make_picture(image, inside, self._source_of(frame.index), roi, others) if inside else None

    def _draft(self, strokes: tuple[DrawnStroke, ...]) -> ColourPicture | None:
        stored = self._stored.get((strokes, None))
        if stored is not None:
            return msgspec.structs.replace(stored, pixels="")  # whose cables are as wide as in the full picture
        if strokes in self._drafts:
            return self._drafts[strokes]
        frame, image, inside = self._drawn_on(strokes)
        small = _reduced(image)
        across, down = small.shape[1] / image.shape[1], small.shape[0] / image.shape[0]
        reduced = [
            msgspec.structs.replace(
                stroke,
                points=tuple(((x + 0.5) * across - 0.5, (y + 0.5) * down - 0.5) for x, y in stroke.points),
                radius_px=max(0.5, across * stroke.radius_px),
            )
            for stroke in inside
        ]
        return make_picture(small, reduced, self._source_of(frame.index)) if reduced else None

    def _drawn_on(self, strokes: tuple[DrawnStroke, ...]) -> tuple[Frame, AnyArray, list[Stroke]]:
        """Return the frame of strokes, its image, and the parts of the strokes within it."""
        frame = self._frame_of(strokes[0].frame)
        if frame.image is None:
            raise InputError("these frames are masks already: there is nothing to tune")
        return frame, frame.image, [kept for stroke in strokes for kept in _within(stroke, frame.size)]

    def draft_of(self, document: TuneDocument) -> Segment | None:
        """Return what soon makes a mask of a frame while a stroke is drawn, on smaller pictures.

        None where the document says more than strokes on these frames, and so takes its own time.

        Raises
        ------
        DloftbsError
            If a frame that was drawn on cannot be read again.
        """
        plain = TuneDocument(strokes=document.strokes, objects=document.objects, accept_strokes=document.accept_strokes)
        if document != plain:
            return None
        groups = _by_frame(document.strokes)
        self._drafts = {group: found for group in groups if (found := self._draft(group)) is not None}
        pictures = tuple(self._drafts.values())
        if not any(picture.cable for picture in pictures):
            return None
        model = ColourModel(ColourConfig(pictures=pictures, accept_strokes=document.accept_strokes))

        def segment(frame: Frame) -> AnyArray:
            assert frame.image is not None  # strokes are drawn on images
            mask = model(_reduced(frame.image)).view(np.uint8) * np.uint8(255)
            return np.asarray(cv2.resize(mask, frame.size[::-1], interpolation=cv2.INTER_LINEAR) >= 128)

        return segment

    def segmenter_of(self, document: TuneDocument) -> RegionSegmenter:
        """Return what makes a mask of a frame.

        Raises
        ------
        DloftbsError
            If the document says nothing, or what it names cannot be read.
        """
        segmenter = make_segmenter(self.section_of(document), document.roi)
        if segmenter is None:
            raise InputError("nothing says yet what is cable: draw a stroke along one first")
        return RegionSegmenter(segmenter, document.roi)


class RegionSegmenter:
    """A callable ``frame -> mask`` that looks at a region of interest alone.

    Parameters
    ----------
    segmenter : FrameSegmenter
    roi : Roi or None
        None is the whole image.
    """

    def __init__(self, segmenter: FrameSegmenter, roi: Roi | None) -> None:
        self._segmenter, self._roi = segmenter, roi

    def __call__(self, frame: Frame) -> AnyArray:
        """Return the mask of a frame, shape (H, W), which is 0 outside of the region."""
        if self._roi is None:
            return self._segmenter(frame)
        region = Region(self._roi, frame.size)
        return region.paste(self._segmenter(region.crop(frame)))

    def reset(self) -> None:
        """Forget the frames before."""
        self._segmenter.reset()


def make_picture(
    image: AnyArray, strokes: list[Stroke], source: str, roi: Roi | None = None, others: tuple[ColourPicture, ...] = ()
) -> ColourPicture:
    """Return strokes with the colours that they were drawn on, in a region of interest alone if there is one.

    Others of the model show how wide cables are, where these strokes are on ground alone.
    """
    (picture,) = ColourModel.pictures_of([(image, strokes, source)], roi, others)
    return picture


def suggestion(frame: Frame, roi: Roi | None = None) -> AnyArray:
    """Return a mask of what may be cable in a frame, or in a region of it, without being told anything."""
    assert frame.image is not None  # whoever asks saw to it
    if roi is None:
        return suggest_mask(frame.image)
    region = Region(roi, frame.size)
    return region.paste(suggest_mask(region.cut(frame.image)))


def object_at(result: FrameResult, point: Point) -> Detection | None:
    """Return the object whose curve a point lies on, or beside by no more than its width; None if there is none."""
    near = [(one.curve.nearest(point)[1], number) for number, one in enumerate(result)]
    distance, number = min(near, default=(np.inf, 0))
    return result[number] if near and distance <= result[number].width_px else None


def lies_on(stroke: DrawnStroke, detection: Detection) -> bool:
    """Return whether most points of a stroke lie within an object's width of its curve."""
    near = [detection.curve.nearest(point)[1] <= detection.width_px for point in stroke.points]
    return 2 * sum(near) > len(near)


def strokes_along(index: int, objects: Iterable[Detection], *, cable: bool = True) -> list[DrawnStroke]:
    """Return strokes along the seen parts of curves, narrower than the cables, as a careful hand would draw them."""
    strokes = []
    for detection in objects:
        radius = max(1.0, _BRUSH_SHARE * detection.width_px)
        count = min(max(2, round(detection.curve.length / detection.width_px) + 1), _MAX_POINTS)
        u = np.linspace(0.0, 1.0, count)
        seen = np.ones(count, np.bool_)
        for low, high in detection.inferred:
            seen &= (u < low) | (u > high)
        for part in np.split(np.arange(count), np.flatnonzero(np.diff(seen.astype(np.int8))) + 1):
            if seen[part[0]]:
                points = tuple((round(float(x), 1), round(float(y), 1)) for x, y in detection.curve(u[part]))
                strokes.append(DrawnStroke(index, points, cable, radius))
    return strokes


def _by_frame(strokes: tuple[DrawnStroke, ...]) -> list[tuple[DrawnStroke, ...]]:
    ordered = sorted(strokes, key=lambda stroke: stroke.frame)
    return [tuple(group) for _, group in groupby(ordered, key=lambda stroke: stroke.frame)]


def _is_on_ground(strokes: tuple[DrawnStroke, ...]) -> bool:
    """Return whether no stroke is on a cable."""
    return not any(stroke.cable for stroke in strokes)


def _reduced(image: AnyArray) -> AnyArray:
    """Return an image whose longest side is no longer than that of drafts."""
    scale = min(1.0, _DRAFT_PX / max(image.shape[:2]))
    size = max(1, round(scale * image.shape[1])), max(1, round(scale * image.shape[0]))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))


def _within(stroke: DrawnStroke, size: tuple[int, int]) -> list[Stroke]:
    """Return the parts of a stroke that lie within an image of a size ``(H, W)``."""
    height, width = size

    def is_inside(point: Point) -> bool:
        return 0.0 <= point[0] <= width - 1 and 0.0 <= point[1] <= height - 1

    return [
        Stroke(points=tuple(points), cable=stroke.cable, radius_px=stroke.radius_px)
        for inside, points in groupby(stroke.points, key=is_inside)
        if inside
    ]


def _as_range(bounds: ColourRange) -> HsvRange:
    h0, h1, s0, s1, v0, v1 = bounds
    return HsvRange(hue=(h0, h1), saturation=(min(s0, s1), max(s0, s1)), value=(min(v0, v1), max(v0, v1)))
