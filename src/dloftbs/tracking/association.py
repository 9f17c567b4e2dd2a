"""Association of a frame's observations with the tracks: its readings, which the later steps take; nothing is changed.

Unambiguous matches come first. Tracks that are known well are then routed through the frame, others are assigned
observations as a whole; at last the only object left is the only track left.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from dloftbs.tracking.alignment import match_whole
from dloftbs.tracking.assignment import assign, match_remaining, match_unambiguous
from dloftbs.tracking.branch_roles import Roles, match_roles
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.length_record import HISTORY_FRAMES
from dloftbs.tracking.observation import Observation
from dloftbs.tracking.partial_match import TrackObservation
from dloftbs.tracking.reading_features import Reading
from dloftbs.tracking.readings import rank_readings, score_all
from dloftbs.tracking.resolution import resolve
from dloftbs.tracking.routing import route_tracks
from dloftbs.tracking.track_model import TrackModel


class FrameReading(NamedTuple):
    """One way to read a frame: all that it shows of some tracks.

    Parameters
    ----------
    shown : list of TrackObservation
        In the order of the tracks.
    nats : float
        Log-odds, up to a constant of the frame; 0 if nothing is compared.
    """

    shown: list[TrackObservation]
    nats: float = 0.0


def associate(
    models: Sequence[TrackModel],
    observations: Sequence[Observation],
    view: View,
    gate: float,
    *,
    roles: Roles | None = None,
    is_compared: bool = False,
) -> list[FrameReading]:
    """Return what a frame may show of each track, by where it is predicted, the likeliest reading first.

    `roles` are those of the branches of objects in the last frame that was read as this one. `is_compared` says that
    their log-odds are needed even if there is only one.
    """
    pairs = min(len(models), len(observations))
    shown = match_unambiguous(models, observations, gate) if pairs else {}
    shown = resolve(models, shown, view)
    if roles and len(shown) < pairs:
        rest, left = _left_over(models, observations, shown)
        shown |= resolve(rest, _associate_branches(rest, left, view, gate, roles), view)
    readings: list[tuple[float, Reading]] = [(0.0, {})]
    if len(shown) < pairs:
        rest, left = _left_over(models, observations, shown)
        of_tracks = resolve(rest, _associate_ambiguous(rest, left, view, gate), view)
        readings = rank_readings(rest, left, of_tracks, view, gate)
    nats = 0.0
    if is_compared or len(readings) > 1:
        nats = score_all((models, observations), shown | dict(readings[0][1]), view)
    return [
        FrameReading([shown.get(model.id) or one.get(model.id) or TrackObservation() for model in models], nats - lost)
        for lost, one in readings
    ]


def _left_over(
    models: Sequence[TrackModel], observations: Sequence[Observation], shown: Mapping[int, TrackObservation]
) -> tuple[list[TrackModel], list[Observation]]:
    """Return the tracks that have no match yet, and the observations that are no match yet."""
    taken = {match.observation.detection_index for one in shown.values() for match in one.matches}
    rest = [model for model in models if model.id not in shown]
    return rest, [one for one in observations if one.detection_index not in taken]


def _associate_branches(
    models: Sequence[TrackModel], observations: Sequence[Observation], view: View, gate: float, roles: Roles
) -> dict[int, TrackObservation]:
    """Return what the branches of objects show of the tracks that were they, by their ids."""
    shown = {}
    for model, one in match_roles(models, observations, roles):
        near = assign([model], [one], view, gate)
        shown[model.id] = TrackObservation((near[model.id][1] if near else match_whole(model, one),))
    return shown


def _associate_ambiguous(
    models: Sequence[TrackModel], observations: Sequence[Observation], view: View, gate: float
) -> dict[int, TrackObservation]:
    """Return what ambiguous observations show of the tracks, by their ids."""
    shown, unassigned = dict[int, TrackObservation](), list(observations)
    known = [model for model in models if not (model.misses or model.curve.closed or model.belief.is_refuted)]
    if known:
        shown, unassigned = route_tracks(known, observations, view)
    rest = [model for model in models if model.id not in shown]
    if unassigned and rest:
        assigned = assign(rest, unassigned, view, gate)
        shown |= {t: TrackObservation((match,)) for t, (_, match) in assigned.items()}
        taken = {d for d, _ in assigned.values()}
        unassigned = [one for d, one in enumerate(unassigned) if d not in taken]
        rest = [model for model in rest if model.id not in shown]
    return _mark_apart(models, shown) | match_remaining(rest, unassigned)


def _mark_apart(models: Sequence[TrackModel], shown: dict[int, TrackObservation]) -> dict[int, TrackObservation]:
    """Return what a frame shows of the tracks with the pairs marked that together are one detection, but are two.

    The detection may bridge a gap between them.
    """
    result, sharing = dict(shown), dict[int, list[TrackModel]]()
    for model in models:
        for index in shown[model.id].detection_indices if model.id in shown else ():
            sharing.setdefault(index, []).append(model)
    for index, pair in sharing.items():
        if len(pair) != 2:
            continue
        matches = shown[pair[0].id].matches
        shared = next(m.observation for m in matches if m.observation.detection_index == index)
        bridged = shared.object_length * sum(high - low for low, high in shared.gaps)
        tolerance = sum(m.position_tolerance_px for m in pair)
        excess = sum(m.length for m in pair) - shared.object_length
        known = pair[1].id in pair[0].apart or pair[0].id in pair[1].apart
        if abs(excess + bridged) < tolerance and (known or _moved_apart(pair[0], pair[1], bridged)):
            for model, other in zip(pair, pair[::-1], strict=True):
                one = result[model.id]
                result[model.id] = one._replace(apart_from=one.apart_from | {other.id})
    return result


def _moved_apart(one: TrackModel, other: TrackModel, bridged_px: float) -> bool:
    """Return True if the ends where two tracks meet were ever farther apart or nearer, the tracks being as long as now.

    Parts that grow together are one object, and an end that was hidden may have gone on. `bridged_px` is the length of
    the gaps of the detection.
    """
    last = one.lengths.frames, other.lengths.frames
    back = np.arange(min(*last, HISTORY_FRAMES - 1))
    if not len(back):
        return False
    first, second = ((frames - back) % HISTORY_FRAMES for frames in last)
    now = one.points[[0, -1]][:, None] - other.points[[0, -1]]
    i, j = np.unravel_index(np.linalg.norm(now, axis=2).argmin(), (2, 2))
    distances = np.linalg.norm(one.lengths.recent_ends[first, i] - other.lengths.recent_ends[second, j], axis=1)
    as_now = np.abs(one.lengths.recent_px[first] - one.length) < one.position_tolerance_px
    as_now &= np.abs(other.lengths.recent_px[second] - other.length) < other.position_tolerance_px
    moved = np.abs(distances[as_now] - min(float(np.linalg.norm(now[i, j])), bridged_px))
    return bool((moved > one.position_tolerance_px + other.position_tolerance_px).any())
