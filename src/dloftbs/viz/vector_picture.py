"""Curves over a picture as a drawing in vectors: sharp at any size, with what is known of a curve where one points."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
import numpy.typing as npt

from dloftbs.data.detection import Detection
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track
from dloftbs.errors import InputError
from dloftbs.support.values import check_type
from dloftbs.viz.items import Item, items_of, outline_of
from dloftbs.viz.overlay import as_picture, grey, line_shapes, marker_shapes, region_shape
from dloftbs.viz.path import Path
from dloftbs.viz.shapes import Picture, Shape
from dloftbs.viz.style import Colour, Style, as_css

_JPEG_QUALITY = 85
_STYLE = Style()


@dataclass(frozen=True, eq=False, repr=False)
class VectorPicture:
    """A drawing, which a notebook shows.

    Parameters
    ----------
    svg : str
        The whole drawing, its picture included: it stands alone.
    """

    svg: str

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        return f'<div style="max-width: 960px">{self.svg}</div>'

    def __repr__(self) -> str:
        return f"VectorPicture({len(self.svg)} characters of SVG)"


def show(result: FrameResult, image_or_frame: Frame | npt.ArrayLike | None = None) -> VectorPicture:
    """Return the curves of a result over its picture, for a notebook.

    The signs are those of `draw`. Pointing at a curve shows its id, length, width and confidence.

    Parameters
    ----------
    result : FrameResult
    image_or_frame : Frame or array_like, optional
        As `draw` takes it; by default the frame that the result kept, as that of `detect` does, or black.

    Raises
    ------
    InputError
        As `draw`.
    """
    check_type("result", result, FrameResult)
    picture = _background(result, image_or_frame)
    if picture.shape[:2] != tuple(result.size):
        raise InputError(f"the picture must have the result's size {result.size} (H, W), got {picture.shape[:2]}")
    height, width = result.size
    pen = _STYLE.scaled(picture.shape)
    objects: Sequence[Track | Detection] = result.tracks or result.detections
    groups = [_group(item, found, pen) for item, found in zip(items_of(result, _STYLE), objects, strict=True)]
    outline = outline_of(result)
    region = "" if outline is None else _shape(region_shape(outline, pen), pen.paper, 0.5 * pen.line_px, 1.0)
    reason = "" if result.reason is None else _text(result.reason, 8.0, height - 10.0, pen.paper, pen)
    return VectorPicture(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" style="width: 100%; height: auto">'
        f'<image width="{width}" height="{height}" href="data:image/jpeg;base64,{_jpeg(picture)}"/>'
        f'<g stroke-linecap="round" stroke-linejoin="round">{region}{"".join(groups)}</g>{reason}</svg>'
    )


def _background(result: FrameResult, given: Frame | npt.ArrayLike | None) -> Picture:
    if given is None:
        given = result.frame
    if given is None:
        return grey(np.zeros(result.size, np.bool_), _STYLE)
    return as_picture(given, _STYLE)


def _jpeg(picture: Picture) -> str:
    import cv2

    _, data = cv2.imencode(".jpg", picture, (cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY))
    return base64.b64encode(data.tobytes()).decode()


def _group(item: Item, found: Track | Detection, pen: Style) -> str:
    """Return a curve with its signs and its title: all halos below all lines."""
    path = Path.of(item.curve)
    shapes = line_shapes(item, path, pen) + marker_shapes(item, path, pen)
    halos = "".join(_shape(shape, pen.ink, shape.width + 2.0 * pen.halo_px, pen.halo_opacity) for shape in shapes)
    lines = "".join(_shape(shape, shape.colour, shape.width, 1.0) for shape in shapes)
    x, y = path.points[0]
    label = _text(item.label, float(x) + 2.0 * pen.marker_px, float(y) - 1.5 * pen.marker_px, item.colour, pen)
    return f"<g><title>{escape(_title(item, found))}</title>{halos}{lines}{label}</g>"


def _title(item: Item, found: Track | Detection) -> str:
    parts = [item.label, f"{item.curve.length:.0f} px long"]
    if found.curve_3d is not None:
        parts.append(f"{found.curve_3d.length:.3f} m in space")
    if item.width_px is not None:
        parts.append(f"{item.width_px:.1f} px wide")
    return ", ".join([*parts, f"confidence {found.confidence:.2f}"])


def _shape(shape: Shape, colour: Colour, width: float, opacity: float) -> str:
    # Whole coordinates are the centres of pixels; in SVG they are their corners.
    points = " ".join(f"{x + 0.5:.1f},{y + 0.5:.1f}" for x, y in shape.points)
    kind = "polygon" if shape.closed else "polyline"
    fill = as_css(colour) if shape.filled else "none"
    faint = f' opacity="{opacity:g}"' if opacity < 1.0 else ""
    return f'<{kind} points="{points}" fill="{fill}" stroke="{as_css(colour)}" stroke-width="{width:.1f}"{faint}/>'


def _text(text: str, x: float, y: float, colour: Colour, pen: Style) -> str:
    size = 1.4 * pen.text_px
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-family="system-ui, sans-serif" font-weight="600" font-size="{size:.1f}" '
        f'fill="{as_css(colour)}" stroke="{as_css(pen.ink)}" stroke-width="{pen.halo_px:.1f}" paint-order="stroke">'
        f"{escape(text)}</text>"
    )
