"""One frame, stage by stage, on one sheet."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from dloftbs.data.centerline import JointKind, Segment
from dloftbs.data.detection import Detection
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.stage_trace import StageTrace
from dloftbs.support.arrays import BoolArray, FloatArray
from dloftbs.support.values import check_type
from dloftbs.viz import overlay, shapes
from dloftbs.viz.items import items_of, outline_of
from dloftbs.viz.path import Path, dashes
from dloftbs.viz.shapes import Picture, Shape
from dloftbs.viz.sheet import arrange
from dloftbs.viz.style import Colour, Style, dimmed
from dloftbs.viz.view import View

_COLUMNS = 3
_FAINT = 0.5
_HEAVIER = 1.6
_CROSS = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))


def draw_stages(trace: StageTrace, *, style: Style = Style()) -> Picture:  # noqa: B008  frozen
    """Draw what each stage made of a frame: six panels with titles, in two rows.

    The image with its mask, the cleaned mask, the skeleton, the segments, the linked centre lines, the curves. Where
    the objects cover a small part of the frame, that part alone is shown; small pictures are enlarged.

    Parameters
    ----------
    trace : StageTrace
    style : Style

    Returns
    -------
    numpy.ndarray, shape (H, W, 3), uint8
        BGR.

    Raises
    ------
    InputError
        If `trace` is something else, or a curve is not in the image.
    """
    check_type("trace", trace, StageTrace)
    check_type("style", style, Style)
    view = View.around(trace.mask | trace.cleaned, style.panel_px)
    panels = (
        _input(trace, view, style),
        _cleaned(trace, view, style),
        _skeleton(trace, view, style),
        _segments(trace, view, style),
        _linked(trace, view, style),
        _curves(trace, view, style),
    )
    width, _ = view.size
    return arrange([picture for _, picture in panels], [title for title, _ in panels], _COLUMNS, width, style)


def _input(trace: StageTrace, view: View, style: Style) -> tuple[str, Picture]:
    picture = view.picture(overlay.as_picture(trace.frame, style))
    if trace.frame.image is None:
        return "1  mask", picture
    _outline(picture, view.mask(trace.mask), style)
    return "1  image and mask", picture


def _outline(picture: Picture, mask: BoolArray, style: Style) -> None:
    """Draw the rim of a mask: the image stays visible inside of it."""
    inner = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    picture[mask & ~inner] = style.colour(0)


def _cleaned(trace: StageTrace, view: View, style: Style) -> tuple[str, Picture]:
    picture = _dim(trace, view, style, 0.0)
    removed, added = trace.mask & ~trace.cleaned, trace.cleaned & ~trace.mask
    picture[view.mask(added)] = style.colour(0)
    picture[view.mask(removed)] = style.changed
    return f"2  cleaned: {removed.sum()} px removed, {added.sum()} px added", picture


def _skeleton(trace: StageTrace, view: View, style: Style) -> tuple[str, Picture]:
    picture = _dim(trace, view, style, _FAINT)
    _fill(picture, view, trace.mask.shape, trace.skeleton, style.paper)
    pen = _pen(picture, style)
    radius = max(pen.marker_px, view.zoom)
    width = 0.8 * pen.line_px
    marks = [shapes.square(p, radius, style.colour(1), width) for p in view.points(trace.branch_points)]
    marks += [shapes.ring(p, radius, style.colour(0), width) for p in view.points(trace.endpoints)]
    shapes.paint(picture, marks, pen)
    ends, branches = _count(len(trace.endpoints), "endpoint"), _count(len(trace.branch_points), "branch point")
    return f"3  skeleton: {ends} (ring), {branches} (square)", picture


def _segments(trace: StageTrace, view: View, style: Style) -> tuple[str, Picture]:
    picture = _dim(trace, view, style, _FAINT)
    for segment in trace.short_segments:
        _fill(picture, view, trace.mask.shape, segment.points, style.mask)
    for i, segment in enumerate(trace.segments):
        _fill(picture, view, trace.mask.shape, segment.points, style.colour(i))
    return f"4  segments: {len(trace.segments)} kept, {len(trace.short_segments)} too short (grey)", picture


def _linked(trace: StageTrace, view: View, style: Style) -> tuple[str, Picture]:
    picture = _dim(trace, view, style, _FAINT)
    pen = _pen(picture, style)
    seen = _seen(trace.result, style)
    marks = [mark for detection, colour in seen for mark in _chain(detection, colour, view, pen)]
    shapes.paint(picture, marks, pen)
    joints = [joint for detection, _ in seen for joint in detection.joints]
    gaps = sum(joint.kind is JointKind.GAP for joint in joints)
    crossings = len(joints) - gaps
    counts = (_count(len(seen), "object"), _count(gaps, "gap"), _count(crossings, "crossing"))
    return f"5  linked: {', '.join(counts)}", picture


def _seen(result: FrameResult, style: Style) -> list[tuple[Detection, Colour]]:
    """Return this frame's detections in the colours in which their curves are drawn."""
    if result.tracks:
        tracked = [(track.detection, style.colour(track.id - 1)) for track in result.tracks]
        return [(detection, colour) for detection, colour in tracked if detection is not None]
    return [(detection, style.colour(i)) for i, detection in enumerate(result.detections)]


