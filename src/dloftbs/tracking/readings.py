"""Decision between two readings of a frame: its detections as whole objects, or the tracks laid through them.

Each group of tracks and detections that a reading connects has its own, weighed by a fitted sum of measures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from dloftbs.tracking.appearance import objects_differ
from dloftbs.tracking.assignment import compute_gates
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels.pairs import mean_distances
from dloftbs.tracking.observation import Observation
from dloftbs.tracking.partial_match import WHOLE, PartialMatch, TrackObservation
from dloftbs.tracking.reading_features import Reading, length_surprise, measure_reading, measure_unseen, median_width
from dloftbs.tracking.reading_weights import WEIGHTS
from dloftbs.tracking.track_model import TrackModel

_PLACE_WIDTHS = 3.0
"""Distance from where an object is predicted that costs a nat, widths.

Source: by hand; about the step of a cable that is moved fast, from frame to frame.
"""

_PER_DEVIATION = 0.5
"""Cost of a deviation of a length, nats.

Source: by hand; a length that is off by its largest surprise costs as much as fifteen widths.
"""

_APART = 10.0
"""Cost from which an observation is another object than a track, nats.

Source: by hand; thirty widths away, or a dozen and of another length.
"""

_CLEARLY_NEARER = 0.8
"""Ratio of the distances of an object from its track, one way and the other, below which it shows its direction.

