"""Routing of known tracks through a frame: each span of a track is seen on some observation, or hidden.

A detector may take a wrong turn at a crossing, or end one object where another one begins. Each track is therefore
laid through all observations, and may change from one to another where they pass each other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from dloftbs.tracking.appearance import objects_differ
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.localization import localize
from dloftbs.tracking.observation import Observation
from dloftbs.tracking.partial_match import TrackObservation
from dloftbs.tracking.sample_graph import Interval, SampleGraph, node_spacing
from dloftbs.tracking.track_model import TrackModel

_MAX_SHARED_NODES = 2
"""Number of nodes that two tracks may share where they cross.

Source: geometry; a crossing is about a width long, and so is the node spacing.
"""

_MAX_CLAIMED_SHARE = 0.5
"""Share of a part up to which it counts as unassigned.

Source: by definition; the majority.
"""

_MAX_PART_NODES = 4096
"""Number of nodes' spacings that a part is long at most: an object may be seen beside a speck.

Source: bounds memory.
"""

_MIN_SEEN_SHARE = 0.25
"""Share of a track that must be seen for a route to count.

Source: by hand; shorter parts fit many places.
"""


def route_tracks(
    models: Sequence[TrackModel], observations: Sequence[Observation], view: View
) -> tuple[dict[int, TrackObservation], list[Observation]]:
    """Route tracks through observations.

    Returns what these show of the tracks, by their ids, and the parts of them that no track claims most of.
    """
    parts = [part for one in observations for part in one.split_at_gaps()]
    finest = max(part.length for part in parts) / _MAX_PART_NODES
    graph = SampleGraph(parts, max(finest, *(node_spacing(model) for model in models)))
    others = objects_differ(models, parts)
    routes = [graph.find_route(model, other) for model, other in zip(models, others, strict=True)]
    claimed: dict[int, list[Interval]] = {}
    for t in sorted(range(len(models)), key=lambda t: (routes[t].cost, t)):
        if graph.overlap(routes[t].intervals) > _MAX_SHARED_NODES:
            routes[t] = graph.find_route(models[t], others[t])
        if routes[t].seen_share >= _MIN_SEEN_SHARE:
            claimed[t] = _within_length(graph, routes[t].intervals, models[t])
            graph.claim(claimed[t])
    shown = {
        models[t].id: TrackObservation(tuple(localize(graph, intervals, models[t], view)))
        for t, intervals in claimed.items()
    }
    unassigned = [
        part
        for part, (first, last) in zip(parts, graph.bounds, strict=True)
        if np.count_nonzero(graph.claimed[first : last + 1]) < _MAX_CLAIMED_SHARE * (last + 1 - first)
    ]
    return shown, unassigned


def _within_length(graph: SampleGraph, intervals: list[Interval], model: TrackModel) -> list[Interval]:
    """Return the intervals that one object can show: parts that move away from each other are two.

    Where they are too far apart for its length, they are split at the longest gap, and the longer side stays.
    """
    gaps = [math.dist(graph.points[one.end], graph.points[other.start]) for one, other in pairwise(intervals)]
    lengths = [graph.length(one) for one in intervals]
    width = graph.parts[intervals[0].part].width
    if not gaps or not model.lengths.is_torn(sum(lengths), sum(gaps), width, model.position_tolerance_px):
        return intervals
    cut = max(range(len(gaps)), key=lambda k: gaps[k]) + 1
    kept = intervals[:cut] if sum(lengths[:cut]) >= sum(lengths[cut:]) else intervals[cut:]
    return _within_length(graph, kept, model)
