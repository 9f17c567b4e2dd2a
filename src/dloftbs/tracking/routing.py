"""Tracks known for a while, routed through a frame: every stretch of one is seen on some detection, or hidden.

A detector may take a wrong turn at a crossing, or end one object where another one goes on. Each track is therefore
laid through all that the frame shows, and may go over from one detection to another where they pass each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.observation import Seen
from dloftbs.tracking.association import Known
from dloftbs.tracking.extension import completed, grown
from dloftbs.tracking.kernels.alignment import box_gaps
from dloftbs.tracking.localization import lay
from dloftbs.tracking.partial_match import Piece
from dloftbs.tracking.sample_graph import Run, Scene, spacing_of
from dloftbs.tracking.track_model import Memory

_OVERLAP = 2  # nodes that two tracks may share, where they cross
_FREE = 0.5  # of a part is taken at most, or it is not left over
_MOSTLY = 0.8  # of a track that is seen, or it may have leapt
_ELSEWHERE = 0.4  # of all tracks is less seen, and it is another scene
_LEAST_SHARE = 0.25  # of a track is seen, or it is not routed


class Routed(NamedTuple):
    """Result of routing.

    Parameters
    ----------
    pieces : dict of int to list of Piece
        By the track's number.
    left : list of Seen
        The parts of detections that no track takes most of.
    parts : list of Seen
        All parts that the detections fall into at their long gaps.
    elsewhere : bool
        Whether hardly anything of the tracks is where they are expected, although as much is seen as of them.
    """

    pieces: dict[int, list[Piece]]
    left: list[Seen]
    parts: list[Seen]
    elsewhere: bool


def route(
    memories: Sequence[Memory],
    known: Known,
    rows: Sequence[int],
    seen: Sequence[Seen],
    dt: float,
    gate: float,
    size: tuple[int, int] | None,
) -> Routed:
    """Route tracks through a frame.

    Parameters
    ----------
    memories : sequence of Memory
    known : Known
        Their predicted places.
    rows : sequence of int
        Those to be routed.
    seen : sequence of Seen
        The detections to route them through.
    dt : float
        Seconds since the last frame.
    gate : float
        See `TrackingConfig.gate`.
    size : (int, int) or None
        ``(H, W)`` of the image.
    """
    parts = [part for one in seen for part in one.parts()]
    scene = Scene(parts, max(spacing_of(memories[t]) for t in rows))
    ways = {t: scene.way_of(memories[t], known.points[t], dt) for t in rows}
    gaps = box_gaps(known.points, np.array([one.points for one in seen]))
    for t, way in list(ways.items()):
        near = [seen[d] for d in np.flatnonzero(gaps[t] < gate * memories[t].length).tolist()]
        if way.share < _MOSTLY and any(_may_be_all(memories[t], known.points[t], one, gate) for one in near):
            del ways[t]  # a leap: it is somewhere else as a whole
    length, shown = (sum(one.length for one in those) for those in ([memories[t] for t in rows], seen))
    there = sum(ways[t].share * memories[t].length for t in ways) / length
    elsewhere = len(ways) == len(rows) and there < _ELSEWHERE and shown > (1.0 - _ELSEWHERE) * length
    taken: dict[int, list[Run]] = {}
    for t in sorted(ways, key=lambda t: (ways[t].price, t)):
        if scene.overlap(ways[t].runs) > _OVERLAP:
            ways[t] = scene.way_of(memories[t], known.points[t], dt)
        if ways[t].share >= _LEAST_SHARE:
            taken[t] = ways[t].runs
            scene.take(taken[t])
    places = {one.number: d for d, one in enumerate(seen)}
    for one in [part for p, part in enumerate(parts) if part.clear and scene.share_taken(p) < _FREE]:
        around = gaps[:, places[one.number]] < gate * known.lengths
        for t in [t for t in taken if around[t] and (ways[t].share < 1.0 or len(taken[t]) > 1)]:
            if _may_be_all(memories[t], known.points[t], one, gate):
                scene.give_back(taken.pop(t))  # it is there as a whole, and not where its pieces seemed to be
                break
    pieces = {}
    for t, runs in taken.items():
        whole = completed(scene, runs, memories[t])
        pieces[t] = lay(scene, grown(scene, whole, memories[t]), memories[t], size)
    left = [part for p, part in enumerate(parts) if scene.share_taken(p) < _FREE]
    return Routed(pieces, left, parts, elsewhere)


def _may_be_all(memory: Memory, expected: FloatArray, one: Seen, gate: float) -> bool:
    """Tell whether a detection without gaps, as long as a track, is near enough to be all of it."""
    as_long = abs(one.length - memory.length) <= memory.slack_px or memory.is_as_usual(one.length)
    if not one.clear or one.curve.closed or not as_long:
        return False
    away = min(np.hypot(*(points - expected).T).mean() for points in (one.points, one.points[::-1]))
    return bool(away < gate * memory.length)
