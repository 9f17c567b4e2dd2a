"""Curves to draw over a picture, with all that is said of each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from dloftbs.data.centerline import Joint
from dloftbs.data.curve import BSplineCurve, check_curve
from dloftbs.data.detection import Crossing, Detection
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track, TrackState
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs.support.values import shown
from dloftbs.viz.path import Path
from dloftbs.viz.style import Colour, Style, dimmed
from dloftbs.viz.view import View

_DIM, _DIMMER = 0.3, 0.65  # of hidden tracks, where they are sure and where they are not at all
_WINDOW = 0.05  # of a curve, in which to look for a place on it
_SURE = 0.95  # what is less sure says so

Object = Track | Detection | BSplineCurve
"""Anything with a curve in the image."""


@dataclass(frozen=True, eq=False)
class Item:
    """One curve to draw.

    Parameters
    ----------
    curve : BSplineCurve
        In the picture, px.
    label : str
    colour : colour
    joints : tuple of Joint
        By the ``u`` of the curve.
    inferred : tuple of (float, float)
        The intervals of ``u`` that were inferred rather than seen.
    width_px : float, optional
        Of the object, px; None where it is not known.
    hidden : bool
        Whether the whole curve is remembered rather than seen.
    crossed : tuple of float
        The ``u`` of all crossings with itself and others.
    below : tuple of float
        The ``u`` of crossings at which it is known to lie below.
    unordered : tuple of float
        The ``u`` of crossings to mark since it is not known which lies on top.
    """

    curve: BSplineCurve
    label: str
    colour: Colour
    joints: tuple[Joint, ...] = ()
    inferred: tuple[tuple[float, float], ...] = ()
    width_px: float | None = None
    hidden: bool = False
    crossed: tuple[float, ...] = ()
    below: tuple[float, ...] = ()
    unordered: tuple[float, ...] = ()

    def seen_in(self, view: View) -> Item:
        """Return the item as it lies in a view of its picture."""
        width = None if self.width_px is None else self.width_px * view.zoom
        return replace(self, curve=view.curve(self.curve), width_px=width)


def items_of(result: FrameResult, style: Style) -> tuple[Item, ...]:
    """Return the objects of a result that are drawn: its tracks, or else its detections."""
    if result.tracks:
        items = [_of_track(track, result, style) for track in result.tracks]
    else:
        items = [
            _of_detection(d, i, result, _labelled(str(i), d.confidence), style.colour(i))
            for i, d in enumerate(result.detections)
        ]
    return tuple(items)


def outline_of(result: FrameResult) -> FloatArray | None:
    """Return the corners (n, 2) of the region of interest that alone was read, px; None where all was."""
    if result.roi is None:
        return None
    if len(result.roi) == 4 and isinstance(result.roi[0], int):
        x, y, w, h = result.roi
        return np.array([(x, y), (x + w - 1, y), (x + w - 1, y + h - 1), (x, y + h - 1)], np.float64)
    return np.array(result.roi, np.float64)


def bare_items_of(objects: Object | Iterable[Object], style: Style) -> list[Item]:
    """Return the items of tracks, detections and curves that belong to no result."""
    alone = isinstance(objects, (Track, Detection, BSplineCurve))
    if not alone and not isinstance(objects, Iterable):
        raise InputError(f"expected a FrameResult, or tracks, detections or curves to draw, got {shown(objects)}")
    nothing = FrameResult((), (), None, (0, 0))
    items = []
    for index, one in enumerate(cast("Iterable[object]", [objects] if alone else objects)):
        if isinstance(one, Track):
            items.append(_of_track(one, nothing, style))
        elif isinstance(one, Detection):
            label = _labelled(str(index), one.confidence)
            items.append(_of_detection(one, index, nothing, label, style.colour(index)))
        else:
            check_curve("what is drawn", one, 2)
            items.append(Item(cast(BSplineCurve, one), str(index), style.colour(index)))
    return items


def _labelled(label: str, confidence: float) -> str:
    """Return a label with the confidence behind it, where that is not sure."""
    return label if confidence >= _SURE else f"{label}: {100.0 * confidence:.0f} %"


def _of_detection(detection: Detection, index: int, result: FrameResult, label: str, colour: Colour) -> Item:
    return Item(
        detection.curve,
        label,
        colour,
        detection.joints,
        detection.inferred,
        detection.width_px,
        crossed=tuple(u for c in result.crossings for which, u in c.passes if which == index),
        below=tuple(c.passes[1 - c.top][1] for c in result.crossings if c.top is not None and _lower(c) == index),
        unordered=tuple(c.passes[0][1] for c in result.crossings if c.top is None and c.passes[0][0] == index),
    )


def _lower(crossing: Crossing) -> int:
    """Return the index of the detection that lies below at a crossing of known order."""
    assert crossing.top is not None
    return crossing.passes[1 - crossing.top][0]


def _of_track(track: Track, result: FrameResult, style: Style) -> Item:
    label, colour = f"#{track.id}", style.colour(track.id - 1)
    if track.state is TrackState.HIDDEN:
        faded = dimmed(colour, style.ink, _DIMMER + (_DIM - _DIMMER) * track.confidence)
        return Item(track.curve, f"{label} ({track.misses})", faded, width_px=track.width_px, hidden=True)
    seen = track.detection
    label = _labelled(label, track.confidence)
    if seen is None:
        return Item(track.curve, label, colour, inferred=track.inferred, width_px=track.width_px)
    item = _of_seen(seen, result, label, colour)
    if track.curve == seen.curve:
        return replace(item, inferred=(*item.inferred, *track.inferred))
    return _carried_over(item, track)


def _of_seen(seen: Detection, result: FrameResult, label: str, colour: Colour) -> Item:
    """Return the item of a track's detection, which is one of the result's or one of them run the other way."""
    for index, detection in enumerate(result.detections):
        if seen is detection:
            return _of_detection(detection, index, result, label, colour)
        if seen.curve == detection.curve.reversed():
            item = _of_detection(detection, index, result, label, colour)
            return replace(
                item,
                curve=seen.curve,
                joints=seen.joints,
                inferred=seen.inferred,
                crossed=tuple(1.0 - u for u in item.crossed),
                below=tuple(1.0 - u for u in item.below),
                unordered=tuple(1.0 - u for u in item.unordered),
            )
    return Item(seen.curve, label, colour, seen.joints, seen.inferred, seen.width_px)


def _carried_over(item: Item, track: Track) -> Item:
    """Return the item of what was seen of a track on the track's own curve, of which that may be a part."""
    whole = Path.of(track.curve)
    first, last = (whole.share_near(item.curve(u)) for u in (0.0, 1.0))
    if track.curve.closed or last <= first:
        first, last = 0.0, 1.0

    def place(u: float) -> float:
        if track.curve.closed:  # a loop's track starts where it did before, and its detection anywhere
            return whole.share_near(item.curve(u))
        expected = first + u * (last - first)
        return whole.share_near(item.curve(u), expected - _WINDOW, expected + _WINDOW)

    joints = tuple(
        replace(joint, u=(low, high))
        for joint in item.joints
        if (low := place(joint.u[0])) <= (high := place(joint.u[1]))
    )
    return replace(
        item,
        curve=track.curve,
        joints=joints,
        inferred=track.inferred,
        crossed=tuple(map(place, item.crossed)),
        below=tuple(map(place, item.below)),
        unordered=tuple(map(place, item.unordered)),
    )
