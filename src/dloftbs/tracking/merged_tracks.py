"""Tracks that together are one detection: two objects that touch, or one object that was split."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dloftbs.tracking.length_record import HISTORY_FRAMES
from dloftbs.tracking.partial_match import TrackObservation
from dloftbs.tracking.track_model import TrackModel


def find_merged(models: Sequence[TrackModel], shown: Sequence[TrackObservation]) -> list[TrackObservation]:
    """Return what a frame shows of the tracks with the pairs marked that together are one detection."""
    result, sharing = list(shown), dict[int, list[int]]()
    for t, one in enumerate(shown):
        for index in one.detection_indices:
            sharing.setdefault(index, []).append(t)
    for index, tracks in sharing.items():
        if len(tracks) != 2:
            continue
        matches = shown[tracks[0]].matches
        length = next(m.observation.object_length for m in matches if m.observation.detection_index == index)
        pair = [models[t] for t in tracks]
        if abs(sum(m.length for m in pair) - length) < sum(m.position_tolerance_px for m in pair):
            separate = any(m.conflict.known_separate for m in pair) or _were_separate(*pair)
            for t in tracks:
                result[t] = result[t]._replace(merged=not separate, known_separate=separate)
    return result


def _were_separate(one: TrackModel, other: TrackModel) -> bool:
    """Return True if two tracks, as long as now, ever had their ends apart; parts that grow together are one object."""
    back = np.arange(min(one.hits, other.hits, HISTORY_FRAMES - 1))
    if not len(back):
        return False
    first, second = (one.hits - back) % HISTORY_FRAMES, (other.hits - back) % HISTORY_FRAMES
    ends = one.lengths.recent_ends[first][:, :, None], other.lengths.recent_ends[second][:, None, :]
    distances = np.linalg.norm(ends[0] - ends[1], axis=3).min(axis=(1, 2))
    as_now = np.abs(one.lengths.recent_px[first] - one.length) < one.position_tolerance_px
    as_now &= np.abs(other.lengths.recent_px[second] - other.length) < other.position_tolerance_px
    return bool((distances[as_now] > one.position_tolerance_px + other.position_tolerance_px).any())