Source: by hand; a part of a spiral lies nearly as far off either way.
"""

Group = tuple[Sequence[TrackModel], Sequence[Observation]]
"""Tracks and observations that some reading connects."""


def match_whole_objects(
    models: Sequence[TrackModel], observations: Sequence[Observation], of_tracks: Reading, view: View, gate: float
) -> Reading:
    """Return the best reading of a frame in which each observation is a whole object: a track's, or a new one.

    It lies within the gate, a share of its length, of where the track is predicted. A track against whose shape more
    speaks than for it may be a part of it. Loops have no ends that would say where an observation lies on them, and are
    left out, and so are those that are short and end under what hides them. What lies about as near in either direction
    has that in which parts of it show the track, `of_tracks`.
    """
    if not models or not observations:
        return {}
    width = median_width(models, observations)
    gates = compute_gates(models, np.array([one.length for one in observations]), gate)
    predicted, found = np.array([model.predicted for model in models]), np.array([one.points for one in observations])
    is_open = ~np.logical_or.outer([model.curve.closed for model in models], [one.curve.closed for one in observations])
    nearer = np.where(is_open & ~objects_differ(models, observations), gates, 0.0)
    is_part = np.array([model.belief.log_odds < 0.0 for model in models])
    there, back = mean_distances(predicted, found, nearer, is_part)
    nearest, cost = np.minimum(there, back), np.full(gates.shape, _APART)
    for t, d in np.argwhere(nearest < gates).tolist():
        model, one = models[t], observations[d]
        if not (model.is_short(one) and any(end.hidden for end in view.ends(one, model.width))):
            place = nearest[t, d] / (_PLACE_WIDTHS * width)
            surprise = place + _PER_DEVIATION * length_surprise(model, one, one.object_length)
            cost[t, d] = min(surprise, _APART)
    backwards = back < there
    is_doubtful = nearest >= _CLEARLY_NEARER * np.maximum(there, back)
    result = dict[int, TrackObservation]()
    for t, d in zip(*linear_sum_assignment(cost), strict=True):
        if cost[t, d] < _APART:
            one, shown = observations[d], of_tracks.get(models[t].id)
            direction = _runs_backwards(one, shown) if is_doubtful[t, d] and shown is not None else None
            way = one.reversed() if (backwards[t, d] if direction is None else direction) else one
            result[models[t].id] = TrackObservation((PartialMatch(way, WHOLE, WHOLE),))
    return result


def _runs_backwards(one: Observation, shown: TrackObservation) -> bool | None:
    """Return whether the longest part of an observation shows a track backwards; None if no part of it does."""
    parts = [match.observation for match in shown.matches if match.observation.detection_index == one.detection_index]
    return max(parts, key=lambda part: part.length).backwards != one.backwards if parts else None


def rank_readings(
    models: Sequence[TrackModel], observations: Sequence[Observation], of_tracks: Reading, view: View, gate: float
) -> list[tuple[float, Reading]]:
    """Return the likeliest reading, and those that differ from it in one group of tracks and observations.

    Parameters
    ----------
    models, observations
        Those that the readings are about.
    of_tracks : dict of int to TrackObservation
        The tracks laid through them.
    view : View
    gate : float
        Of whole objects, a share of their length: what is within it is one group, too.

    Returns
    -------
    list of (float, dict of int to TrackObservation)
        Each with its log-odds less than those of the likeliest one, which is the first, nats.
    """
    likeliest = dict[int, TrackObservation]()
    others: list[tuple[float, Reading, Reading]] = []
    of_frame = match_whole_objects(models, observations, of_tracks, view, gate)
    for group in find_groups(models, observations, (of_frame, of_tracks)):
        tracks = {model.id: of_tracks[model.id] for model in group[0] if model.id in of_tracks}
        frame = {model.id: of_frame[model.id] for model in group[0] if model.id in of_frame}
        if frame.keys() >= tracks.keys() and all(one.is_whole for one in tracks.values()):
            likeliest |= frame  # both are of whole objects, and this one has the least cost
            continue
        candidates = list_readings(group, tracks, view)
        nats = weigh(group, candidates, view) if len(candidates) > 1 else [0.0]
        best = int(np.argmax(nats))
        likeliest |= candidates[best]
        others += [(nats[best] - nats[k], candidates[best], one) for k, one in enumerate(candidates) if k != best]
    result: list[tuple[float, Reading]] = [(0.0, likeliest)]
    for lost, best_of_group, other in others:
        result.append((lost, {i: one for i, one in likeliest.items() if i not in best_of_group} | dict(other)))
    return result


def list_readings(group: Group, of_tracks: Reading, view: View) -> list[Reading]:
    """List the readings of a group that are weighed: that of the tracks, and the frame's own.

    There is none of the frame's own where it shows no track, of loops, whose start only the past knows, and where two
    tracks were seen to move apart.
    """
    # The tracks are seen here in parts at least, so that the gate has no say in where they are as a whole.
    whole = match_whole_objects(*group, of_tracks, view, math.inf)
    loops = any(one.curve.closed for some in group for one in some)
    if not whole or loops or any(one.apart_from for one in of_tracks.values()) or not _differ(whole, of_tracks):
        return [of_tracks]
    return [of_tracks, whole]


def weigh(group: Group, candidates: Sequence[Reading], view: View) -> list[float]:
    """Return the log-odds of readings of a group, nats."""
    return [score(group, reading, view) for reading in candidates]


def score(group: Group, reading: Reading, view: View) -> float:
    """Return the log-odds of a reading, up to a constant, nats."""
    return float(np.dot(WEIGHTS, measure_reading(*group, reading, view)))


def score_all(group: Group, reading: Reading, view: View) -> float:
    """Return the log-odds of a reading against those of other tracks, too, up to a constant of the frame, nats."""
    unseen = measure_unseen([model for model in group[0] if model.id not in reading])
    return score(group, reading, view) + float(np.dot(WEIGHTS, unseen))


def find_groups(
    models: Sequence[TrackModel], observations: Sequence[Observation], readings: Sequence[Reading]
) -> list[Group]:
    """Return the tracks and the observations in groups that no reading connects."""
    groups: list[tuple[list[TrackModel], list[Observation]]] = [([model], []) for model in models]
    group_of = {model.id: k for k, model in enumerate(models)}
    owner = dict[int, int]()
    for reading in readings:
        for i, shown in reading.items():
            for index in shown.detection_indices:
                kept, other = group_of[i], owner.setdefault(index, group_of[i])
                if kept != other:
                    for model in groups[other][0]:
                        group_of[model.id] = kept
                    groups[kept][0].extend(groups[other][0])
                    groups[other] = ([], [])
                    owner = {d: kept if k == other else k for d, k in owner.items()}
    for one in observations:
        if one.detection_index in owner:
            groups[owner[one.detection_index]][1].append(one)
    return [group for group in groups if group[0]]


def _differ(one: Mapping[int, TrackObservation], other: Mapping[int, TrackObservation]) -> bool:
    """Return whether two readings of a group differ: in a whole object, or in its direction."""
    if one.keys() != other.keys():
        return True
    return not all(other[i].is_whole and other[i].agrees_with(one[i]) for i in one)
