"""Pieces of one object put together: what lies between them, what of it is inferred, and the same in space."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from dloftbs.curve import BSplineCurve
from dloftbs.observation import Seen, sample
from dloftbs.tracking import loop_start
from dloftbs.tracking.alignment import leaving
from dloftbs.tracking.occlusion import trust_in
from dloftbs.tracking.partial_match import WHOLE, Piece, Sight, follows, hidden_between
from dloftbs.tracking.reconstruction import Stretch, assemble
from dloftbs.tracking.track_model import TRUSTED, Memory


def as_found(left: Sequence[Seen], parts: Sequence[Seen], seen: Sequence[Seen]) -> list[Seen]:
    """Return what is left over: whole objects of which all parts are, and the longest part where most of one is."""
    result = []
    counts = Counter(part.number for part in parts)
    remaining: dict[int, list[Seen]] = {}
    for part in left:
        remaining.setdefault(part.number, []).append(part)
    for one in seen:
        mine = remaining.get(one.number, [])
        if len(mine) == counts[one.number]:
            result.append(one)
        elif sum(part.length for part in mine) > 0.5 * one.length:
            result.append(_cut(max(mine, key=lambda part: part.length)))
    return result


def _cut(part: Seen) -> Seen:
    """Return a part as an object."""
    if part.of == WHOLE:
        return part
    curve = assemble(part.curve, WHOLE, [Stretch(part.curve, WHOLE, part.of)])
    return part._replace(curve=curve, of=WHOLE, gaps=tuple(gaps(Piece(part, WHOLE, part.of))))


def bridged(memory: Memory, pieces: Sequence[Piece]) -> list[Piece]:
    """Return the pieces, with those made one between which the detector knows the way and the past does not."""
    result = [pieces[0]]
    for piece in pieces[1:]:
        last = result[-1]
        hidden = (last.at[1], piece.at[0])
        if follows(last, piece) and _is_bridge(memory, hidden, last, piece):
            seen = last.seen.between(last.of[0], piece.of[1])
            result[-1] = Piece(seen, (last.at[0], piece.at[1]), seen.of)
        else:
            result.append(piece)
    return result


def _is_bridge(memory: Memory, hidden: tuple[float, float], last: Piece, piece: Piece) -> bool:
    """Tell whether to believe the detector's way between two pieces: there is no better one, or it is as long."""
    if hidden[1] <= hidden[0] or trust_in(memory, hidden) < TRUSTED:
        return True
    span = (last.of[1], piece.of[0])
    if any(low <= span[0] + 1e-9 and span[1] <= high + 1e-9 for low, high in piece.seen.gaps):
        return False
    # The length of the whole curve by that of its part.
    bridge = (span[1] - span[0]) * piece.seen.length / (piece.of[1] - piece.of[0])
    return abs(bridge - (hidden[1] - hidden[0]) * memory.length) < memory.slack_px


def restarted(seen: Seen, u: float) -> Seen:
    """Return a loop that starts where the track does."""
    curve = loop_start.restarted(seen.curve, u)
    if curve is seen.curve:
        return seen
    points, length = sample(curve)
    detection = None if seen.detection is None else replace(seen.detection, curve=curve)
    return seen._replace(curve=curve, points=points, length=length, detection=detection)


def gaps(piece: Piece) -> list[tuple[float, float]]:
    """Return what the detector inferred of a piece, in the track's ``u``."""
    (low, high), (first, last) = piece.at, piece.of
    spans = [(max(a, first), min(b, last)) for a, b in piece.seen.gaps]
    # The share comes first: it is 1 at most, and what lies at the track's end never is rounded beyond it.
    shares = [((a - first) / (last - first), (b - first) / (last - first)) for a, b in spans if b > a]
    return [(low + a * (high - low), low + b * (high - low)) for a, b in shares]


def merged(spans: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Return ascending intervals with those that touch made one."""
    result: list[tuple[float, float]] = []
    for low, high in spans:
        if result and low <= result[-1][1]:
            result[-1] = (result[-1][0], max(high, result[-1][1]))
        else:
            result.append((low, high))
    return tuple(result)


def in_sight(memory: Memory, pieces: Sequence[Piece], size: tuple[int, int] | None) -> Sight:
    """Return the published curve of a partly hidden track: it ends where it leaves the image."""
    leaves = leaving(pieces[0].seen, size, memory.width)[0], leaving(pieces[-1].seen, size, memory.width)[1]
    low, high = pieces[0].at[0] if leaves[0] else 0.0, pieces[-1].at[1] if leaves[1] else 1.0
    if (low, high) == WHOLE:
        return Sight(memory.curve, memory.curve_3d, memory.inferred, memory.confidence)
    if len(pieces) == 1 and (low, high) == pieces[0].at and pieces[0].of == WHOLE:
        seen = pieces[0].seen
        return Sight(seen.curve, seen.curve_3d, seen.gaps, 1.0)
    scaled = [p._replace(at=((p.at[0] - low) / (high - low), (p.at[1] - low) / (high - low))) for p in pieces]
    inside = [piece.on_track() for piece in scaled]
    curve = assemble(memory.curve, (low, high), [Stretch(p.seen.curve, p.at, p.of) for p in inside])
    curve_3d = in_space(memory.curve_3d, (low, high), inside)
    hidden = merged(sorted([*hidden_between(inside), *(gap for piece in inside for gap in gaps(piece))]))
    return Sight(curve, curve_3d, hidden, memory.confidence)


def in_space(before: BSplineCurve | None, scope: tuple[float, float], pieces: Sequence[Piece]) -> BSplineCurve | None:
    """Return the whole curve in space from the pieces that have one; None without those, or if it never was known.

    A piece lies as far from the nearer end, in metres, as its own length and its place in the image say.
    """
    known = [(piece, piece.seen.curve_3d) for piece in pieces]
    if before is None or all(curve is None for _, curve in known):
        return None
    length = sample(before)[1] * (scope[1] - scope[0])
    stretches: list[Stretch] = []
    for piece, curve in known:
        if curve is None:
            continue
        share = min(sample(curve)[1] * (piece.of[1] - piece.of[0]) / length, 1.0)
        low, high = piece.at
        room = 1.0 - (high - low)
        start = low / room * (1.0 - share) if room > 0.0 else 0.0
        if stretches:
            start = max(start, stretches[-1].at[1])
        if start < 1.0:
            stretches.append(Stretch(curve, (start, min(start + share, 1.0)), piece.of))
    return assemble(before, scope, stretches)
