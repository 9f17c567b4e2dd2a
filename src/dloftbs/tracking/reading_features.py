"""Measures of a reading of a frame: of which detection, or which parts of several, show which track."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from dloftbs.data.curve_samples import SAMPLES, U
from dloftbs.evidence import HIDDEN
from dloftbs.support.arrays import BoolArray, FloatArray
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels.interpolation import interpolate
from dloftbs.tracking.kernels.pairs import lie_near, mean_distance
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

Reading = Mapping[int, TrackObservation]
"""What a frame shows of each track, by its id."""


class Features(NamedTuple):
    """Measures of a reading, summed over tracks and observations; lengths in widths w count as log(1 + w).

    Parameters
    ----------
    length : float
        Surprise by the lengths of whole objects, deviations.
    place : float
        Mean distances of whole objects from where their tracks are predicted.
    clear : float
        Log-odds of the detections that are whole objects, by the frame alone, nats.
    parts : float
        Number of tracks that are seen in parts.
    belief : float
        Log-odds of their shapes, by the frames before, nats.
    part_place : float
        Mean distances of the parts of tracks from where they are predicted.
    covered : float
        Lengths that are taken for hidden where other objects lie, or the frame shows what hides them.
    bare : float
        Lengths that are taken for hidden elsewhere.
    unclaimed : float
        Lengths of detections that show no track.
    """

    length: float = 0.0
    place: float = 0.0
    clear: float = 0.0
    parts: float = 0.0
    belief: float = 0.0
    part_place: float = 0.0
    covered: float = 0.0
    bare: float = 0.0
    unclaimed: float = 0.0


def measure_reading(
    models: Sequence[TrackModel], observations: Sequence[Observation], reading: Reading, view: View
) -> FloatArray:
    """Measure what a frame shows of some tracks by a reading of some observations, shape (number of `Features`,)."""
    width = median_width(models, observations)
    total = np.zeros(len(Features._fields))
    claimed = {one.detection_index: 0.0 for one in observations}
    for model in models:
        shown = reading.get(model.id)
        if shown is not None:
            total += _measure_track(model, shown, observations, view, width)
            for match in shown.matches:
                claimed[match.observation.detection_index] += match.curve_span[1] - match.curve_span[0]
    for one in observations:
        left = max(1.0 - claimed[one.detection_index], 0.0) * one.object_length
        total += Features(unclaimed=math.log1p(left / width))
    return total


def measure_unseen(models: Sequence[TrackModel]) -> FloatArray:
    """Measure tracks of which a frame shows nothing: each is in parts, and all of it is hidden."""
    total = np.zeros(len(Features._fields))
    for model in models:
        total += Features(parts=1.0, bare=math.log1p(model.length / _known_width(model)))
    return total


def median_width(models: Sequence[TrackModel], observations: Sequence[Observation]) -> float:
    """Return the median width of tracks and observations, px."""
    widths = [model.width for model in models] + [one.width for one in observations]
    known = [width for width in widths if not math.isnan(width)]
    return (statistics.median(known) if known else 0.0) or _UNKNOWN_WIDTH_PX


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
    place = 0.0
    for match in shown.matches:
        low, high = match.clip_to_track().track_span
        expected = interpolate(model.predicted, low + (high - low) * U)
        place += mean_distance(expected, match.observation.points) / len(shown.matches)
    hidden = samples_within(hidden_spans(shown.matches))
    covered = hidden & _is_covered(model, observations, view, width)
    lengths = [np.count_nonzero(some) * model.length / SAMPLES for some in (covered, hidden & ~covered)]
    return Features(
        parts=1.0,
        belief=model.belief.log_odds,
        part_place=math.log1p(place / width),
        covered=math.log1p(lengths[0] / width),
        bare=math.log1p(lengths[1] / width),
    )


def _is_covered(model: TrackModel, observations: Sequence[Observation], view: View, width: float) -> BoolArray:
    """Return which samples of a track, as predicted, lie on any observation, or under what is known to hide them."""
    covered = lie_near(model.predicted, np.array([one.points for one in observations]), width)
    known = view.look(model.predicted, model.width, model.shape_3d)
    return covered if known is None else covered | (known == HIDDEN)


def length_surprise(model: TrackModel, one: Observation, length: float) -> float:
    """Return by how many deviations a length, px, differs from what is known of a track in an observation's view."""
    known = model.usual_length(one)
    return min(abs(length - known) / (_LENGTH_SHARE * known + _LENGTH_WIDTHS * _known_width(model)), _MAX_SURPRISE)


def _known_width(model: TrackModel) -> float:
    return model.width_or_0 or _UNKNOWN_WIDTH_PX
