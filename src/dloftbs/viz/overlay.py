"""Drawing of detections and tracks over the picture in which they were found."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from dloftbs.data.centerline import JointKind
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.support.array_likes import as_pixels
from dloftbs.support.arrays import FloatArray, check_image, check_mask, looks_like_image
from dloftbs.support.values import check_type
from dloftbs.viz import shapes
from dloftbs.viz.items import Item, Object, bare_items_of, items_of, outline_of
from dloftbs.viz.label_placement import Box, place
from dloftbs.viz.lettering import Text, note
from dloftbs.viz.path import Path, Span, complement, dashes, repeats
from dloftbs.viz.shapes import Picture, Shape
from dloftbs.viz.style import Style, dimmed, is_light


def draw(
    image_or_frame: Frame | npt.ArrayLike,
    result: FrameResult | Object | Iterable[Object],
    *,
    style: Style = Style(),  # noqa: B008  frozen
    control_points: bool = False,
) -> Picture:
    """Draw curves over their picture: those of a result, or tracks, detections or bare curves.

    Each track has its curve in the colour of its id, or, where there are no tracks, each detection in the colour of its
    place in the order, and behind that its confidence, where it is below 95 %. A dot is the start (``u = 0``), a
    ring the end, arrows point from the one to the other. Dashed is what was inferred: across gaps of the mask, where a
    track knows of a part that is hidden, and the whole of a hidden track. That one is dimmer, too, the more the less
    sure it is, and has the number of frames since it was last seen in brackets behind its own. Where curves cross, the
    one below is interrupted, as in drawings of knots; a small white ring marks where it is not known which that is. A
    diamond is another junction that the curve was linked through. A thin outline is the region of interest, where only
    that was read.

    Parameters
    ----------
    image_or_frame : Frame or array_like, shape (H, W, 3), uint8, or shape (H, W), bool or any integer type
        The picture to draw on, or a mask, whose cable shows as grey (`Frame.is_cable`). A frame without an image shows
        its mask.
    result : FrameResult, or Track, Detection or BSplineCurve, one or several
        Of that frame; curves in the image, px. Where a result has a reason why nothing was found, that is written into
        the lower left corner; and only a result knows of crossings.
    style : Style
    control_points : bool
        Whether to draw the control polygons.

    Returns
    -------
    numpy.ndarray, shape (H, W, 3), uint8
        BGR, a new picture.

    Raises
    ------
    InputError
        If the picture has another size than the result, or a wrong shape or type, or a curve is one in space.
    """
    check_type("style", style, Style)
    picture = as_picture(image_or_frame, style)
    if not isinstance(result, FrameResult):
        paint_items(picture, bare_items_of(result, style), style.scaled(picture.shape), control_points=control_points)
        return picture
    if picture.shape[:2] != tuple(result.size):
        raise InputError(f"the picture must have the result's size {result.size} (H, W), got {picture.shape[:2]}")
    pen = style.scaled(picture.shape)
    paint_region(picture, outline_of(result), pen)
    paint_items(picture, items_of(result, style), pen, control_points=control_points)
    points = [np.array(point.position) for point in result.branch_points]
    shapes.paint(picture, [shapes.ring(at, 1.6 * pen.marker_px, pen.paper, pen.line_px) for at in points], pen)
    write_reason(picture, result, pen)
    return picture


def as_png(picture: Picture) -> bytes:
    """Return a picture as a PNG file.

    Raises
    ------
    InputError
        If it is no picture.
    """
    import cv2

    _, data = cv2.imencode(".png", check_image(picture))
    return bytes(data)


def as_picture(image_or_frame: Frame | npt.ArrayLike, style: Style) -> Picture:
    """Return a new BGR picture (H, W, 3) of a frame, an image or a mask.

    Raises
    ------
    InputError
        If it has another shape or type, or no pixels.
    """
    if isinstance(image_or_frame, Frame):
        frame = image_or_frame
    else:
        pixels = as_pixels("the picture", image_or_frame, "any")
        frame = Frame(image=pixels) if looks_like_image(pixels) else Frame(mask=check_mask(pixels))
    if frame.image is not None:
        picture = np.array(frame.image, order="C")
    else:
        is_cable = frame.is_cable
        assert is_cable is not None  # the frame saw to it
        picture = grey(is_cable, style)
    if picture.size == 0:
        raise InputError(f"a picture must have at least one pixel, got shape {picture.shape}")
    return picture


def grey(mask: npt.NDArray[np.bool_], style: Style) -> Picture:
    """Return the mask (H, W) as a dim picture (H, W, 3)."""
    picture = np.empty((*mask.shape, 3), np.uint8)
    picture[:] = style.ink
    picture[mask] = style.mask
    return picture


def paint_items(picture: Picture, items: Sequence[Item], pen: Style, *, control_points: bool = False) -> None:
    """Draw items into a picture, with the style as it is at its scale."""
    paths = [Path.of(item.curve) for item in items]
    drawn: list[Shape] = []
    if control_points:
        drawn += [shape for item in items for shape in _control_polygon(item, pen)]
    for item, path in zip(items, paths, strict=True):
        drawn += line_shapes(item, path, pen)
    for item, path in zip(items, paths, strict=True):
        drawn += marker_shapes(item, path, pen)
    shapes.paint(picture, drawn, pen)
    _labels(picture, items, paths, drawn, pen)


def region_shape(outline: FloatArray, pen: Style) -> Shape:
    """Return the thin outline of a region of interest with corners (n, 2)."""
    return Shape(outline, pen.paper, 0.5 * pen.line_px, closed=True)


def paint_region(picture: Picture, outline: FloatArray | None, pen: Style) -> None:
    """Draw the outline of a region of interest, if there is one."""
    if outline is not None:
        shapes.paint(picture, [region_shape(outline, pen)], pen)


def write_reason(picture: Picture, result: FrameResult, pen: Style) -> None:
    """Write why nothing was found, if so, into a corner."""
    if result.reason is not None:
        note(picture, result.reason, pen.text_px, pen.paper, pen.ink)


def _line_width(item: Item, pen: Style) -> float:
    return pen.line_px if item.width_px is None else max(1.0, min(pen.line_px, item.width_px / 3.0))


def line_shapes(item: Item, path: Path, pen: Style) -> list[Shape]:
    """Return the pieces of a curve's line, with its dashes and its interruptions."""
    width = _line_width(item, pen)
    unseen = [(0.0, path.length)] if item.hidden else _unseen(item, path)
    # The ring at the end stays hollow.
    end = path.length if item.curve.closed else max(path.length - _ring_radius(pen), 0.0)
    unseen = [(low, min(high, end)) for low, high in unseen if low < end]
    hidden = [(s - _clearance(pen), s + _clearance(pen)) for s in map(path.arc_at, item.below)]
    spans = complement(unseen + hidden, end)
    # Round caps and halos eat into the space between dashes from both sides.
    space = pen.dash_px + width + 2.0 * pen.halo_px
    for span in unseen:
        drawn = dashes(span, pen.dash_px, space)
        spans += [(low, high) for low, high in drawn if not any(low < b and a < high for a, b in hidden)]
    return [shapes.line(path.piece(span), item.colour, width) for span in spans]


