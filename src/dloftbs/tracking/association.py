"""Assignment of detections, and of parts of them, to tracks.

First each detection goes to one track at most, as a whole. What is left over then is looked at in parts: a detection
may be one more part of a track that is partly hidden, and a track may be a part of a detection that two tracks share.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from dloftbs._arrays import FloatArray
from dloftbs.config import TrackingConfig
from dloftbs.observation import Seen, U, sample
from dloftbs.tracking.alignment import anchored, at_border, place_on
from dloftbs.tracking.kernels import alignment as kernels
from dloftbs.tracking.partial_match import WHOLE, Piece, Shown, hidden_between
from dloftbs.tracking.track_model import REMEMBERED, TRUSTED, Memory, lookup
from dloftbs.tracks import TrackState

_NEAR, _FARTHEST = 0.02, 0.03  # where there is no doubt: distance by length, in the mean and at any place
_APART = 3.0  # and how much farther any other is
_CAP = 1.5  # of the gate: how much a stretch that does not fit may count
_NOT_COVERED = 0.5  # of the gate: what a stretch costs that the other one does not have
_WIDENING, _WIDEST = 4.0, 3.0  # of the gate: by how much a second, and to how many times, where a track is not seen
_WIDTH_RATIO = 3.0
_SHORTEST_GATE = 3.0  # widths
_ROOM = 0.2  # of a part's length: as much of it may lie where another part is thought to be

_ALIKE = 1.5  # ratio of widths and of lengths up to which two may be one object that moved fast
_KEPT = 0.5  # of a shift as a whole, where it tells which way such a one runs
_CORNER, _STRAIGHT = 4, 0.7  # samples from an end that tell its direction, and the least cosine of what goes on
_ALONG = 9  # every so many samples tell whether a detection lies along the border
_PLACES = 32
_AT_END = 1.5  # of the misfit elsewhere: up to so much a part may fit worse at an end, and is there


def match_at_once(memories: Sequence[Memory], known: Known, seen: Sequence[Seen]) -> list[int]:
    """Return for each track one more than the index of its detection, negative where it runs backwards.

    0 where there is any doubt: the track must have been seen as a whole before, and must be now, and nothing else near.
    """
    if not seen:
        return [0] * len(memories)
    lengths, closed = np.array([s.length for s in seen]), np.array([s.curve.closed for s in seen])
    points = np.array([s.points for s in seen])
    whole = np.array([not (m.hidden or m.misses or m.curve.closed) for m in memories])
    partner: list[int] = kernels.match_as_they_stand(
        known.points, known.lengths, whole, points, lengths, closed, known.slack, _NEAR, _FARTHEST, _APART
    ).tolist()
    for t, p in enumerate(partner):
        if p and not 1.0 / _WIDTH_RATIO <= _ratio(memories[t].width, seen[abs(p) - 1].width) <= _WIDTH_RATIO:
            partner[t] = 0
    return partner


def _ratio(one: float, other: float) -> float:
    return one / other if one > 0.0 and other > 0.0 else 1.0  # an unknown width, NaN, is any


def bring_together(
    memories: Sequence[Memory],
    known: Known,
    seen: Sequence[Seen],
    config: TrackingConfig,
    size: tuple[int, int] | None,
) -> Matching:
    """Find what a frame shows of each track.

    Detections that are as long as no track fall into parts at their long gaps.
    """
    whole = Matching(memories, known, seen, config, size)
    parts = [part for d, one in enumerate(seen) for part in ([one] if whole.is_all(d) else one.parts())]
    matching = whole if len(parts) == len(seen) else Matching(memories, known, parts, config, size)
    matching.explain()
    return matching


def pair_last(memories: Sequence[Memory], known: Known, shown: Sequence[Shown], left: list[Seen]) -> list[Seen]:
    """Take the one detection left for the one track that was seen a frame ago and is not now, however far it moved.

    Only where nothing else may be either, and neither width nor length clearly differs; return what is left then.
    """
    rest = [t for t, one in enumerate(shown) if not (one.pieces or one.ended or memories[t].misses)]
    if len(rest) != 1 or len(left) != 1 or left[0].of != WHOLE:
        return left
    (t,), (seen,) = rest, left
    memory = memories[t]
    lengths = memory.length, seen.length
    if memory.curve_3d is not None and seen.curve_3d is not None:  # in metres it is the same however it tilts
        lengths = sample(memory.curve_3d)[1], sample(seen.curve_3d)[1]
    ratios = _ratio(memory.width, seen.width), _ratio(*lengths)
    if memory.curve.closed != seen.curve.closed or not all(1.0 / _ALIKE <= ratio <= _ALIKE for ratio in ratios):
        return left
    there, back = (kernels.misfit_at(one.points, known.points[t], 1.0, 0.0, _KEPT) for one in (seen, seen.reversed()))
    shown[t].pieces = [Piece(seen if there <= back else seen.reversed(), WHOLE, WHOLE)]
    return []


class Known(NamedTuple):
    """Predicted places of the tracks.

    Parameters
    ----------
    points : numpy.ndarray, shape (t, SAMPLES, 2)
    lengths, slack : numpy.ndarray, shape (t,)
        px; and by how much they may differ.
    closed : numpy.ndarray, shape (t,), bool
    """

    points: FloatArray
    lengths: FloatArray
    slack: FloatArray
    closed: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, memories: Sequence[Memory], ahead: float) -> Known:
        """Predict the places of tracks whose motion goes on for some seconds."""
        points = np.array([m.points for m in memories])
        points += ahead * np.array([m.velocity for m in memories])
        lengths, slack = np.array([m.length for m in memories]), np.array([m.tolerance_px for m in memories])
        return cls(points, lengths, slack, np.array([m.curve.closed for m in memories]))

    def some(self, rows: list[int]) -> Known:
        """Return some of the tracks."""
        return Known(self.points[rows], self.lengths[rows], self.slack[rows], self.closed[rows])


class Matching:
    """Tracks and detections of one frame, while they are brought together."""

    def __init__(
        self,
        memories: Sequence[Memory],
        known: Known,
        seen: Sequence[Seen],
        config: TrackingConfig,
        size: tuple[int, int] | None,
    ) -> None:
        self._memories = memories
        self._size = size
        self._settle_frames = config.settle_frames
        self._points = known.points
        self.seen = self._seen = seen
        found = np.array([s.points for s in seen])
        self._lengths = np.array([s.length for s in seen])
        self._gate = self._gates(config.gate)
        closed = np.array([s.curve.closed for s in seen])
        gaps = kernels.box_gaps(known.points, found)
        self._near = gaps < _WIDEST * self._gate
        asked = (gaps < _CAP * self._gate) & self._same_width()
        self._misfit, self._start, self._backwards = kernels.place_all(
            known.points, known.lengths, known.closed, found, self._lengths, closed, asked * (_CAP * self._gate)
        )
        self._fits = self._misfit < self._gate
        self.shown = [Shown() for _ in memories]
        self.left: list[int] = []

    def explain(self) -> None:
        """Find what each track shows; `left` then are the detections that show none."""
        owner = self._assign()
        owned = set(owner.values())
        self.left = [d for d in range(len(self._seen)) if d not in owned]
        for t, d in owner.items():
            self.shown[t].pieces = [self._piece(t, d)]
        for t, d in list(owner.items()):
            self._share(t, d, owner)
        for d in sorted(self.left, key=lambda d: -self._lengths[d]):
            self._add_part(d)
        self.left = [d for d in self.left if not self._may_be_hidden(d)]
        owners: dict[int, list[int]] = {}
        for t, d in owner.items():
            owners.setdefault(d, []).append(t)
        for t, shown in enumerate(self.shown):
            shown.shadow = not shown.pieces and self._lies_beside(t, owners)

    def is_all(self, d: int) -> bool:
        """Tell whether a detection, gaps included, is as long as a track and near to it, which hardly is by chance."""
        fitting = [self._memories[t] for t in np.flatnonzero(self._fits[:, d]).tolist()]
        return any(abs(memory.length - self._lengths[d]) < memory.slack_px for memory in fitting)

    def _gates(self, share: float) -> FloatArray:
        """Return the largest distance for each pair, shape (tracks, detections)."""
        widening = [min(1.0 + _WIDENING * float(m.unseen_s.mean()), _WIDEST) * share for m in self._memories]
        least = [0.0 if math.isnan(m.width) else _SHORTEST_GATE * m.width for m in self._memories]
        mean = np.sqrt(np.multiply.outer([m.length for m in self._memories], self._lengths))
        gates: FloatArray = np.maximum(np.array(widening)[:, None] * mean, np.array(least)[:, None])
        return gates

    def _same_width(self) -> npt.NDArray[np.bool_]:
        one, other = np.array([m.width for m in self._memories]), np.array([self._full_width(s) for s in self._seen])
        ratio = np.divide.outer(one, other)
        differs: npt.NDArray[np.bool_] = (ratio > _WIDTH_RATIO) | (ratio < 1.0 / _WIDTH_RATIO)
        return ~differs  # an unknown width is any

    def _full_width(self, seen: Seen) -> float:
        """Return a detection's width, NaN where it lies along the border of the image, which cuts it lengthwise."""
        along = self._size is not None and all(at_border(p, self._size, seen.width) for p in seen.points[::_ALONG])
        return math.nan if along else seen.width

    def _assign(self) -> dict[int, int]:
        """Map tracks to detections, as many as there may be and with the least sum of costs."""
        lengths = np.array([m.length for m in self._memories])
        covered = np.divide.outer(lengths, self._lengths)
        covered = np.minimum(covered, 1.0 / covered)
        cost = covered * self._misfit / self._gate + (1.0 - covered) * _NOT_COVERED
        # Beyond the gate all pairs cost the same, more than all others together, and are dropped afterwards.
        beyond = float(min(cost.shape)) * (_CAP + _NOT_COVERED) + 1.0
        rows, columns = linear_sum_assignment(np.where(self._fits, cost, beyond))
        return {t: d for t, d in zip(rows.tolist(), columns.tolist(), strict=True) if self._fits[t, d]}

    def _piece(self, t: int, d: int) -> Piece:
        """Return where a detection that is a track's own lies on it."""
        memory, seen = self._memories[t], self._seen[d]
        start, backwards = float(self._start[t, d]), bool(self._backwards[t, d])
        shown = seen.reversed() if backwards else seen
        if seen.curve.closed:
            share = min(memory.length / seen.length, 1.0)
            seam = -start if memory.curve.closed else 1.0 - start - share if backwards else start
            return Piece(shown, WHOLE, (seam % 1.0, seam % 1.0 + 1.0))
        if memory.curve.closed:
            return Piece(shown, WHOLE, shown.of)
        if memory.is_overruled_by(seen, self._settle_frames):
            return Piece(shown, WHOLE, shown.of)
        share = seen.length / memory.length
        if abs(seen.length - memory.length) <= memory.tolerance_px:
            return Piece(shown, WHOLE, shown.of)
        if share > 1.0:
            low = (1.0 - start - 1.0 / share) if backwards else start
            return Piece(shown, (min(-low * share, 0.0), max((1.0 - low) * share, 1.0)), shown.of)
        return Piece(shown, place_on(memory, self._points[t], shown, start, self._size), shown.of)

    def _share(self, t: int, d: int, owner: dict[int, int]) -> None:
        """Leave a part of a detection that is longer than the track to another track that lies there, if one does."""
        memory, (piece,) = self._memories[t], self.shown[t].pieces
        low, high = piece.at
        if piece.seen.curve.closed or memory.curve.closed or (high - low - 1.0) * memory.length < memory.tolerance_px:
            return
        for other in np.flatnonzero(self._fits[:, d]).tolist():
            there = self._memories[other]
            if other in owner or there.state is TrackState.TENTATIVE or there.curve.closed:
                continue
            both = memory.length + there.length
            slack = memory.slack_px + there.slack_px
            if abs(both - piece.seen.length) > slack:
                continue
            if memory.joined >= self._settle_frames:
                self.shown[other].ended = True
                return
            share = there.length / both
            misfit, first, backwards = self._better_end(other, d, piece.seen.points, share, slack / piece.seen.length)
            if misfit > self._gate[other, d]:
                continue
            mine, others = ((share, 1.0), (0.0, share)) if first else ((0.0, 1.0 - share), (1.0 - share, 1.0))
            self.shown[t] = Shown([Piece(piece.seen, WHOLE, _within(piece.seen.of, mine))])
            shown, of = (piece.seen.reversed(), _turned(others)) if backwards else (piece.seen, others)
            self.shown[other] = Shown([Piece(shown, WHOLE, _within(shown.of, of))])
            owner[other] = d
            return

    def _better_end(self, t: int, d: int, points: FloatArray, share: float, room: float) -> tuple[float, bool, bool]:
        """Return how well a track lies at the better end of a detection, whether that is the first, and its way."""
        cap, track = _CAP * self._gate[t, d], self._points[t]
        first, _, one = kernels.place_between(track, points, share, 0.0, min(room, 1.0 - share), 0, cap)
        last, _, other = kernels.place_between(track, points, share, max(1.0 - share - room, 0.0), 1.0 - share, 0, cap)
        return (first, True, one) if first <= last else (last, False, other)

    def _add_part(self, d: int) -> None:
        """Give a detection that is left over to the track that it is one more part of, if there is one."""
        best: tuple[float, int, Piece] | None = None
        for t in np.flatnonzero(self._near[:, d]).tolist():
            memory = self._memories[t]
            if not self.shown[t].pieces or memory.curve.closed or self._seen[d].curve.closed:
                continue
            for low, high in hidden_between(self.shown[t].pieces):
                unseen_s = float(np.interp(0.5 * (low + high), U, memory.unseen_s))
                gate = self._gate[t, d] * min(1.0 + _WIDENING * unseen_s, _WIDEST)
                candidate = self._part_between(t, d, low, high)
                if candidate is not None and candidate[0] < gate and (best is None or candidate[0] / gate < best[0]):
                    best = candidate[0] / gate, t, candidate[1]
        if best is not None:
            _, t, piece = best
            self.shown[t].pieces = sorted([*self.shown[t].pieces, piece], key=lambda p: p.at)
            self.left.remove(d)

    def _may_be_hidden(self, d: int) -> bool:
        """Tell whether a detection that is left over lies where a track is hidden, and may be a part of it."""
        seen = self._seen[d]
        for t in np.flatnonzero(self._near[:, d]).tolist():
            memory = self._memories[t]
            if memory.state is TrackState.TENTATIVE or not self.shown[t].pieces:
                continue
            for low, high in hidden_between(self.shown[t].pieces):
                if (high - low) * memory.length > seen.length:
                    track = lookup(self._points[t], np.linspace(low, high, _PLACES))
                    far = np.linalg.norm(track[:, None] - seen.points[None, ::7], axis=2).min(axis=0).max()
                    if far < 0.5 * self._gate[t, d]:
                        return True
        return False

    def _part_between(self, t: int, d: int, low: float, high: float) -> tuple[float, Piece] | None:
        """Return how well a detection fits into a stretch of a track that is not seen, and where."""
        memory, seen = self._memories[t], self._seen[d]
        share = seen.length / memory.length
        slack = memory.slack_px / memory.length
        if share > high - low + slack + _ROOM * share or np.interp(0.5 * (low + high), U, memory.trust) < TRUSTED:
            return None
        first, last = max(low - slack, 0.0), min(high + slack, 1.0) - share
        misfit, start, backwards = kernels.place_between(
            seen.points, self._points[t], share, min(first, max(last, 0.0)), max(last, 0.0), 0, _CAP * self._gate[t, d]
        )
        shown = seen.reversed() if backwards else seen
        if low <= 0.0 or high >= 1.0:  # one occluder is likelier than two
            end = 0.0 if low <= 0.0 else 1.0 - share
            at_end = kernels.misfit_at(shown.points, self._points[t], share, end, 1.0)
            if at_end < _AT_END * misfit + memory.slack_px:
                misfit, start = at_end, end
        at = anchored(start, share, memory)
        at = (max(at[0], low), min(at[1], high))
        if at[1] <= at[0]:
            return None
        piece = Piece(shown, at, shown.of)
        return (misfit, piece) if self._can_reach(t, piece) else None

    def _can_reach(self, t: int, piece: Piece) -> bool:
        """Tell whether a hidden stretch can join a part and its neighbours, by its length and its span."""
        memory = self._memories[t]
        slack = memory.slack_px
        for other in self.shown[t].pieces:
            before, after = (other, piece) if other.at < piece.at else (piece, other)
            span = (before.at[1], after.at[0])
            ends = (before.seen.points[-1], after.seen.points[0])
            far = float(np.linalg.norm(ends[1] - ends[0]))
            hidden = max(span[1] - span[0], 0.0) * memory.length
            expected = float(np.linalg.norm(np.diff(lookup(self._points[t], np.array(span)), axis=0)))
            if far > 1.15 * hidden + 2.0 * slack or abs(far - expected) > 0.5 * hidden + 2.0 * slack:
                return False
        return True

    def _lies_beside(self, t: int, owners: dict[int, list[int]]) -> bool:
        """Tell whether a track that is not seen lies on a detection where the track that took it was not before."""
        memory = self._memories[t]
        for d in np.flatnonzero(self._fits[t] & (self._lengths >= memory.length)).tolist():
            start = float(self._start[t, d])
            middle = lookup(self._seen[d].points, np.array([start + 0.5 * memory.length / float(self._lengths[d])]))
            for other in owners.get(d, ()):
                reach = 2.0 * self._memories[other].slack_px
                near = np.linalg.norm(self._points[other] - middle, axis=1).min()
                if near > reach or memory.shadowed:
                    return True
        return False


