"""The tracker: the order of its steps, and the tracks from frame to frame."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import replace

from dloftbs.config import TrackingConfig
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.prediction import Prediction
from dloftbs.data.tracks import Track, TrackState
from dloftbs.errors import InputError
from dloftbs.evidence import OcclusionEvidence
from dloftbs.support.arrays import FloatArray
from dloftbs.support.values import ROUNDING_S, check_size, check_stamp, check_type, count_of, varied
from dloftbs.tracking.appearance import with_appearances
from dloftbs.tracking.association import associate
from dloftbs.tracking.branch_roles import BranchRoles
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.hypotheses import Continuation, Hypothesis, Ids, continue_with, select_likeliest
from dloftbs.tracking.motion_filter import CurveFilter
from dloftbs.tracking.observation import Observation, make_observations
from dloftbs.tracking.partial_match import TrackObservation
from dloftbs.tracking.publication import make_hidden_curve, to_track
from dloftbs.tracking.stream_clock import Step, StreamClock
from dloftbs.tracking.track_confidence import probability_of, signs_of
from dloftbs.tracking.track_model import TrackModel
from dloftbs.tracking.track_motion import extrapolated_time, move_curve
from dloftbs.tracking.track_update import update_seen

_log = logging.getLogger("dloftbs.tracking")


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

    >>> sure = track.confidence
    >>> tracker.update([], stamp=3 / 30)
    ()
    >>> (track,) = tracker.lost
    >>> track.id, track.state.value, track.inferred, track.confidence < sure
    (1, 'hidden', ((0.0, 1.0),), True)
    """

    def __init__(self, config: TrackingConfig | None = None) -> None:
        self._config = TrackingConfig() if config is None else config
        check_type("config", self._config, TrackingConfig)
        self._hypotheses: list[Hypothesis] = [Hypothesis([])]  # the likeliest one first
        self._tracks: tuple[Track, ...] = ()
        self._lost: tuple[Track, ...] = ()
        self._filters: dict[int, tuple[CurveFilter, CurveFilter]] = {}  # in the image and in space, by id
        self._ids = Ids()
        self._branches = BranchRoles()
        self._clock = StreamClock(self._config.frame_s)
        self._view = View()

    def __repr__(self) -> str:
        return f"Tracker({count_of(len(self._tracks), 'track')}, {len(self._lost)} lost)"

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The tracks as last published."""
        return self._tracks

    @property
    def lost(self) -> tuple[Track, ...]:
        """The tracks that are not published: the last frame shows nothing of them. Each is at its predicted place."""
        return self._lost

    @property
    def _held_ids(self) -> set[int]:
        """Ids of all tracks that may go on, those of less likely hypotheses included."""
        return {model.id for one in self._hypotheses for model in one.models}

    def reset(self) -> None:
        """Forget all tracks, the time and the size; ids continue, so that none is used twice."""
        self._hypotheses, self._tracks, self._lost = [Hypothesis([])], (), ()
        self._filters = {}
        self._branches = BranchRoles()
        self._clock, self._view = StreamClock(self._config.frame_s), View()

    def update(
        self,
        detections: Sequence[Detection | BSplineCurve],
        stamp: float | None = None,
        size: tuple[int, int] | None = None,
        *,
        widths: Sequence[float] | None = None,
        occlusion: OcclusionEvidence | None = None,
        outline: FloatArray | None = None,
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
            microsecond, is a repetition: nothing changes. A pause longer than `TrackingConfig.keep_lost_s` ends all
            tracks.
        size : (int, int), optional
            ``(H, W)`` of the frame, px: an object that leaves the image is then known to continue outside.
        widths : sequence of float, optional
            Of the objects, px, NaN if unknown, for bare curves; detections have their own.
        occlusion : OcclusionEvidence, optional
            What hides objects in this frame: an object under it is published as hidden, and what is clear of it is not
            inferred. With an image, objects of clearly different colours are never taken for each other.
        outline : numpy.ndarray, shape (n, 2), optional
            Corners of the polygon that alone is seen of the image, px: its edges act as the image's border.

        Returns
        -------
        tuple of Track
            By id.

        Raises
        ------
        InputError
            If an item is neither a detection nor a curve in the image; if a stamp, size or width is invalid, or
            the evidence of another size; or, if so configured, if the size differs from the last frame's or
            the stamp lies before its.
        """
        observations = make_observations(detections, widths)
        step = self._advance(stamp, size, occlusion)
        dt = step.seconds
        self._view.outline = outline
        observations = with_appearances(observations, occlusion)
        if dt == 0.0:
            return self._tracks
        self._update_tracks(observations, step)
        # Of each, since to publish a track is to record its ends, by which later frames are read.
        likeliest, *others = self._hypotheses
        published, lost = _publish(likeliest.models, self._view, dt, self._hypotheses)
        for one in others:
            _publish(one.models, self._view, dt)
        self._tracks, self._lost = self._smooth(published, dt), tuple(lost)
        self._branches.record(observations, self._tracks, self._held_ids)
        return self._tracks

    def predict(self, stamp: float | None = None) -> tuple[Prediction, ...]:
        """Predict the curves of confirmed and hidden tracks at a time, or in the next frame; nothing changes.

        There are none at a time before the last frame's: a frame of that time would be of another stream. The longer
        frames have been missing by then, the less sure the predictions are, and the tracks end as in `update`.
        """
        step = self._clock.step_to(check_stamp(stamp))
        if step.seconds < 0.0:
            return ()
        duration = extrapolated_time(step.seconds)
        return tuple(
            Prediction(
                move_curve(model.curve, model.motion.velocity, duration),
                model.sight.confidence_after(step.frameless_s) * model.belief.probability,
                model.sight.unseen_spans,
                model.id,
                None if math.isnan(model.width) else model.width,
                model.apart,
                model.sight.inferred,
                model.existence.total,
            )
            for model in self._hypotheses[0].models
            if model.state is not TrackState.TENTATIVE and self._is_kept(model, step.frameless_s)
        )

    def _advance(self, stamp: float | None, size: tuple[int, int] | None, occlusion: OcclusionEvidence | None) -> Step:
        """Return the time since the last frame; forget the tracks if this frame does not continue the stream."""
        stamp, size = check_stamp(stamp), None if size is None else check_size("size", size, 0)
        if occlusion is not None:
            check_type("occlusion", occlusion, OcclusionEvidence)
            if size not in (None, occlusion.size):
                raise InputError(f"the evidence of occlusion must have the frame's size {size}, got {occlusion.size}")
            size = occlusion.size
        known = self._view.size
        if size is not None and known is not None and size != known:
            self._break_off("on_new_size", f"the frame has the size {size}, the ones before {known}")
        if self._clock.step_to(stamp).seconds < 0.0:
            told = f"the frame's stamp {stamp} lies before the last one's {self._clock.stamp}"
            self._break_off("on_old_stamp", told)
        self._view = View(size or self._view.size, occlusion)
        return self._clock.advance(stamp)

    def _break_off(self, setting: str, told: str) -> None:
        """Forget all tracks, as a frame does not continue the stream, or raise an error, as a setting says."""
        if getattr(self._config, setting) == "error":
            raise InputError(f"{told}: reset the tracker, or set tracking.{setting} to 'reset'")
        _log.warning("%s: all tracks are forgotten", told)
        self.reset()

    def _update_tracks(self, observations: Sequence[Observation], step: Step) -> None:
        """Update the hypotheses by a frame's observations, each by the likeliest readings of it."""
        continuations: list[Continuation] = []
        is_compared, roles = len(self._hypotheses) > 1, self._branches.known(observations)
        for hypothesis in self._hypotheses:
            models = [model for model in hypothesis.models if self._is_kept(model, step.frameless_s)]
            for model in models:
                model.predict(step)
            gate = self._config.gate
            readings = associate(models, observations, self._view, gate, roles=roles, is_compared=is_compared)
            continuations += continue_with(hypothesis._replace(models=models), readings)
        kept = select_likeliest(continuations)
        self._ids.start_frame()
        self._hypotheses = []
        for k, one in enumerate(kept):
            goes_on = any(other.models is one.models for other in kept[k + 1 :])
            models = [model.copied() for model in one.models] if goes_on else one.models
            followed = self._follow(models, one.reading.shown, observations, step.seconds)
            self._hypotheses.append(Hypothesis(followed, one.nats - kept[0].nats))

    def _follow(
        self,
        models: Sequence[TrackModel],
        shown: Sequence[TrackObservation],
        observations: Sequence[Observation],
        dt: float,
    ) -> list[TrackModel]:
        """Update some tracks by what a frame shows of them, and start tracks of new objects; return those that go on.

        They are in the order of their ids.
        """
        view = self._view
        seen = list(zip(models, shown, strict=True))
        for t, (model, one) in enumerate(tuple(seen)):
            sides = model.separation.find_cut(one, model.position_tolerance_px, model.width, view)
            if sides is not None:
                seen[t] = model, sides[0]
                seen.append((model.split_off(self._ids.of_part(model.id)), sides[1]))
        result = []
        for model, one in seen:
            if one.matches:
                update_seen(model, one, view, dt)
            if one.matches or self._continues_unseen(model, dt):
                result.append(model)
        known = {part.observation.detection_index for _, one in seen for part in one.matches}
        for new in observations:
            if new.detection_index not in known:
                model = TrackModel.from_observation(self._ids.of_detection(new.detection_index), new)
                model.belief.add(new.log_odds)
                model.count_hit(new.existence_log_odds)
                result.append(model)
        return sorted(result, key=lambda model: model.id)

    def _is_kept(self, model: TrackModel, seconds: float) -> bool:
        """Return whether a track goes on if nothing of it is seen for some more time."""
        return model.missing_s + seconds <= self._config.keep_lost_s + ROUNDING_S

    def _continues_unseen(self, model: TrackModel, dt: float) -> bool:
        """Extrapolate a track that was not seen; return False if it has ended."""
        if not self._is_kept(model, dt) or (model.state is TrackState.TENTATIVE and model.existence.is_spent):
            return False
        model.update_unseen(self._view, dt)
        return True

    def _smooth(self, tracks: Sequence[Track], dt: float) -> tuple[Track, ...]:
        """Return the published tracks with their curves smoothed, if so configured."""
        lag = self._config.smoothing_s
        if lag <= 0.0:
            return tuple(tracks)
        self._filters = {t.id: self._filters.get(t.id) or (CurveFilter(lag), CurveFilter(lag)) for t in tracks}
        result = []
        for track in tracks:
            in_image, in_space = self._filters[track.id]
            if track.curve_3d is None:
                self._filters[track.id] = in_image, CurveFilter(lag)
            curve_3d = None if track.curve_3d is None else in_space(track.curve_3d, dt)
            smooth = replace(track, curve=in_image(track.curve, dt), curve_3d=curve_3d)
            result.append(varied(smooth, _fitted_parts=track._parts))
        return tuple(result)


def _publish(
    models: Sequence[TrackModel], view: View, dt: float, hypotheses: Sequence[Hypothesis] = ()
) -> tuple[list[Track], list[Track]]:
    """Return the tracks of a hypothesis that are published, and those that are lost.

    A track is the surer, the more of `hypotheses` agree on its curve.
    """
    published: list[Track] = []
    lost: list[Track] = []
    for model in models:
        if model.misses:
            model.visible = make_hidden_curve(model, view)
        else:
            model.measure_in_space(dt)
        track = to_track(model, view, probability_of(signs_of(model, hypotheses)))
        if not model.misses:
            model.record(track.ends)
        (lost if model.misses and model.visible is None else published).append(track)
    return published, lost
