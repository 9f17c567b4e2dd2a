"""The tracker: the order of its steps, and the tracks from frame to frame."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from dloftbs._values import check_size, check_stamp, check_type
from dloftbs.config import TrackingConfig
from dloftbs.curve import BSplineCurve
from dloftbs.detection import Detection
from dloftbs.errors import InputError
from dloftbs.evidence import OcclusionEvidence
from dloftbs.observation import SAMPLES, Observation, U, make_observations, sample_curve
from dloftbs.prior import Prediction
from dloftbs.tracking.absent_spans import drop_absent_spans
from dloftbs.tracking.alignment import find_whole_view
from dloftbs.tracking.association import associate, match_remaining_pair, match_unambiguous
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.fusion import (
    collect_new_objects,
    inferred_spans,
    make_hidden_curve,
    make_visible_curve,
    merge_bridged,
    reconstruct_in_space,
    restart_loop,
    visible_parts,
)
from dloftbs.tracking.merged_tracks import find_merged
from dloftbs.tracking.motion_filter import CurveFilter
from dloftbs.tracking.partial_match import WHOLE, PartialMatch, TrackObservation, are_consecutive, hidden_spans
from dloftbs.tracking.prediction import PredictedTracks
from dloftbs.tracking.prior_gate import PriorGate
from dloftbs.tracking.reconstruction import reconstruct
from dloftbs.tracking.routing import route_tracks
from dloftbs.tracking.track_model import (
    JUMP_SHARE,
    TrackModel,
    extrapolated_time,
    filter_velocity,
    move_curve,
)
from dloftbs.tracks import Track, TrackState

_ROUNDING_S = 1e-6
"""Difference of two time stamps that are the same, s.

