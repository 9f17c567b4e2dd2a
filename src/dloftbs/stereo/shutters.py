"""Views of one moment whose shutters opened one after the other, brought to the time of the first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from dloftbs.data.curve_samples import U
from dloftbs.data.detection import place_in
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import SeenPart, Track
from dloftbs.support.arrays import FloatArray

_WHOLE = (0.0, 1.0)
_CHANGE_ERROR = 0.6
"""Standard deviation of a step, as a share of what the change of the velocity adds to it.

Source: by hand; on recorded motion, 5 to 12 ms apart, 60 % of the points in space are within one stated deviation.
"""


class Step(NamedTuple):
    """The way of a detection from its own moment to that of the first view.

    Parameters
    ----------
    way : numpy.ndarray, shape (n, 2)
        px, at even parameters of its spline.
    error : numpy.ndarray, shape (n, 2)
        px, likewise: the way of one standard deviation of what is not known of the time and of the motion.
    """

    way: FloatArray
    error: FloatArray


Steps: TypeAlias = Sequence[Step | None]
"""For each detection of a view its step; None where its motion or its moment is not known."""


def steps_to_first(views: Sequence[FrameResult], *, triggered: bool, time_std_s: float) -> list[Steps]:
    """Return the steps of each view's detections to the moment of the first view, by the motion of their tracks.

    Parameters
    ----------
    views : sequence of FrameResult
        With their tracks.
    triggered : bool
        Whether all views are taken at once, whatever their stamps say.
    time_std_s : float
        Standard deviation of the time between two views' stamps.
    """
    first = views[0].stamp
    found: list[Steps] = [[None] * len(views[0].detections)]
    for view in views[1:]:
        seconds = 0.0 if triggered or first is None or view.stamp is None else first - view.stamp
        unmoved: Steps = [None] * len(view.detections)
        found.append(unmoved if seconds == time_std_s == 0.0 else _steps(view, seconds, time_std_s))
    return found


def _steps(view: FrameResult, seconds: float, time_std_s: float) -> Steps:
    """Return the steps of a view's detections over some seconds."""
    steps: list[Step | None] = [None] * len(view.detections)
    for track in view.tracks:
        moved, within_std = track._way(seconds), track._way(time_std_s)
        if moved is None or within_std is None:
            continue
        way, change = moved
        late = within_std[0]
        error = np.copysign(np.hypot(late, _CHANGE_ERROR * change), late if time_std_s > 0.0 else way)
        for detection, along in _places(track, view):
            steps[detection] = Step(values_at(along, way), values_at(along, error))
    return steps


def values_at(along: FloatArray, values: FloatArray) -> FloatArray:
    """Return values (n, 2) at even parameters of a spline at others, shape (m, 2)."""
    even = np.linspace(0.0, 1.0, len(values))
    return np.stack([np.interp(along, even, column) for column in values.T], axis=1)


def _places(track: Track, view: FrameResult) -> list[tuple[int, FloatArray]]:
    """Return the detections that show a track, and where on the track their even parameters are."""
    if track.detection is None:
        return []
    places = []
    for part in track._parts or (SeenPart(track.detection, _WHOLE, _WHOLE),):
        number, is_reversed = place_in(view.detections, part.detection)
        if number is not None:
            (low, high), (start, end) = part.track_span, part.curve_span
            along = low + (high - low) * ((1.0 - U if is_reversed else U) - start) / (end - start)
            places.append((number, along.clip(0.0, 1.0)))
    return places
