"""Marks of answers over a picture: bends that are too tight, and the band in which a curve surely lies."""

from __future__ import annotations

import numpy as np

from dloftbs.data.answers import BendLimit, objects_of
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track
from dloftbs.viz import shapes
from dloftbs.viz.shapes import Picture, Shape
from dloftbs.viz.style import Style

_BEND = (70, 90, 240)
"""Colour of bends that are too tight."""
_DEVIATIONS = 2.0
"""Half the width of the band, deviations: 95 of 100 points lie in it."""


def mark_bends(picture: Picture, result: FrameResult, limit: BendLimit, style: Style = Style()) -> None:  # noqa: B008
    """Paint the parts of a result's objects that bend more than a limit, over a picture (H, W, 3) of its frame."""
    pen = style.scaled(picture.shape)
    marks = []
    for _, one in objects_of(result):
        u = _places(one.curve.length)
        tight = np.flatnonzero(np.diff(limit.is_tighter(one, u.tolist()), prepend=False, append=False))
        for low, high in tight.reshape(-1, 2).tolist():
            marks.append(Shape(one.curve(u[low : max(high, low + 2)]), _BEND, 2.0 * pen.line_px))
    shapes.paint(picture, marks, pen)


def mark_deviations(picture: Picture, result: FrameResult, style: Style = Style()) -> None:  # noqa: B008
    """Paint the band of two deviations to each side of a result's objects, over a picture (H, W, 3) of its frame."""
    pen = style.scaled(picture.shape)
    bands = []
    for _, one in objects_of(result):
        if isinstance(one, Track) and one.detection is None:
            continue
        u = _places(one.curve.length)
        tangents = one.curve.tangent(u)
        across = _DEVIATIONS * one.curve_std(u)[:, None] * np.stack((-tangents[:, 1], tangents[:, 0]), axis=1)
        points = one.curve(u)
        bands += [Shape(points + side * across, pen.paper, 1.0) for side in (-1.0, 1.0)]
    shapes.paint(picture, bands, pen)


def _places(length: float) -> np.ndarray:
    return np.linspace(0.0, 1.0, max(int(length / 2.0), 2))