def _within(span: tuple[float, float], part: tuple[float, float]) -> tuple[float, float]:
    """Return a part of a span, given as shares of it."""
    low, high = span
    return low + part[0] * (high - low), low + part[1] * (high - low)


def _turned(span: tuple[float, float]) -> tuple[float, float]:
    return 1.0 - span[1], 1.0 - span[0]


def _were_apart(one: Memory, other: Memory) -> bool:
    """Tell whether two tracks, as long as they are now, were ever apart: what grows together is one object."""
    back = np.arange(min(one.hits, other.hits, REMEMBERED - 1))
    if not len(back):
        return False
    first, second = (one.hits - back) % REMEMBERED, (other.hits - back) % REMEMBERED
    gaps = np.linalg.norm(one.ends[first][:, :, None] - other.ends[second][:, None, :], axis=3).min(axis=(1, 2))
    as_now = np.abs(one.lengths[first] - one.length) < one.slack_px
    as_now &= np.abs(other.lengths[second] - other.length) < other.slack_px
    return bool((gaps[as_now] > one.slack_px + other.slack_px).any())


def find_joined(memories: Sequence[Memory], shown: Sequence[Shown]) -> None:
    """Find the tracks that together are one detection: two objects that touch, or one that was split in two."""
    sharing: dict[int, list[int]] = {}
    for t, one in enumerate(shown):
        for number in {piece.seen.number for piece in one.pieces}:
            sharing.setdefault(number, []).append(t)
    for number, tracks in sharing.items():
        if len(tracks) != 2:
            continue
        total = next(p.seen.total for p in shown[tracks[0]].pieces if p.seen.number == number)
        pair = [memories[t] for t in tracks]
        if abs(sum(m.length for m in pair) - total) < sum(m.slack_px for m in pair):
            apart = any(m.apart for m in pair) or _were_apart(*pair) or _turn_sharply(*pair)
            for t in tracks:
                shown[t].joined, shown[t].apart = not apart, apart


def _turn_sharply(one: Memory, other: Memory) -> bool:
    """Tell whether two tracks make a corner where their nearest ends meet, which one object would hardly have."""
    ends = [(points, points[::-1]) for points in (one.points, other.points)]
    first, second = min(itertools.product(*ends), key=lambda pair: math.dist(pair[0][0], pair[1][0]))
    before, after = first[0] - first[_CORNER], second[_CORNER] - second[0]
    return float(before @ after) < _STRAIGHT * math.hypot(*before) * math.hypot(*after)
