"""The only place with memory: tracks, from frame to frame."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from dloftbs._values import check_size, check_stamp
from dloftbs.config import TrackingConfig
from dloftbs.curve import BSplineCurve
from dloftbs.errors import InputError
from dloftbs.frame import Detection, Track, TrackState
from dloftbs.observation import SAMPLES, Seen, U, look_at, sample
from dloftbs.tracking.alignment import in_plain_sight, leaving
from dloftbs.tracking.association import Known, bring_together, find_joined, match_at_once, pair_last
from dloftbs.tracking.fusion import as_found, bridged, gaps, in_sight, in_space, merged, restarted
from dloftbs.tracking.motion_filter import Smoother
from dloftbs.tracking.occlusion import believe
from dloftbs.tracking.partial_match import WHOLE, Piece, Shown, follows, hidden_between
from dloftbs.tracking.reconstruction import Stretch, assemble
from dloftbs.tracking.routing import route
from dloftbs.tracking.track_model import LEAP, Memory, Prediction, blend, blended, horizon, moved

_ROUNDING_S = 1e-6


class Tracker:
    """Holds identity and direction over a stream of detections, or of bare curves from any detector.

    Parameters
    ----------
    config : TrackingConfig, optional

    Examples
    --------
    A detector that starts at either end, and curves without anything else:

    >>> cable = BSplineCurve([0, 0, 0, 0, 1, 1, 1, 1], [(10, 20), (40, 25), (70, 25), (100, 20)])
    >>> tracker = Tracker()
    >>> for number in range(3):
    ...     seen = cable.transformed([[1, 0], [0, 1]], [2 * number, 0])
    ...     (track,) = tracker.update([seen if number % 2 else seen.reversed()], stamp=number / 30)
    >>> track.id, track.state.value, track.curve(0.0).tolist()
    (1, 'confirmed', [104.0, 20.0])

    Nothing of it is seen: it is not published, and kept for a while to be found again.

    >>> tracker.update([], stamp=3 / 30)
    ()
    >>> (track,) = tracker.lost
    >>> track.id, track.state.value, track.inferred, track.confidence < 1.0
    (1, 'hidden', ((0.0, 1.0),), True)
    """

    def __init__(self, config: TrackingConfig | None = None) -> None:
        self._config = TrackingConfig() if config is None else config
        self._memories: list[Memory] = []
        self._tracks: tuple[Track, ...] = ()
        self._lost: tuple[Track, ...] = ()
        self._smoothers: dict[int, tuple[Smoother, Smoother]] = {}
        self._next_id = 1
        self._stamp: float | None = None
        self._size: tuple[int, int] | None = None

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The tracks as they were last published."""
        return self._tracks

    @property
    def lost(self) -> tuple[Track, ...]:
        """The tracks that the last frame shows nothing of, each where it is expected; found again, it has its id."""
        return self._lost

    def reset(self) -> None:
        """Forget all tracks, the time and the size; ids go on from where they were, so that none is used twice."""
        self._memories, self._tracks, self._lost = [], (), ()
        self._smoothers = {}
        self._stamp = self._size = None

    def update(
        self,
        detections: Sequence[Detection | BSplineCurve],
        stamp: float | None = None,
        size: tuple[int, int] | None = None,
        *,
        widths: Sequence[float] | None = None,
    ) -> tuple[Track, ...]:
        """Take one frame's detections and return the tracks as they stand after it.

        An object that is seen as a whole has its detection's curve. Of one that is partly hidden, the rest is inferred;
        its parts may be several detections, and several objects that touch may be parts of one.

        Parameters
        ----------
        detections : sequence of Detection or BSplineCurve
            Curves are in the image, px.
        stamp : float, optional
            Seconds. Without stamps, `TrackingConfig.frame_s` has passed. A frame with the stamp of the last one, to a
            microsecond, is that one once more: nothing changes.
        size : (int, int), optional
            ``(H, W)`` of the frame, px: what leaves the image is then known to go on outside.
        widths : sequence of float, optional
            Of the objects, px, NaN where not known, for curves; detections have their own.

        Returns
        -------
        tuple of Track
            By id.

        Raises
        ------
        InputError
            If something is no detection or curve in the image, a stamp, size or width is none, or, where the
            configuration says so, if the size is not the last frame's or the stamp lies before it.
        """
        seen = look_at(detections, widths)
        dt = self._advance(stamp, size)
        if dt == 0.0:
            return self._tracks
        if self._memories:
            self._follow(seen, dt)
        else:
            self._start(seen)
        seen_now = [memory for memory in self._memories if not memory.misses]
        self._smoothers = {m.id: self._smoothers[m.id] for m in seen_now if m.id in self._smoothers}
        self._tracks = tuple(self._publish(memory, dt) for memory in seen_now)
        self._lost = tuple(memory.published() for memory in self._memories if memory.misses)
        return self._tracks

    def predict(self, stamp: float | None = None) -> tuple[Prediction, ...]:
        """Return where confirmed and hidden tracks are expected at a time, or in the next frame; changes nothing."""
        dt, stamp = self._config.frame_s, check_stamp(stamp)
        if stamp is not None and self._stamp is not None:
            dt = max(stamp - self._stamp, 0.0)
        ahead = horizon(dt)
        return tuple(
            Prediction(
                m.id,
                moved(m.curve, m.velocity, ahead),
                None if math.isnan(m.width) else m.width,
                m.confidence,
            )
            for m in self._memories
            if m.state is not TrackState.TENTATIVE
        )

    def _advance(self, stamp: float | None, size: tuple[int, int] | None) -> float:
        """Return the seconds since the last frame; forget the tracks where this frame does not follow on that."""
        stamp, size = check_stamp(stamp), None if size is None else check_size("size", size, 0)
        if size is not None and self._size is not None and size != self._size:
            if self._config.on_new_size == "error":
                raise InputError(
                    f"the frame has the size {size}, the ones before {self._size}: "
                    "reset the tracker, or set tracking.on_new_size to 'reset'"
                )
            self.reset()
        dt = self._config.frame_s
        if stamp is not None and self._stamp is not None:
            dt = stamp - self._stamp
            if abs(dt) <= _ROUNDING_S:
                stamp, dt = self._stamp, 0.0
            elif dt < 0.0:
                if self._config.on_old_stamp == "error":
                    raise InputError(
                        f"the frame's stamp {stamp} lies before the last one's {self._stamp}: "
                        "reset the tracker, or set tracking.on_old_stamp to 'reset'"
                    )
                self.reset()
                dt = self._config.frame_s
        self._stamp = self._stamp if stamp is None else stamp
        self._size = size or self._size
        return dt

    def _start(self, seen: Sequence[Seen]) -> None:
        for one in seen:
            memory = Memory.of(self._next_id, one)
            memory.hits = 0
            memory.hit(self._config.min_hits)
            self._memories.append(memory)
            self._next_id += 1

    def _follow(self, seen: Sequence[Seen], dt: float) -> None:
        """Bring the tracks up to a frame."""
        known = Known.of(self._memories, horizon(dt))
        partner = match_at_once(self._memories, known, seen)
        self._see_sure([(m, p) for m, p in zip(self._memories, partner, strict=True) if p], seen, dt)
        taken = {abs(p) - 1 for p in partner}
        rest = [t for t, p in enumerate(partner) if not p]
        doubtful = [one for d, one in enumerate(seen) if d not in taken]
        if not rest:
            self._start(doubtful)
            return
        memories = [self._memories[t] for t in rest]
        shown, left, parts = self._explain(memories, known.some(rest), doubtful, dt, alone=not any(partner))
        claims = Counter(number for one in shown for number in one.numbers)
        for memory, one, expected in zip(memories, shown, known.points[rest], strict=True):
            alone = len(one.numbers) == 1 and claims[one.pieces[0].seen.number] == 1
            if alone and all(follows(*pair) for pair in pairwise(one.pieces)):
                whole = in_plain_sight(memory, expected, one.pieces[0].seen, self._size)
                one.pieces = one.pieces if whole is None else [Piece(whole, WHOLE, WHOLE)]
            if one.pieces:
                left += self._see(memory, one, dt)
        left = [part for part in left if claims[part.number] != 1]  # all of it is one track's
        gone = {m.id for m, one in zip(memories, shown, strict=True) if not self._goes_on(m, one, dt)}
        self._memories = [m for m in self._memories if m.id not in gone]
        self._start(as_found(left, parts, doubtful))

    def _explain(
        self, memories: Sequence[Memory], known: Known, doubtful: Sequence[Seen], dt: float, *, alone: bool
    ) -> tuple[list[Shown], list[Seen], list[Seen]]:
        """Return what doubtful detections show of tracks, which parts of them are left over, and all their parts.

        `alone` says that no other track was found: then it may be another scene.
        """
        shown, left, parts = [Shown() for _ in memories], list(doubtful), list(doubtful)
        rows = [k for k, memory in enumerate(memories) if self._is_routed(memory)]
        elsewhere = False
        if doubtful and rows:
            routed = route(memories, known, rows, doubtful, dt, self._config.gate, self._size)
            left, parts = routed.left, routed.parts
            for k, pieces in routed.pieces.items():
                shown[k] = Shown(pieces)
            elsewhere = routed.elsewhere and alone
        if elsewhere:  # nothing in it is theirs
            shown, left, parts = [Shown() for _ in memories], list(doubtful), list(doubtful)
        others = [k for k in range(len(memories)) if not (shown[k].pieces or (elsewhere and k in rows))]
        if left and others:
            matching = bring_together([memories[k] for k in others], known.some(others), left, self._config, self._size)
            again = {id(one) for one in left}
            parts = [part for part in parts if id(part) not in again] + list(matching.seen)
            left = [matching.seen[d] for d in matching.left]
            for k, one in zip(others, matching.shown, strict=True):
                shown[k] = one
        left = pair_last(memories, known, shown, left)
        find_joined(memories, shown)
        return shown, left, parts

    def _is_routed(self, memory: Memory) -> bool:
        """Tell whether a track is known so well that a frame is read by it, rather than it by the frame."""
        settle = self._config.settle_frames
        sure = memory.hits >= settle and not memory.misses and not memory.curve.closed
        return sure and memory.contested < settle and memory.joined < settle

    def _see_sure(self, pairs: Sequence[tuple[Memory, int]], seen: Sequence[Seen], dt: float) -> None:
        """Take detections that show tracks as a whole, without doubt."""
        if not pairs:
            return
        shown = [seen[p - 1] if p > 0 else seen[-p - 1].reversed() for _, p in pairs]
        points = np.array([one.points for one in shown])
        before = np.array([m.points for m, _ in pairs])
        velocity = blended(np.array([m.velocity for m, _ in pairs]), points - before, dt)
        for (memory, _), one, place, speed in zip(pairs, shown, points, velocity, strict=True):
            memory.see_whole(one, place, speed)
            memory.hit(self._config.min_hits)

    def _see(self, memory: Memory, shown: Shown, dt: float) -> list[Seen]:
        """Take what a frame shows of a track; return the detections that turn out to be no part of it."""
        pieces: list[Piece] = shown.pieces
        rejected: list[Piece] = []
        scope = WHOLE
        if hidden_between(pieces):
            pieces, rejected, scope = believe(memory, pieces, self._size)
        pieces = bridged(memory, pieces)
        joined = memory.joined + 1 if shown.joined else 0
        if len(pieces) == 1 and pieces[0].shows_all:
            self._see_whole(memory, pieces[0], dt)
        else:
            self._see_parts(memory, pieces, scope, dt, shared=shown.apart)
            memory.sight = in_sight(memory, pieces, self._size)
        memory.joined, memory.apart = joined, shown.apart
        memory.hit(self._config.min_hits)
        return [piece.seen for piece in rejected]

    def _see_whole(self, memory: Memory, piece: Piece, dt: float) -> None:
        seen = piece.seen
        if seen.curve.closed:
            seen = restarted(seen, piece.of[0])
        overruled = memory.is_overruled_by(piece.seen, self._config.settle_frames)
        if overruled:
            memory.trust = np.full(SAMPLES, float(memory.contested))
        grown = piece.at != WHOLE
        if grown:
            memory.remap(piece.at[0] + U * (piece.at[1] - piece.at[0]))
        other = abs(seen.length - memory.length) > LEAP * memory.length or seen.curve.closed != memory.curve.closed
        still = grown or overruled or bool(memory.misses) or other
        velocity = np.zeros((SAMPLES, 2)) if still else blend(memory, seen.points, dt)
        memory.see_whole(seen, seen.points, velocity)

    def _see_parts(
        self, memory: Memory, pieces: Sequence[Piece], scope: tuple[float, float], dt: float, *, shared: bool
    ) -> None:
        # A part of a detection does not make its track longer: it may be another object that goes on there.
        pieces = [piece.on_track() for piece in pieces]
        curve = assemble(memory.curve, scope, [Stretch(p.seen.curve, p.at, p.of) for p in pieces])
        memory.curve_3d = in_space(memory.curve_3d, scope, pieces)
        memory.detection = max(pieces, key=lambda p: p.seen.length).seen.detection
        hidden = hidden_between(pieces)
        points, _ = sample(curve)
        memory.see_parts(curve, points, memory.length, hidden, dt)
        longest = max(pieces, key=lambda p: p.seen.length).seen
        if not any(leaving(longest, self._size, memory.width)) and not shared:
            memory.contest(longest, sum({p.seen.number: p.seen.total for p in pieces}.values()))
        memory.inferred = merged(sorted([*hidden, *(gap for piece in pieces for gap in gaps(piece))]))

    def _goes_on(self, memory: Memory, shown: Shown, dt: float) -> bool:
        """Let a track that was not seen coast, and tell whether there still is one."""
        if shown.pieces:
            return True
        if memory.state is TrackState.TENTATIVE or shown.ended:
            return False
        memory.shadowed = memory.shadowed + 1 if shown.shadow else 0
        if (
            memory.since_s + dt > self._config.keep_lost_s + _ROUNDING_S
            or memory.shadowed >= self._config.settle_frames
        ):
            return False
        memory.miss(dt)
        return True

    def _publish(self, memory: Memory, dt: float) -> Track:
        track = memory.published()
        if self._config.smoothing_s <= 0.0:
            return track
        lag = self._config.smoothing_s
        plane, space = self._smoothers.setdefault(memory.id, (Smoother(lag), Smoother(lag)))
        curve_3d = None if track.curve_3d is None else space(track.curve_3d, dt)
        return replace(track, curve=plane(track.curve, dt), curve_3d=curve_3d)
