"""Hypotheses of what the tracks are: where a frame may be read in two ways, both are followed until frames decide."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from dloftbs.tracking.association import FrameReading
from dloftbs.tracking.partial_match import PartialMatch
from dloftbs.tracking.track_model import TrackModel

MAX_HYPOTHESES = 4
"""Largest number of hypotheses that are followed.

Source: measured; two follow real cables worse, and eight no better.
"""

MAX_NATS = 4.0
"""Log-odds against a hypothesis from which it is given up, nats.

Source: measured; odds of 55 to one. With 6 nats real cables are followed no better, in an eighth more time.
"""

_STEP = 0.05
"""Step in ``u`` to which the ends of what is seen of an object are compared.

Source: bounds time; hypotheses that differ by less are not worth following twice.
"""

Seen = tuple[tuple[tuple[int, ...], ...], ...]
"""What is seen of each object: detections, with spans in steps."""


class Hypothesis(NamedTuple):
    """Tracks as they may be.

    Parameters
    ----------
    models : list of TrackModel
    nats : float
        Log-odds against the likeliest hypothesis, by all frames so far; 0 at most.
    """

    models: list[TrackModel]
    nats: float = 0.0


class Continuation(NamedTuple):
    """A hypothesis with what the next frame may show of its tracks.

    Parameters
    ----------
    models : list of TrackModel
    reading : FrameReading
    nats : float
        Log-odds, with the frame's.
    """

    models: list[TrackModel]
    reading: FrameReading
    nats: float


def continue_with(hypothesis: Hypothesis, readings: Sequence[FrameReading]) -> list[Continuation]:
    """Return a hypothesis with each reading of the next frame."""
    return [Continuation(hypothesis.models, one, hypothesis.nats + one.nats) for one in readings]


def select_likeliest(continuations: Sequence[Continuation]) -> list[Continuation]:
    """Return the continuations that are followed, the likeliest one first; those that came first win ties.

    Of those that end in the same objects, only the likeliest one goes on: they differ in who is who, and in what is
    known from before, which no later frame shows.
    """
    ranked = sorted(continuations, key=lambda one: -one.nats)
    kept: dict[Seen, Continuation] = {}
    for one in ranked:
        if len(kept) == MAX_HYPOTHESES or one.nats < ranked[0].nats - MAX_NATS:
            break
        kept.setdefault(_list_seen(one), one)
    return list(kept.values())


def _list_seen(continuation: Continuation) -> Seen:
    """Return what is seen of each object, in any order of the objects."""
    shown = continuation.reading.shown
    return tuple(sorted(tuple(_describe(match) for match in one.matches) for one in shown if one.matches))


def _describe(match: PartialMatch) -> tuple[int, ...]:
    """Return a detection, and the spans of it and of the object, in steps; whole objects are alike."""
    spans = () if match.is_complete else (*match.curve_span, *match.track_span)
    return (match.observation.detection_index, *(round(edge / _STEP) for edge in spans))


class Ids:
    """Ids of objects, from 1 on; an object that a frame begins has the same one in all hypotheses."""

    def __init__(self) -> None:
        self._next = 1
        self._begun: dict[tuple[str, int], int] = {}

    def start_frame(self) -> None:
        """Let objects be new ones from now on."""
        self._begun.clear()

    def of_detection(self, index: int) -> int:
        """Return the id of the object that a detection begins."""
        return self._of("detection", index)

    def of_part(self, track_id: int) -> int:
        """Return the id of the object that is cut off a track."""
        return self._of("part", track_id)

    def _of(self, kind: str, number: int) -> int:
        if (kind, number) not in self._begun:
            self._begun[kind, number] = self._next
            self._next += 1
        return self._begun[kind, number]
