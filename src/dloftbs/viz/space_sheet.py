"""Curves in space: the picture, its depth, and the curves in metres from above and from the side, on one sheet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track, TrackState
from dloftbs.support.arrays import FloatArray
from dloftbs.support.values import check_type
from dloftbs.viz import overlay
from dloftbs.viz.items import Item
from dloftbs.viz.lettering import Text, note
from dloftbs.viz.shapes import Picture
from dloftbs.viz.sheet import arrange, fitted
from dloftbs.viz.style import Colour, Style, dimmed

_SAMPLES = 200
_MIN_ASPECT = 0.55
_ROOM = 1.25  # of a view, against what is in it
_MIN_RANGE_M = 0.05
_STEPS = 8  # of the grid over the longer side, about
_DEPTH_SHARES = (1.0, 99.0)  # percentiles that the colours span
_HATCH_PX = 6
_BAR = 0.05
_LETTERS = 0.8  # of the style's


@dataclass(frozen=True, eq=False)
class _Solid:
    """One object in space."""

    curve: BSplineCurve
    label: str
    colour: Colour
    inferred: tuple[tuple[float, float], ...] = ()
    hidden: bool = False


@dataclass(frozen=True)
class _Side:
    """Side from which curves are seen: the axes that go to the right and down, with their signs."""

    title: str
    right: int
    down: int
    down_sign: float


_SIDES = (
    _Side("from above: x to the right, z away from the camera, m", 0, 2, -1.0),
    _Side("from the side: z to the right, y downwards, m", 2, 1, 1.0),
)


def draw_3d(
    frame: Frame,
    result: FrameResult,
    *,
    style: Style = Style(),  # noqa: B008  frozen
) -> Picture:
    """Draw curves in space: four panels with titles, in two rows.

    The picture with its curves, as `draw` does it; the depth in colours, hatched where it is missing; the curves in
    metres from above and from the side, both at one scale, on a grid. There, as in `draw`, colours are those of the
    ids, a dot is the start, a ring the end, and dashed is what was inferred rather than measured, hidden tracks
    included. Objects without a curve in space are named with the reason.

    Parameters
    ----------
    frame : Frame
    result : FrameResult
        Of that frame.
    style : Style

    Returns
    -------
    numpy.ndarray, shape (H, W, 3), uint8
        BGR.

    Raises
    ------
    InputError
        If the frame is no `Frame`, has another size than the result, or a curve in space has not three dimensions.
    """
    check_type("frame", frame, Frame)
    check_type("result", result, FrameResult)
    check_type("style", style, Style)
    width = style.panel_px
    flat = fitted(overlay.draw(frame, result, style=style), width)
    height = max(flat.shape[0], round(_MIN_ASPECT * width))
    title, depth = _depth_panel(frame, (flat.shape[1], flat.shape[0]), style)
    solids, absent = _solids_of(result, style)
    views = _views(solids, (height, width), style)
    if absent:
        note(views[0], "; ".join(absent), _LETTERS * style.text_px, style.paper, style.ink)
    titles = ["curves in the image", title, *(side.title for side in _SIDES)]
    return arrange([flat, depth, *views], titles, 2, width, style)


def _depth_panel(frame: Frame, size: tuple[int, int], style: Style) -> tuple[str, Picture]:
    """Return the title and the picture, of a width and a height, of the depth of a frame."""
    width, height = size
    panel: Picture = np.full((height, width, 3), style.ink, np.uint8)
    if frame.depth is None:
        return "no depth", panel
    unit = 1.0 if np.issubdtype(frame.depth.dtype, np.floating) else frame.depth_unit_m
    metres = frame.depth.astype(np.float64) * unit
    known = np.isfinite(metres) & (metres > 0.0)
    hatched = np.add.outer(np.arange(height), np.arange(width)) % _HATCH_PX < _HATCH_PX // 2
    panel[hatched] = style.changed
    if not known.any():
        return "depth: missing everywhere", panel
    low, high = np.percentile(metres[known], _DEPTH_SHARES)
    coloured = _colours(np.where(known, metres, low), low, high)
    # The nearest pixel: a mean of what is known and what is not would be neither.
    shown = cv2.resize(known.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    panel[shown] = cv2.resize(coloured, size, interpolation=cv2.INTER_NEAREST)[shown]
    missing = 100.0 * (1.0 - known.mean())
    return f"depth, {low:.2f} (dark) to {high:.2f} m; hatched: missing, {missing:.1f} %", _with_bar(panel, style)


def _colours(metres: FloatArray, low: float, high: float) -> Picture:
    share = np.clip((metres - low) / max(high - low, 1e-9), 0.0, 1.0)
    return cv2.applyColorMap((255.0 * share).round().astype(np.uint8), cv2.COLORMAP_VIRIDIS).astype(np.uint8)


def _with_bar(panel: Picture, style: Style) -> Picture:
    """Draw the scale of colours along the lower border, from near to far."""
    rows = max(4, round(_BAR * panel.shape[0]))
    panel[-rows:] = _colours(np.linspace(0.0, 1.0, panel.shape[1])[None], 0.0, 1.0)
    panel[-rows - 2 : -rows] = style.ink
    return panel


def _solids_of(result: FrameResult, style: Style) -> tuple[list[_Solid], list[str]]:
    """Return what there is in space, and why the rest is not."""
    solids, absent = [], []
    of_track = [(f"#{t.id}", style.colour(t.id - 1), t, t.detection) for t in result.tracks]
    of_detection = [(str(i), style.colour(i), d, d) for i, d in enumerate(result.detections)]
    objects: Sequence[tuple[str, Colour, Track | Detection, Detection | None]] = of_track or of_detection
    for label, colour, item, detection in objects:
        if item.curve_3d is None:
            why = detection.no_3d_reason if detection is not None else None
            absent.append(f"{label}: no curve in space" + (f", {why}" if why else ""))
            continue
        hidden = detection is None or (isinstance(item, Track) and item.state is TrackState.HIDDEN)
        if hidden or detection is None:
            solids.append(_Solid(item.curve_3d, label, dimmed(colour, style.ink, 0.3), hidden=True))
        else:
            solids.append(_Solid(item.curve_3d, label, colour, item.inferred_3d))
    return solids, absent


def _views(solids: Sequence[_Solid], size: tuple[int, int], style: Style) -> list[Picture]:
    """Return the curves from each side, at one scale, in pictures of `size` (H, W)."""
    if solids:
        points = np.concatenate([solid.curve.sample(_SAMPLES) for solid in solids])
        low, high = points.min(axis=0), points.max(axis=0)
    else:
        low, high = np.full(3, -0.5), np.full(3, 0.5)
    extent = np.maximum(_ROOM * (high - low), _MIN_RANGE_M)
    scale = min(min(size[1] / extent[side.right], size[0] / extent[side.down]) for side in _SIDES)
    return [_view(solids, side, (low + high) / 2.0, float(scale), size, style) for side in _SIDES]


def _view(
    solids: Sequence[_Solid], side: _Side, middle: FloatArray, scale: float, size: tuple[int, int], style: Style
) -> Picture:
    """Return the curves from one side, `scale` px per metre, about a point in the middle."""
    matrix = np.zeros((2, 3))
    matrix[0, side.right], matrix[1, side.down] = scale, scale * side.down_sign
    offset = np.array([size[1], size[0]]) / 2.0 - matrix @ middle
    picture: Picture = np.full((*size, 3), style.ink, np.uint8)
    _grid(picture, side, matrix, offset, style)
    items = [
        Item(
            solid.curve.transformed(matrix, offset),
            solid.label,
            solid.colour,
            inferred=solid.inferred,
            hidden=solid.hidden,
        )
        for solid in solids
    ]
    overlay.paint_items(picture, items, style)
    return picture


def _grid(picture: Picture, side: _Side, matrix: FloatArray, offset: FloatArray, style: Style) -> None:
    """Draw lines at round numbers of metres, with the numbers at the lower and the left border."""
    height, width = picture.shape[:2]
    step = _round_step(max(height, width) / float(matrix[0, side.right]) / _STEPS)
    faint, letters = dimmed(style.ink, style.paper, 0.15), dimmed(style.ink, style.paper, 0.75)
    digits = max(0, -math.floor(math.log10(step)))
    small = _LETTERS * style.text_px
    columns = _ticks(float(matrix[0, side.right]), float(offset[0]), width, step)
    rows = _ticks(float(matrix[1, side.down]), float(offset[1]), height, step)
    for at, _ in columns:
        cv2.line(picture, (at, 0), (at, height), faint, 1)
    for at, _ in rows:
        cv2.line(picture, (0, at), (width, at), faint, 1)
    # Every number that has room: the ones that would touch their neighbour are left out.
    for at, value in _apart(columns, max(Text(f"{v:.{digits}f}", small).size[0] for _, v in columns or [(0, 0.0)])):
        text = Text(f"{value:.{digits}f}", small)
        text.write(picture, at - text.size[0] // 2, height - text.size[1], letters)
    for at, value in _apart(rows, Text("0", small).size[1]):
        text = Text(f"{value:.{digits}f}", small)
        if text.size[1] < at < height - 2 * text.size[1]:
            text.write(picture, 0, at - text.size[1] // 2, letters)


def _ticks(slope: float, offset: float, length: int, step: float) -> list[tuple[int, float]]:
    """Return the multiples of `step` on an axis of a given number of pixels, by pixel."""
    ends = sorted(((0 - offset) / slope, (length - offset) / slope))
    values = [step * k for k in range(math.ceil(ends[0] / step), math.floor(ends[1] / step) + 1)]
    return sorted((round(slope * value + offset), value + 0.0) for value in values)


def _apart(ticks: Sequence[tuple[int, float]], least_px: int) -> list[tuple[int, float]]:
    """Return every n-th tick, n being the least with which they are `least_px` apart."""
    gap = min((b[0] - a[0] for a, b in pairwise(ticks)), default=least_px)
    return list(ticks[:: max(1, math.ceil(least_px / max(gap, 1)))])


def _round_step(wanted: float) -> float:
    """Return 1, 2 or 5 times a power of ten, the least that is not below `wanted`."""
    power = 10.0 ** math.floor(math.log10(wanted))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= wanted * (1.0 - 1e-9))
