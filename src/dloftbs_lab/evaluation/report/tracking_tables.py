"""The suites of tracking: identities and directions by family, and what the past is worth and what it spoils."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from typing import TypeAlias

from dloftbs_lab.evaluation.report.counts import idf1
from dloftbs_lab.evaluation.report.spread import Sample
from dloftbs_lab.evaluation.report.table import Cell, Table, existing, mean
from dloftbs_lab.evaluation.runner.finished_parts import Following, Part, TrackRow

_Groups: TypeAlias = dict[tuple[str, int | None, str], list[tuple[Following, str]]]
_Chosen: TypeAlias = Callable[[TrackRow], bool]
_Value: TypeAlias = Callable[[TrackRow], float | None]

APART = "hidden"
"""The family outside of the totals: where cables come out that are hidden as a whole, nobody can know."""
ALL = f"all but {APART}"
"""All other families, of a suite that has it."""

HARM_PX, RIGHT_PX = 5.0, 3.0
"""Harm: no track has an L3 of at most the first, though a curve of the frame alone has one below the second."""
_WHOLE = 0.99
"""From this share of its length on an object counts as not hidden: masks are cut by whole pixels."""
_ENOUGH = 0.1
"""Share of its length that an object must show to count as in sight again."""

_NOTE = (
    "A sequence without a switch is one in which every object keeps its track. In one without a flip, each track "
    "runs the same way on its object. Unbroken is both. An object is followed if it has a track in 80 % of its "
    "frames. All published tracks count. They are those of an object within an L3 of 50 px in HD from its whole or "
    "its visible extent. While nothing of an object shows, neither it nor its last track counts. Harm: frames of "
    f"objects in which no track has an L3 of {HARM_PX:g} px or less, though the frame alone has a curve below "
    f"{RIGHT_PX:g} px. Help: the reverse. Missed: objects that show, by frame, without a track in the assignment by "
    "mean distance (both ways, below 20 px in HD) from the whole or the visible extent. Ghosts: points of published "
    "tracks more than a width from anything in the mask; behind occluders, right ones too. L3 is from the whole true "
    "curve, the hidden part included, whichever end comes first. It is that of the object's track, or of the nearest "
    "track if it has none. It stands beside that of the nearest curve which the same method finds in that frame "
    "alone. Both means are over the same frames of objects, those in which both have a curve. The share named beside "
    "it has no detection. Occluded: some of the object is behind an occluder or outside of the image, at least "
    f"{100 * (1 - _WHOLE):.0f} % and not all. Clear: less. Re-found: frames until an object that was hidden as a "
    f"whole is seen in its former track. They are counted from the first that shows {100 * _ENOUGH:.0f} % of it."
)


def following_table(parts: Sequence[Part], suite: str) -> Table:
    """Return how objects were followed in a suite, by family, number of cables and method, and over all families."""
    groups: _Groups = {}
    for part in parts:
        if part.following is not None:
            key = part.following.family, part.following.cables, part.key.method
            groups.setdefault(key, []).append((part.following, part.scene))
    totals: _Groups = {}
    counted = {key: followed for key, followed in groups.items() if key[0] != APART}
    every = ALL if len(counted) < len(groups) else "all"
    for (_, cables, method), followed in counted.items():
        totals.setdefault((every, cables, method), []).extend(followed)
    for (_, _, method), followed in counted.items():
        totals.setdefault((every, None, method), []).extend(followed)
    samples = {key: Sample(*zip(*followed, strict=True)) for key, followed in (groups | totals).items()}
    rows = tuple((*key, *(figure(one) for figure in _FIGURES.values())) for key, one in samples.items())
    title = f"{suite}: identities, directions, and the tracked curve against frame by frame"
    return Table(f"{suite}-families", title, ("family", "cables", "method", *_FIGURES), rows, _NOTE)


def is_harmed(row: TrackRow) -> bool:
    """Return whether the past made worse what the frame alone shows."""
    return _gets_lost(row.alone_px, row.nearest_px)


def is_helped(row: TrackRow) -> bool:
    """Return whether the past made right what the frame alone does not show."""
    return _gets_lost(row.nearest_px, row.alone_px)


def _gets_lost(known_px: float | None, other_px: float | None) -> bool:
    return known_px is not None and known_px < RIGHT_PX and (other_px is None or other_px > HARM_PX)


def refound(rows: Sequence[TrackRow]) -> list[int | None]:
    """Return after how many frames an object was found again, each time that it had been hidden as a whole.

    Parameters
    ----------
    rows : sequence of TrackRow
        Of one object, in order.

    Returns
    -------
    list of int or None
        None where it was hidden again, or the sequence ended, without.
    """
    found: list[int | None] = []
    had: int | None = None
    dark, since = False, None
    for row in rows:
        if row.shown == 0.0:
            dark = dark or had is not None
            if since is not None:
                found.append(None)
            since = None
            continue
        if dark and row.shown >= _ENOUGH:
            dark, since = False, row.index
        if since is not None and row.seen and row.track == had:
            found.append(row.index - since)
            since = None
        if not dark and since is None and row.track is not None:
            had = row.track
    return found if since is None else [*found, None]


def _objects(followed: Following) -> int:
    return followed.scores.mostly_tracked + followed.scores.partly_tracked + followed.scores.mostly_lost


def _occluded(row: TrackRow) -> bool:
    return 0.0 < row.shown < _WHOLE


def _clear(row: TrackRow) -> bool:
    return row.shown >= _WHOLE


def _tracked(row: TrackRow) -> float | None:
    """Return the L3 of the tracked curve, where the frame alone has one too."""
    return None if row.alone_px is None else row.track_px


def _alone(row: TrackRow) -> float | None:
    """Return the L3 of the frame alone, where there is a tracked curve too."""
    return None if row.track_px is None else row.alone_px


def _mean(followed: Sample[Following], chosen: _Chosen, value: _Value) -> Cell:
    """Return the mean over the chosen frames of objects in which there is a value."""
    return followed.ratio(_sum(chosen, value), _sum(chosen, lambda row: float(value(row) is not None)))


def _sum(chosen: _Chosen, value: _Value) -> Callable[[Following], float]:
    return lambda one: sum(value(row) or 0.0 for row in one.rows if chosen(row))


def _refound(followed: Sample[Following]) -> list[int | None]:
    found = []
    for one in followed.items:
        rows = sorted(one.rows, key=lambda row: (row.object, row.index))
        for _, of_object in groupby(rows, key=lambda row: row.object):
            found += refound(list(of_object))
    return found


_FIGURES: Mapping[str, Callable[[Sample[Following]], Cell]] = {
    "sequences": len,
    "no switch, %": lambda followed: followed.mean(lambda one: float(one.scores.switches == 0), 100.0),
    "no flip, %": lambda followed: followed.mean(lambda one: float(one.scores.flips == 0), 100.0),
    "unbroken, %": lambda followed: followed.mean(
        lambda one: float(one.scores.switches == one.scores.flips == 0), 100.0
    ),
    "objects followed, %": lambda followed: followed.ratio(lambda one: one.scores.mostly_tracked, _objects, 100.0),
    "IDF1": lambda followed: idf1(followed, lambda one: one.scores),
    "harm, %": lambda followed: followed.ratio(
        lambda one: sum(map(is_harmed, one.rows)), lambda one: len(one.rows), 100.0
    ),
    "help, %": lambda followed: followed.ratio(
        lambda one: sum(map(is_helped, one.rows)), lambda one: len(one.rows), 100.0
    ),
    "missed, %": lambda followed: followed.ratio(lambda one: one.missed, lambda one: one.shown, 100.0),
    "ghosts, %": lambda followed: followed.ratio(lambda one: one.ghosts, lambda one: one.points, 100.0),
    "occluded: L3 px tracked": lambda followed: _mean(followed, _occluded, _tracked),
    "occluded: L3 px of the hidden part": lambda followed: _mean(
        followed, _occluded, lambda row: None if row.alone_px is None else row.hidden_px
    ),
    "occluded: L3 px frame by frame": lambda followed: _mean(followed, _occluded, _alone),
    "occluded: less, %": lambda followed: followed.ratio(
        _sum(_occluded, _tracked), _sum(_occluded, _alone), -100.0, offset=100.0
    ),
    "occluded: not detected, %": lambda followed: _mean(
        followed, _occluded, lambda row: 100.0 * (row.alone_px is None)
    ),
    "clear: L3 px tracked": lambda followed: _mean(followed, _clear, _tracked),
    "clear: L3 px frame by frame": lambda followed: _mean(followed, _clear, _alone),
    "frames until re-found": lambda followed: mean(map(float, existing(_refound(followed)))),
    "never re-found": lambda followed: None if not (again := _refound(followed)) else again.count(None),
}