def _clearance(pen: Style) -> float:
    """Return how far from a crossing the curve below stops: its cap, the halo and half the line above, and a space."""
    return 3.0 * pen.line_px + 2.0 * pen.halo_px


def _unseen(item: Item, path: Path) -> list[Span]:
    """Return where the curve was inferred, in order and without overlap."""
    merged: list[Span] = []
    for low, high in sorted((path.arc_at(low), path.arc_at(high)) for low, high in item.inferred):
        if merged and low <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(high, merged[-1][1]))
        elif high > low:
            merged.append((low, high))
    return merged


def marker_shapes(item: Item, path: Path, pen: Style) -> list[Shape]:
    """Return a curve's ends, arrows, and marks of junctions and crossings."""
    width = _line_width(item, pen)
    junctions = _junctions(item, path)
    markers = [shapes.diamond(path.point(s), 1.6 * pen.marker_px, item.colour, width) for s in junctions]
    unordered = [path.point(path.arc_at(u)) for u in item.unordered]
    markers += [shapes.ring(place, 0.7 * pen.marker_px, pen.paper, 0.5 * pen.line_px) for place in unordered]
    # An arrow at a crossing would be a blot, and one on a gap would hide its dashes.
    taken = [(s, s) for s in (*junctions, *map(path.arc_at, item.crossed))] + _unseen(item, path)
    markers += [
        shapes.arrow(path.point(s), path.direction(s, pen.arrow_px / 2.0), pen.arrow_px + width, item.colour)
        for s in _arrow_places(path, taken, pen)
    ]
    if not item.curve.closed:
        markers.append(shapes.disc(path.points[0], pen.marker_px, item.colour))
        markers.append(shapes.ring(path.points[-1], _ring_radius(pen), item.colour, pen.line_px))
    return markers


def _junctions(item: Item, path: Path) -> list[float]:
    """Return where joints run through junctions at which the curve does not cross, to about two widths."""
    reach = 2.0 * (item.width_px or 0.0)
    crossed = [path.arc_at(u) for u in item.crossed]
    places = []
    for joint in item.joints:
        low, high = path.arc_at(joint.u[0]), path.arc_at(joint.u[1])
        if joint.kind is JointKind.CROSSING and not any(low - reach <= s <= high + reach for s in crossed):
            places.append(path.arc_at(sum(joint.u) / 2.0))
    return places


def _arrow_places(path: Path, taken: Sequence[Span], pen: Style) -> list[float]:
    count = repeats(path.length / pen.arrow_spacing_px)
    places = [path.length * (i + 0.5) / count for i in range(count)]
    room = pen.arrow_px + 2.0 * pen.marker_px
    return [s for s in places if all(s < low - room or s > high + room for low, high in taken)]


def _ring_radius(pen: Style) -> float:
    return 1.2 * pen.marker_px


def _control_polygon(item: Item, pen: Style) -> list[Shape]:
    points = item.curve.control_points
    colour = dimmed(item.colour, pen.paper, 0.5)
    polygon = [shapes.line(points, colour, 1.0)]
    return polygon + [shapes.square(point, 0.45 * pen.marker_px, colour, 1.0) for point in points]


def _labels(picture: Picture, items: Sequence[Item], paths: Sequence[Path], drawn: list[Shape], pen: Style) -> None:
    height, width = picture.shape[:2]
    busy = shapes.bounds(drawn)
    taken: list[Box] = []
    for item, path in zip(items, paths, strict=True):
        visible = _inside(path.points, width, height)
        if not len(visible):
            continue
        text = Text(item.label, pen.text_px)
        box = place(visible[0], 2.0 * pen.marker_px, text.size, busy=busy, taken=taken, room=(0, 0, width, height))
        taken.append(box)
        left, top = box[:2]
        picture[top : top + box[3], left : left + box[2]] = item.colour
        text.write(picture, left, top, pen.ink if is_light(item.colour) else pen.paper)


def _inside(points: FloatArray, width: int, height: int) -> FloatArray:
    x, y = points[:, 0], points[:, 1]
    return points[(x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1)]
