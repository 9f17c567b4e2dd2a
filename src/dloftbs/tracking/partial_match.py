"""Matches of a frame's detections with tracks, stretch by stretch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from dloftbs.curve import BSplineCurve
from dloftbs.observation import Seen

WHOLE = (0.0, 1.0)


class Piece(NamedTuple):
    """A stretch of a track that a detection shows.

    Parameters
    ----------
    seen : Seen
        Run in the track's direction.
    at : (float, float)
        Place on the track, in its ``u``; beyond 0 or 1 where it is longer than was known.
    of : (float, float)
        Stretch of the detection, in its ``u``; of a loop, once round from where the track starts.
    """

    seen: Seen
    at: tuple[float, float]
    of: tuple[float, float]

    @property
    def shows_all(self) -> bool:
        """True if the piece is a whole detection, and nothing of the track is missing."""
        return self.seen.curve.closed or (self.of == WHOLE and self.at[0] <= 0.0 and self.at[1] >= 1.0)

    def on_track(self) -> Piece:
        """Return what the piece shows of the track as it is known, without what goes on beyond its ends."""
        (low, high), (first, last) = self.at, self.of
        at = (max(low, 0.0), min(high, 1.0))
        if at == self.at:
            return self
        scale = (last - first) / (high - low)
        return self._replace(at=at, of=(first + (at[0] - low) * scale, last - (high - at[1]) * scale))


@dataclass(slots=True, eq=False)
class Shown:
    """Parts of a frame's detections that show one track.

    Parameters
    ----------
    pieces : list of Piece
        In the track's order.
    joined : bool
        Whether it is only taken for a part of a detection, which may as well be one object.
    apart : bool
        Whether it is taken for a part of a detection, and known to be another object than the rest of it.
    shadow : bool
        Whether it lies where another track took a detection for itself, and beside what that one was.
    ended : bool
        Whether it was but a part of another track.
    """

    pieces: list[Piece] = field(default_factory=list)
    joined: bool = False
    apart: bool = False
    shadow: bool = False
    ended: bool = False

    @property
    def numbers(self) -> set[int]:
        """Numbers of the detections that show the track."""
        return {piece.seen.number for piece in self.pieces}


class Sight(NamedTuple):
    """Published part of a track that may not be all of it: it ends with the part in sight.

    Parameters
    ----------
    curve : BSplineCurve
    curve_3d : BSplineCurve or None
    inferred : tuple of (float, float)
        Intervals of its ``u`` between the parts in sight.
    confidence : float
    """

    curve: BSplineCurve
    curve_3d: BSplineCurve | None
    inferred: tuple[tuple[float, float], ...]
    confidence: float


def hidden_between(pieces: Sequence[Piece]) -> tuple[tuple[float, float], ...]:
    """Return the stretches of a track's ``u`` that no piece shows, ascending."""
    edges = [0.0, *(edge for piece in pieces for edge in piece.at), 1.0]
    return tuple((low, high) for low, high in zip(edges[::2], edges[1::2], strict=True) if high - low > 1e-9)


def follows(one: Piece, other: Piece) -> bool:
    """Tell whether the detector, too, has one piece after the other, in this direction."""
    same = one.seen.number == other.seen.number and one.seen.backwards == other.seen.backwards
    return same and one.of[1] <= other.of[0]