Source: numerics; seconds since 1970 are rounded to 0.24e-6 as floating-point numbers.
"""


class Tracker:
    """Keeps identities and directions over a stream of detections, or of bare curves from any detector.

    Parameters
    ----------
    config : TrackingConfig, optional

    Examples
    --------
    A detector that may start at either end, and bare curves:

    >>> cable = BSplineCurve([0, 0, 0, 0, 1, 1, 1, 1], [(10, 20), (40, 25), (70, 25), (100, 20)])
    >>> tracker = Tracker()
    >>> for number in range(3):
    ...     seen = cable.transformed([[1, 0], [0, 1]], [2 * number, 0])
    ...     (track,) = tracker.update([seen if number % 2 else seen.reversed()], stamp=number / 30)
    >>> track.id, track.state.value, track.curve(0.0).tolist()
    (1, 'confirmed', [104.0, 20.0])

    When nothing of it is seen, it is not published, but kept for a while to be found again:

    >>> tracker.update([], stamp=3 / 30)
    ()
    >>> (track,) = tracker.lost
    >>> track.id, track.state.value, track.inferred, track.confidence < 1.0
    (1, 'hidden', ((0.0, 1.0),), True)
    """

    def __init__(self, config: TrackingConfig | None = None) -> None:
        self._config = TrackingConfig() if config is None else config
        self._models: list[TrackModel] = []
        self._tracks: tuple[Track, ...] = ()
        self._lost: tuple[Track, ...] = ()
        self._filters: dict[int, tuple[CurveFilter, CurveFilter]] = {}  # in the image and in space, by id
        self._prior_gate = PriorGate()
        self._next_id = 1
        self._stamp: float | None = None
        self._view = View()

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The tracks as last published."""
        return self._tracks

    @property
    def lost(self) -> tuple[Track, ...]:
        """The tracks that are not published: the last frame shows nothing of them. Each is at its predicted place."""
        return self._lost

    def reset(self) -> None:
        """Forget all tracks, the time and the size; ids continue, so that none is used twice."""
        self._models, self._tracks, self._lost = [], (), ()
        self._filters = {}
        self._prior_gate = PriorGate()
        self._stamp, self._view = None, View()

    def update(
        self,
        detections: Sequence[Detection | BSplineCurve],
        stamp: float | None = None,
        size: tuple[int, int] | None = None,
        *,
        widths: Sequence[float] | None = None,
        occlusion: OcclusionEvidence | None = None,
        override: float = 0.0,
    ) -> tuple[Track, ...]:
        """Update the tracks by one frame's detections, and return them.

        An object that is seen as a whole has its detection's curve. The rest of a partly hidden object is inferred; its
        parts may be several detections, and several objects that touch may be parts of one.

        Parameters
        ----------
        detections : sequence of Detection or BSplineCurve
            Curves are in the image, px.
        stamp : float, optional
            Seconds. Without stamps, `TrackingConfig.frame_s` has passed. A frame with the stamp of the last one, to a
            microsecond, is a repetition: nothing changes.
        size : (int, int), optional
            ``(H, W)`` of the frame, px: an object that leaves the image is then known to continue outside.
        widths : sequence of float, optional
            Of the objects, px, NaN if unknown, for bare curves; detections have their own.
        occlusion : OcclusionEvidence, optional
            What hides objects in this frame. An object under it is published as hidden, and what is clear of it is not
            inferred.
        override : float, optional
            Extra cost of the detections' joints, which follow `prior`, over the best ones without it.

        Returns
        -------
        tuple of Track
            By id.

        Raises
        ------
        InputError
            If an item is neither a detection nor a curve in the image; if a stamp, size or width is invalid, or the
            evidence of another size; or, if so configured, if the size differs from the last frame's or the stamp lies
            before its.
        """
        observations = make_observations(detections, widths)
        dt = self._advance(stamp, size, occlusion)
        self._prior_gate.count(override)
        if dt == 0.0:
            return self._tracks
        if self._models:
            self._update_tracks(observations, dt)
        else:
            self._start_tracks(observations)
        for model in self._models:
            if model.misses:
                model.visible = make_hidden_curve(model)
        published = [model for model in self._models if not model.misses or model.visible is not None]
        seen = [model for model in published if not model.misses]
        for model in seen:
            if model.curve_3d is not None or model.points_3d is not None:
                model.measure_velocity_in_space(dt)
        self._filters = {m.id: self._filters[m.id] for m in published if m.id in self._filters}
        self._tracks = tuple(self._publish(model, dt) for model in published)
        self._lost = tuple(m.to_track(self._view) for m in self._models if m.misses and m.visible is None)
        return self._tracks

    def prior(self, stamp: float | None = None) -> tuple[Prediction, ...]:
        """Return what the linking of a frame is to follow: the predictions, but for a while after they were wrong."""
        return self.predict(stamp) if self._prior_gate.is_open else ()

    def predict(self, stamp: float | None = None) -> tuple[Prediction, ...]:
        """Predict the curves of confirmed and hidden tracks at a time, or in the next frame; nothing changes."""
        dt, stamp = self._config.frame_s, check_stamp(stamp)
        if stamp is not None and self._stamp is not None:
            dt = max(stamp - self._stamp, 0.0)
        duration = extrapolated_time(dt)
        return tuple(
            Prediction(
                move_curve(model.curve, model.velocity, duration),
                model.confidence,
                model.unseen_spans,
                model.id,
                None if math.isnan(model.width) else model.width,
            )
            for model in self._models
            if model.state is not TrackState.TENTATIVE
        )

    def _advance(self, stamp: float | None, size: tuple[int, int] | None, occlusion: OcclusionEvidence | None) -> float:
        """Return the seconds since the last frame; forget the tracks if this frame does not continue the stream."""
        stamp, size = check_stamp(stamp), None if size is None else check_size("size", size, 0)
        if occlusion is not None:
            check_type("occlusion", occlusion, OcclusionEvidence)
            if size not in (None, occlusion.size):
                raise InputError(f"the evidence of occlusion must have the frame's size {size}, got {occlusion.size}")
            size = occlusion.size
        known = self._view.size
        if size is not None and known is not None and size != known:
            if self._config.on_new_size == "error":
                raise InputError(
                    f"the frame has the size {size}, the ones before {known}: "
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
        self._view = View(size or self._view.size, occlusion)
        return dt

    def _start_tracks(self, observations: Sequence[Observation]) -> None:
        for one in observations:
            model = TrackModel.from_observation(self._next_id, one)
            model.count_hit(self._config.min_hits)
            self._models.append(model)
            self._next_id += 1

    def _update_tracks(self, observations: Sequence[Observation], dt: float) -> None:
        """Update the tracks by a frame's observations, and start tracks of new objects."""
        predicted = PredictedTracks.extrapolate(self._models, extrapolated_time(dt))
        partner = match_unambiguous(self._models, predicted, observations)
        self._update_unambiguous([(m, p) for m, p in zip(self._models, partner, strict=True) if p], observations, dt)
        matched = {abs(p) - 1 for p in partner}
        rows = [t for t, p in enumerate(partner) if not p]
        ambiguous = [one for d, one in enumerate(observations) if d not in matched]
        if not rows:
            self._start_tracks(ambiguous)
            return
        models = [self._models[t] for t in rows]
        track_observations, unassigned, parts = self._observe_tracks(
            models, predicted.subset(rows), ambiguous, dt, is_all=not any(partner)
        )
        claims = Counter(index for one in track_observations for index in one.detection_indices)
        for model, one, points in zip(models, track_observations, predicted.points[rows], strict=True):
            alone = len(one.detection_indices) == 1 and claims[one.matches[0].observation.detection_index] == 1
            if alone and all(are_consecutive(*pair) for pair in pairwise(one.matches)):
                first = one.matches[0]
                whole = find_whole_view(model, points, first.observation, first.track_span[0], self._view)
                one.matches = one.matches if whole is None else [PartialMatch(whole, WHOLE, WHOLE)]
            if one.matches:
                rejected = self._update_track(model, one, dt)
                unassigned += rejected
                given_up = {id(part) for part in rejected}
                kept = {m.observation.detection_index for m in one.matches if id(m.observation) not in given_up}
                claims.subtract({part.detection_index for part in rejected} - kept)
        # A detection of one track only is all that track's.
        unassigned = [part for part in unassigned if claims[part.detection_index] != 1]
        ended = {m.id for m, one in zip(models, track_observations, strict=True) if not self._continues(m, one, dt)}
        self._models = [m for m in self._models if m.id not in ended]
        self._start_tracks(collect_new_objects(unassigned, parts, ambiguous))

    def _observe_tracks(
        self,
        models: Sequence[TrackModel],
        predicted: PredictedTracks,
        ambiguous: Sequence[Observation],
        dt: float,
        *,
        is_all: bool,
    ) -> tuple[list[TrackObservation], list[Observation], list[Observation]]:
        """Return what ambiguous observations show of each track, their unassigned parts, and all their parts.

        `is_all` is True if these are all tracks: then the frame may show another scene.
        """
        observed, unassigned, parts = [TrackObservation() for _ in models], list(ambiguous), list(ambiguous)
        rows = [t for t, model in enumerate(models) if self._is_routed(model)]
        new_scene = False
        if ambiguous and rows:
            routed = route_tracks(models, predicted, rows, ambiguous, dt, self._config.gate, self._view)
            new_scene = routed.scene_changed and is_all
            if not new_scene:  # else nothing in it belongs to them
                unassigned, parts = routed.unassigned, routed.parts
                for t, matches in routed.matches.items():
                    observed[t] = TrackObservation(matches)
        others = [t for t in range(len(models)) if not (observed[t].matches or (new_scene and t in rows))]
        if unassigned and others:
            association = associate(
                [models[t] for t in others], predicted.subset(others), unassigned, self._config, self._view
            )
            split_again = {id(one) for one in unassigned}
            parts = [part for part in parts if id(part) not in split_again] + list(association.observations)
            unassigned = [association.observations[d] for d in association.unassigned]
            for t, one in zip(others, association.track_observations, strict=True):
                observed[t] = one
        unassigned = match_remaining_pair(models, predicted, observed, unassigned)
        find_merged(models, observed)
        return observed, unassigned, parts

    def _is_routed(self, model: TrackModel) -> bool:
        """Return True if a track is known so well that the frame is interpreted by it, rather than it by the frame."""
        least = self._config.override_frames
        well_known = model.hits >= least and not model.misses and not model.curve.closed
        return well_known and model.conflict_frames < least and model.merged_frames < least

    def _update_unambiguous(
        self, pairs: Sequence[tuple[TrackModel, int]], observations: Sequence[Observation], dt: float
    ) -> None:
        """Update tracks by observations that unambiguously show them as a whole."""
        if not pairs:
            return
        oriented = [observations[p - 1] if p > 0 else observations[-p - 1].reversed() for _, p in pairs]
        points = np.array([one.points for one in oriented])
        before = np.array([m.points for m, _ in pairs])
        velocities = filter_velocity(np.array([m.velocity for m, _ in pairs]), points - before, dt)
        for (model, _), one, position, velocity in zip(pairs, oriented, points, velocities, strict=True):
            model.update_whole(one, position, velocity)
            model.count_hit(self._config.min_hits)

    def _update_track(self, model: TrackModel, observed: TrackObservation, dt: float) -> list[Observation]:
        """Update a track by what a frame shows of it; return the observations that turn out to be no part of it."""
        matches: list[PartialMatch] = observed.matches
        rejected: list[PartialMatch] = []
        scope = WHOLE
        if hidden_spans(matches):
            matches, rejected, scope = drop_absent_spans(model, matches, self._view)
        matches = merge_bridged(model, matches)
        merged_frames = model.merged_frames + 1 if observed.merged else 0
        if len(matches) == 1 and matches[0].is_complete:
            self._update_whole(model, matches[0], dt)
        else:
            self._update_partly(model, matches, scope, dt, shared=observed.known_separate)
            model.visible = make_visible_curve(model, matches, self._view)
        model.merged_frames, model.known_separate = merged_frames, observed.known_separate
        model.count_hit(self._config.min_hits)
        return [match.observation for match in rejected]

    def _update_whole(self, model: TrackModel, match: PartialMatch, dt: float) -> None:
        observation = match.observation
        if observation.curve.closed:
            observation = restart_loop(observation, match.curve_span[0])
        overridden = model.is_overridden_by(match.observation, self._config.override_frames)
        if overridden:
            model.seen_frames = np.full(SAMPLES, float(model.conflict_frames))
        longer = match.track_span != WHOLE
        if longer:
            model.resample(match.track_span[0] + U * (match.track_span[1] - match.track_span[0]))
        other_shape = (
            abs(observation.length - model.length) > JUMP_SHARE * model.length
            or observation.curve.closed != model.curve.closed
        )
        velocity = None
        if not (longer or overridden or model.misses or other_shape):
            velocity = filter_velocity(model.velocity, observation.points - model.points, dt)
        model.update_whole(observation, observation.points, velocity)

    def _update_partly(
        self,
        model: TrackModel,
        matches: Sequence[PartialMatch],
        scope: tuple[float, float],
        dt: float,
        *,
        shared: bool,
    ) -> None:
        # A part of a detection does not make its track longer: another object may continue there.
        matches = [match.clip_to_track() for match in matches]
        curve = reconstruct(model.curve, scope, visible_parts(matches))
        model.curve_3d = reconstruct_in_space(model.curve_3d, scope, matches)
        longest = max(matches, key=lambda m: m.observation.length).observation
        model.detection = longest.detection
        points, _ = sample_curve(curve)
        model.update_partly(curve, points, model.length, hidden_spans(matches), inferred_spans(matches), self._view, dt)
        if not any(self._view.cut_ends(longest, model.width)) and not shared:
            lengths = {m.observation.detection_index: m.observation.object_length for m in matches}
            model.update_conflict(longest, sum(lengths.values()))

    def _continues(self, model: TrackModel, observed: TrackObservation, dt: float) -> bool:
        """Extrapolate a track that was not seen; return False if it has ended."""
        if observed.matches:
            return True
        if model.state is TrackState.TENTATIVE or observed.absorbed:
            return False
        model.overlapped_frames = model.overlapped_frames + 1 if observed.overlapped else 0
        if (
            model.missing_s + dt > self._config.keep_lost_s + _ROUNDING_S
            or model.overlapped_frames >= self._config.override_frames
        ):
            return False
        model.advance_unseen(self._view, dt)
        return True

    def _publish(self, model: TrackModel, dt: float) -> Track:
        track = model.to_track(self._view)
        if self._config.smoothing_s <= 0.0:
            return track
        lag = self._config.smoothing_s
        in_image, in_space = self._filters.setdefault(model.id, (CurveFilter(lag), CurveFilter(lag)))
        curve_3d = None if track.curve_3d is None else in_space(track.curve_3d, dt)
        return replace(track, curve=in_image(track.curve, dt), curve_3d=curve_3d)
