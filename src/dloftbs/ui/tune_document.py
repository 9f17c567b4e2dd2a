"""The document that is edited: strokes, ranges of colours and a height above the ground, with the way back."""

from __future__ import annotations

from itertools import groupby
from typing import Any

import msgspec
import numpy as np

from dloftbs.config import ColourPicture, Roi, read_roi
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs.ui.messages import (
    AcceptStrokes,
    Clear,
    Draw,
    EditMessage,
    Erase,
    SetHeight,
    SetMethod,
    SetObjects,
    SetRanges,
    SetRegion,
)

Point = tuple[float, float]
ColourRange = tuple[int, int, int, int, int, int]
"""Low and high hue, saturation and value."""

STROKES, RANGES = "strokes", "ranges"
METHODS = (STROKES, RANGES)
MAX_STROKES = 500
"""Number of strokes of a document: beyond it, fitting is no longer fast enough to follow the pointer."""
_MAX_STATES = 200


class DrawnStroke(msgspec.Struct, frozen=True):
    """A stroke on a frame: points ``(x, y)`` px of the image, and the brush."""

    frame: int
    points: tuple[Point, ...]
    cable: bool
    radius_px: float


class TuneDocument(msgspec.Struct, frozen=True):
    """One state of what is edited."""

    method: str = STROKES
    strokes: tuple[DrawnStroke, ...] = ()
    ranges: tuple[ColourRange, ...] = ()
    height_m: float | None = None
    join: str = "and"
    accept_strokes: bool = False
    """True if every colour beneath strokes on cables is the cable's."""
    others: tuple[ColourPicture, ...] = ()
    """Strokes on pictures of other sources."""
    kept: bool = False
    """True if what the page does not change says what is cable, too: a network, a local mask, a background, ranges
    beside strokes."""
    objects: int | None = None
    """Number of cables; None where it is unknown."""
    roi: Roi | None = None
    """Region of interest; None for the whole image."""

    @property
    def is_empty(self) -> bool:
        """True if nothing says yet what is cable."""
        coloured = self.shows_cable if self.method == STROKES else bool(self.ranges)
        return not coloured and self.height_m is None and not self.kept

    @property
    def shows_cable(self) -> bool:
        """True if a stroke is along a cable; strokes on the ground say nothing without one."""
        return any(stroke.cable for stroke in self.strokes) or any(picture.cable for picture in self.others)

    def with_stroke(self, stroke: DrawnStroke) -> TuneDocument:
        """Return the document with a stroke more."""
        return msgspec.structs.replace(self, strokes=(*self.strokes, stroke), method=STROKES)

    def without(self, frame: int, path: tuple[Point, ...], radius_px: float) -> TuneDocument:
        """Return the document without what an eraser touches on a frame; a stroke may fall into several."""
        kept: list[DrawnStroke] = []
        for stroke in self.strokes:
            kept += _erased(stroke, path, radius_px) if stroke.frame == frame else [stroke]
        return msgspec.structs.replace(self, strokes=tuple(kept))

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for the page."""
        plain: dict[str, Any] = msgspec.to_builtins(self)
        return {**plain, "others": len(self.others)}


def edited(document: TuneDocument, message: EditMessage) -> TuneDocument:  # noqa: PLR0911 - one for each message
    """Return a document as a message of the browser wants it.

    Raises
    ------
    InputError
        If there are too many strokes, or there is no such method.
    ConfigError
        If it is no region of interest.
    """
    change = msgspec.structs.replace
    match message:
        case Draw():
            if len(document.strokes) >= MAX_STROKES:
                raise InputError(f"there are {MAX_STROKES} strokes, which is the most; erase some")
            return document.with_stroke(DrawnStroke(message.frame, message.points, message.cable, message.radius_px))
        case AcceptStrokes():
            return change(document, accept_strokes=message.accept, method=STROKES)
        case Erase():
            return document.without(message.frame, message.points, message.radius_px)
        case SetRanges():
            return change(document, ranges=message.ranges, method=RANGES)
        case SetHeight():
            return change(document, height_m=message.height_m, join=message.join)
        case SetMethod():
            if message.method not in METHODS:
                raise InputError(f"a method must be one of {', '.join(METHODS)}, got {message.method!r}")
            return change(document, method=message.method)
        case SetObjects():
            return change(document, objects=message.objects)
        case SetRegion():
            roi = message.box or message.corners
            return change(document, roi=None if roi is None else read_roi(roi))
        case Clear():
            return TuneDocument(method=document.method, kept=document.kept, objects=document.objects, roi=document.roi)


def _erased(stroke: DrawnStroke, path: tuple[Point, ...], radius_px: float) -> list[DrawnStroke]:
    points = _densified(np.asarray(stroke.points, np.float64), max(1.0, stroke.radius_px))
    touched = _distance(points, np.asarray(path, np.float64)) <= radius_px + stroke.radius_px
    if not touched.any():
        return [stroke]
    parts = []
    for is_touched, run in groupby(zip(touched, points.tolist(), strict=True), key=lambda pair: pair[0]):
        if not is_touched:
            part = tuple((x, y) for _, (x, y) in run)
            parts.append(msgspec.structs.replace(stroke, points=part))
    return parts


def _densified(points: FloatArray, step_px: float) -> FloatArray:
    """Return the points of a line with others between them, no farther apart than a step."""
    if len(points) == 1:
        return points
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate(([0.0], np.cumsum(lengths)))
    count = min(int(along[-1] / step_px) + 2, 4000)
    at = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(at, along, points[:, axis]) for axis in (0, 1)], axis=1)


def _distance(points: FloatArray, path: FloatArray) -> FloatArray:
    """Return the distance of each point (n, 2) to a line through others (m, 2), shape (n,)."""
    starts, ends = (path, path) if len(path) == 1 else (path[:-1], path[1:])
    nearest = np.full(len(points), np.inf)
    for start, end in zip(starts, ends, strict=True):
        along = end - start
        share = np.clip((points - start) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(points - start - share[:, None] * along, axis=1))
    return nearest


class History:
    """The states of a document, the one at hand, and those before and after it."""

    def __init__(self, document: TuneDocument) -> None:
        self._states = [document]
        self._at = 0

    @property
    def document(self) -> TuneDocument:
        """The state at hand."""
        return self._states[self._at]

    @property
    def states(self) -> tuple[TuneDocument, ...]:
        """All states that can be come back to."""
        return tuple(self._states)

    @property
    def can_undo(self) -> bool:
        """True if there is a state before this one."""
        return self._at > 0

    @property
    def can_redo(self) -> bool:
        """True if a state was taken back."""
        return self._at + 1 < len(self._states)

    def change(self, document: TuneDocument) -> None:
        """Add a state; what was taken back is gone. The oldest states are forgotten."""
        if document == self.document:
            return
        self._states = [*self._states[: self._at + 1], document][-_MAX_STATES:]
        self._at = len(self._states) - 1

    def undo(self) -> None:
        """Go back by a state, if there is one."""
        self._at = max(0, self._at - 1)

    def redo(self) -> None:
        """Make again what was taken back, if there is something."""
        self._at = min(len(self._states) - 1, self._at + 1)
