"""Tracks that together are one detection: two objects that touch, or one object that was split."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from dloftbs.tracking.partial_match import TrackObservation
from dloftbs.tracking.track_model import HISTORY_FRAMES, TrackModel

_CORNER_SAMPLES = 4
"""Number of samples that tell the direction of an end.

Source: by hand; a sixteenth of the length.
"""

_MIN_STRAIGHT_COSINE = 0.7
"""Cosine between two ends that meet below which they make a corner.

Source: by hand; a turn of 45 degrees.
"""


def find_merged(models: Sequence[TrackModel], track_observations: Sequence[TrackObservation]) -> None:
    """Find pairs of tracks that together are one detection: two objects that touch, or one that was split."""
    sharing: dict[int, list[int]] = {}
    for t, one in enumerate(track_observations):
        for index in one.detection_indices:
            sharing.setdefault(index, []).append(t)
    for index, tracks in sharing.items():
        if len(tracks) != 2:
            continue
        matches = track_observations[tracks[0]].matches
        length = next(m.observation.object_length for m in matches if m.observation.detection_index == index)
        pair = [models[t] for t in tracks]
        if abs(sum(m.length for m in pair) - length) < sum(m.position_tolerance_px for m in pair):
            separate = any(m.known_separate for m in pair) or _were_separate(*pair) or _meet_at_corner(*pair)
            for t in tracks:
                track_observations[t].merged, track_observations[t].known_separate = not separate, separate


def _were_separate(one: TrackModel, other: TrackModel) -> bool:
    """Return True if two tracks, as long as now, ever had their ends apart; parts that grow together are one object."""
    back = np.arange(min(one.hits, other.hits, HISTORY_FRAMES - 1))
    if not len(back):
        return False
    first, second = (one.hits - back) % HISTORY_FRAMES, (other.hits - back) % HISTORY_FRAMES
    ends = one.recent_ends[first][:, :, None], other.recent_ends[second][:, None, :]
    distances = np.linalg.norm(ends[0] - ends[1], axis=3).min(axis=(1, 2))
    as_now = np.abs(one.recent_lengths[first] - one.length) < one.position_tolerance_px
    as_now &= np.abs(other.recent_lengths[second] - other.length) < other.position_tolerance_px
    return bool((distances[as_now] > one.position_tolerance_px + other.position_tolerance_px).any())


def _meet_at_corner(one: TrackModel, other: TrackModel) -> bool:
    """Return True if two tracks make a corner where their nearest ends meet, which a single object rarely has."""
    ends = [(points, points[::-1]) for points in (one.points, other.points)]
    first, second = min(itertools.product(*ends), key=lambda pair: math.dist(pair[0][0], pair[1][0]))
    before, after = first[0] - first[_CORNER_SAMPLES], second[_CORNER_SAMPLES] - second[0]
    return float(before @ after) < _MIN_STRAIGHT_COSINE * math.hypot(*before) * math.hypot(*after)