def _chain(detection: Detection, colour: Colour, view: View, pen: Style) -> list[Shape]:
    width = pen.line_px
    segments: Sequence[Segment] = detection.centerline.segments
    marks = [shapes.line(view.points(segment.points), colour, width) for segment in segments]
    for joint, before, after in zip(detection.joints, segments, segments[1:], strict=False):
        bridge = Path(view.points(np.stack((before.points[-1], after.points[0]))))
        if joint.kind is JointKind.GAP:
            spans = dashes((0.0, bridge.length), pen.dash_px, pen.dash_px)
            marks += [shapes.line(bridge.piece(span), colour, width) for span in spans]
        else:
            marks.append(shapes.line(bridge.points, colour, width))
            marks.append(shapes.diamond(bridge.point(bridge.length / 2.0), 1.2 * pen.marker_px, colour, width))
    return marks


def _curves(trace: StageTrace, view: View, style: Style) -> tuple[str, Picture]:
    picture = view.picture(overlay.as_picture(trace.frame, style))
    items = [item.seen_in(view) for item in items_of(trace.result, style)]
    pen = _pen(picture, style)
    outline = outline_of(trace.result)
    overlay.paint_region(picture, None if outline is None else view.points(outline), pen)
    overlay.paint_items(picture, items, pen)
    overlay.write_reason(picture, trace.result, pen)
    return f"6  curves: {len(items)}", picture


def _pen(picture: Picture, style: Style) -> Style:
    """Return the style for a panel: heavier than for a picture of its size, since six of them share a screen."""
    return style.scaled((round(_HEAVIER * picture.shape[0]), round(_HEAVIER * picture.shape[1])))


def _count(n: int, noun: str) -> str:
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def _dim(trace: StageTrace, view: View, style: Style, faint: float) -> Picture:
    """Return the cleaned mask as a grey background, faint so that drawings on it stand out."""
    picture: Picture = np.full((*view.size[::-1], 3), style.ink, np.uint8)
    picture[view.mask(trace.cleaned)] = dimmed(style.mask, style.ink, faint)
    return picture


def _fill(picture: Picture, view: View, size: tuple[int, ...], points: FloatArray, colour: Colour) -> None:
    """Paint pixels of the frame, given by their centres (n, 2); what lies beyond the frame is left out."""
    layer = np.zeros(size, np.bool_)
    pixels = np.rint(points).astype(np.intp)
    x, y = pixels[((pixels >= 0) & (pixels < size[::-1])).all(axis=1)].T
    layer[y, x] = True
    shown = view.mask(layer)
    if view.zoom < 2.0:
        # Lines of one pixel show no colour.
        shown = cv2.dilate(shown.astype(np.uint8), _CROSS) > 0
    picture[shown] = colour
