"""Detections with gaps that begin and end where a track does: they are all of it, whatever is hidden between."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.tracking.matching import Known
from dloftbs.tracking.memory import Memory
from dloftbs.tracking.pieces import WHOLE, Piece
from dloftbs.tracking.seeing import Seen

_LENGTH_RATIO = 0.9  # the detector bridges gaps by the shortest way
_NEAR_WIDTHS, _NEAR_SHARE = 1.5, 0.01  # of an end, in widths and lengths
_MEAN_SHARE = 0.04  # of the length: the mean distance that is bridged


def match_by_ends(memories: Sequence[Memory], known: Known, seen: Sequence[Seen]) -> dict[int, tuple[int, list[Piece]]]:
    """Map tracks to detections with both ends where theirs are expected, and with which parts of the track they show.

    Only pairs of which neither fits anything else so.
    """
    fits: list[tuple[int, int, Seen]] = []
    for t, memory in enumerate(memories):
        for d, one in enumerate(seen):
            shown = _run_along(memory, known.points[t], one)
            if shown is not None:
                fits.append((t, d, shown))
    tracks, detections = [t for t, _, _ in fits], [d for _, d, _ in fits]
    return {
        t: (d, _lay(memories[t], shown)) for t, d, shown in fits if tracks.count(t) == 1 and detections.count(d) == 1
    }


def _run_along(memory: Memory, expected: FloatArray, one: Seen) -> Seen | None:
    """Return a detection run the track's way, or None where it is not all of it."""
    ratio = one.length / memory.length
    if one.clear or one.curve.closed or memory.curve.closed or not _LENGTH_RATIO < ratio < 1.0 / _LENGTH_RATIO:
        return None
    width = 0.0 if math.isnan(memory.width) else memory.width
    reach = _NEAR_WIDTHS * width + _NEAR_SHARE * memory.length
    for shown in (one, one.reversed()):
        away = np.hypot(*(shown.points - expected).T)
        if max(away[0], away[-1]) < reach and away.mean() < _MEAN_SHARE * memory.length:
            return shown
    return None


def _lay(memory: Memory, shown: Seen) -> list[Piece]:
    """Lay the parts between a detection's long gaps on a track: the gaps are as long as what else the track has."""
    parts = shown.parts(crossings=False)
    seen_px = sum(part.length for part in parts)
    hidden_px = memory.length - seen_px
    if len(parts) < 2 or hidden_px <= memory.tolerance_px:
        return [Piece(shown, WHOLE, shown.of)]
    gaps = [after.of[0] - before.of[1] for before, after in pairwise(parts)]
    pieces, at = [], 0.0
    for part, gap in zip(parts, [*gaps, 0.0], strict=True):
        high = at + part.length / memory.length
        pieces.append(Piece(part, (at, high), part.of))
        at = high + gap / sum(gaps) * hidden_px / memory.length
    pieces[-1] = pieces[-1]._replace(at=(pieces[-1].at[0], 1.0))
    return pieces
