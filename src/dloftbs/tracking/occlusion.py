"""Hidden and absent parts of a track: a past that frames contradict is given up within a few of them."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

import numpy as np

from dloftbs.observation import U
from dloftbs.tracking.alignment import at_border
from dloftbs.tracking.partial_match import WHOLE, Piece, follows, hidden_between
from dloftbs.tracking.track_model import TRUSTED, Memory

_SAME = 1e-9


def believe(
    memory: Memory, pieces: Sequence[Piece], size: tuple[int, int] | None
) -> tuple[list[Piece], list[Piece], tuple[float, float]]:
    """Return which pieces are parts of a track, which are not, and which stretch of the former ``u`` the track now is.

    A stretch that is not seen is believed to be hidden while it was seen in some frames before. Beyond the image
    anything may be, and of a gap that the detector bridges there is no doubt. Pieces that only such a stretch would
    join, which is not believed, are no parts of one track: the longest stays.
    """
    doubted = [stretch for stretch in hidden_between(pieces) if not _is_sure(memory, pieces, stretch, size)]
    gone = [stretch for stretch in doubted if trust_in(memory, stretch) < TRUSTED]
    if not gone:
        return list(pieces), [], WHOLE
    groups = _split(pieces, gone)
    kept = max(groups, key=lambda group: sum(p.at[1] - p.at[0] for p in group))
    low = max((high for _, high in gone if high <= kept[0].at[0] + _SAME), default=0.0)
    high = min((low for low, _ in gone if low >= kept[-1].at[1] - _SAME), default=1.0)
    memory.remap(low + U * (high - low))
    memory.length *= high - low
    moved = [p._replace(at=((p.at[0] - low) / (high - low), (p.at[1] - low) / (high - low))) for p in kept]
    return moved, [piece for group in groups if group is not kept for piece in group], (low, high)


def _split(pieces: Sequence[Piece], gone: Sequence[tuple[float, float]]) -> list[list[Piece]]:
    """Return the pieces in groups, with the parts between them that are gone."""
    groups: list[list[Piece]] = [[]]
    for piece in pieces:
        if groups[-1] and any(abs(piece.at[0] - high) < _SAME for _, high in gone):
            groups.append([])
        groups[-1].append(piece)
    return groups


def trust_in(memory: Memory, stretch: tuple[float, float]) -> float:
    """Return in how many frames a stretch was seen, up to a bound."""
    return statistics.median(np.interp(np.linspace(*stretch, 9), U, memory.trust).tolist())


def _is_sure(
    memory: Memory, pieces: Sequence[Piece], stretch: tuple[float, float], size: tuple[int, int] | None
) -> bool:
    """Tell whether a hidden stretch begins at the border of the image, or the detector says that something is there."""
    if stretch[0] > 0.0 and stretch[1] < 1.0:
        before = next(p for p in pieces if abs(p.at[1] - stretch[0]) < _SAME)
        after = next(p for p in pieces if abs(p.at[0] - stretch[1]) < _SAME)
        return follows(before, after)
    if size is None:
        return False
    end = pieces[0].seen.points[0] if stretch[0] <= 0.0 else pieces[-1].seen.points[-1]
    return at_border(end, size, memory.width)
