"""Measures of a reading of a frame: of which detection, or which parts of several, show which track."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from dloftbs.evidence import HIDDEN, IN_SIGHT
from dloftbs.support.arrays import FloatArray
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels.interpolation import interpolate
from dloftbs.tracking.observation import Observation
from dloftbs.tracking.partial_match import TrackObservation, hidden_spans
from dloftbs.tracking.sight import samples_within
from dloftbs.tracking.track_model import TrackModel

_UNKNOWN_WIDTH_PX = 10.0
"""Width of objects of unknown width, px.

Source: by hand; a cable's in an image of 1280 x 720.
"""

_LENGTH_SHARE, _LENGTH_WIDTHS = 0.02, 1.0
"""Deviation of a length from frame to frame: its share of the length, and in widths.

Source: measured; two thirds of the steps of real motion before a camera, with the noise of two ends.
"""

_MAX_SURPRISE = 10.0
"""Largest surprise by a length, deviations.

Source: by hand; beyond it all lengths are alike.
"""

_SAMPLES = 9
"""Number of samples along a hidden stretch at which other objects are sought.

Source: bounds time.
"""

Reading = Mapping[int, TrackObservation]
"""What a frame shows of each track, by its id."""


class Features(NamedTuple):
    """Measures of a reading, summed over tracks and observations; lengths in widths w count as log(1 + w).

    Parameters
    ----------
    length : float
        Surprise by the lengths of whole objects, deviations.
    place : float
        Mean distances of whole objects from where they are predicted.
    clear : float
        Log-odds of the detections that are whole objects, by the frame alone, nats.
    parts : float
        Number of tracks that are seen in parts.
    sure_parts : float
        The same, each weighted with the certainty of its former shape, in -1..1.
    part_length, part_place : float
        As `length` and `place`, of tracks that are seen in parts.
    hidden : float
        Lengths that are taken for hidden.
    covered, in_sight, known_hidden : float
        Of these, what lies on other objects, in plain sight, and under what is known to hide it.
    overruled : float
        Number of detections that show parts of tracks, and no whole one.
    unclaimed : float
        Lengths of detections that show no track.
    births, lost : float
        Number of detections that start a track, and of tracks that the frame does not show.
    sure_lost : float
        The latter weighted as `sure_parts`.
    """

    length: float = 0.0
    place: float = 0.0
    clear: float = 0.0
    parts: float = 0.0
    sure_parts: float = 0.0
    part_length: float = 0.0
    part_place: float = 0.0
    hidden: float = 0.0
    covered: float = 0.0
    in_sight: float = 0.0
    known_hidden: float = 0.0
    overruled: float = 0.0
    unclaimed: float = 0.0
    births: float = 0.0
    lost: float = 0.0
    sure_lost: float = 0.0


def measure_reading(
    models: Sequence[TrackModel], observations: Sequence[Observation], reading: Reading, view: View
) -> FloatArray:
    """Measure what a frame shows of some tracks by a reading of some observations, shape (number of `Features`,)."""
    width = median_width(models, observations)
    total = np.zeros(len(Features._fields))
    claimed = {one.detection_index: 0.0 for one in observations}
    whole = set[int]()
    for model in models:
        shown = reading.get(model.id)
        if shown is None:
            total += Features(lost=1.0, sure_lost=model.shape_certainty)
            continue
        total += _measure_track(model, shown, observations, view, width)
        for match in shown.matches:
            claimed[match.observation.detection_index] += match.curve_span[1] - match.curve_span[0]
        if shown.is_whole:
            whole.add(shown.matches[0].observation.detection_index)
    for one in observations:
        share = claimed[one.detection_index]
        total += Features(
            overruled=float(share > 0.0 and one.detection_index not in whole),
            births=float(share == 0.0),
            unclaimed=math.log1p(max(1.0 - share, 0.0) * one.object_length / width),
        )
    return total


def median_width(models: Sequence[TrackModel], observations: Sequence[Observation]) -> float:
    """Return the median width of tracks and observations, px."""
    widths = [model.width for model in models] + [one.width for one in observations]
    known = [width for width in widths if not math.isnan(width)]
    return (float(np.median(known)) if known else 0.0) or _UNKNOWN_WIDTH_PX


def _measure_track(
    model: TrackModel, shown: TrackObservation, observations: Sequence[Observation], view: View, width: float
) -> Features:
    first = shown.matches[0].observation
    if shown.is_whole:
        return Features(
            length=length_surprise(model, first, first.object_length),
            place=math.log1p(mean_distance(model.predicted, first.points) / width),
            clear=first.log_odds,
        )
    spans = hidden_spans(shown.matches)
    hidden = samples_within(spans)
    told = view.look(model.predicted, model.width, model.curve_3d) if spans else None
    per_sample = model.length / len(hidden) / width
    seen = place = 0.0
    for match in shown.matches:
        seen += (match.curve_span[1] - match.curve_span[0]) * match.observation.object_length
        low, high = np.clip(match.track_span, 0.0, 1.0)
        expected = interpolate(model.predicted, np.linspace(low, high, len(model.predicted)))
        place += mean_distance(expected, match.observation.points) / len(shown.matches)
    return Features(
        parts=1.0,
        sure_parts=model.shape_certainty,
        part_length=length_surprise(model, first, seen),
        part_place=math.log1p(place / width),
        hidden=math.log1p(sum(high - low for low, high in spans) * model.length / width),
        covered=math.log1p(sum(_length_on(model, span, observations, width) for span in spans) / width),
        in_sight=0.0 if told is None else math.log1p(np.count_nonzero(hidden & (told == IN_SIGHT)) * per_sample),
        known_hidden=0.0 if told is None else math.log1p(np.count_nonzero(hidden & (told == HIDDEN)) * per_sample),
    )


def mean_distance(points: FloatArray, others: FloatArray) -> float:
    """Return the mean distance of points (n, 2) from others in the same order, px."""
    return float(np.hypot(*(points - others).T).mean())


def length_surprise(model: TrackModel, one: Observation, length: float) -> float:
    """Return by how many deviations a length, px, differs from what is known of a track in an observation's view."""
    known = model.usual_length(one)
    width = _UNKNOWN_WIDTH_PX if math.isnan(model.width) else model.width
    return min(abs(length - known) / (_LENGTH_SHARE * known + _LENGTH_WIDTHS * width), _MAX_SURPRISE)


def _length_on(
    model: TrackModel, span: tuple[float, float], observations: Sequence[Observation], width: float
) -> float:
    """Return how much of a span of a track, as predicted, lies within a width of any observation, px."""
    places = interpolate(model.predicted, np.linspace(max(span[0], 0.0), min(span[1], 1.0), _SAMPLES))
    near = np.zeros(_SAMPLES, np.bool_)
    for one in observations:
        apart = places[:, None] - one.points
        near |= np.hypot(apart[..., 0], apart[..., 1]).min(axis=1) < width
    return float(near.mean()) * (span[1] - span[0]) * model.length
