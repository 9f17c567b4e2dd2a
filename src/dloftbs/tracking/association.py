"""Association of observations, and of parts of them, with tracks.

First each observation goes to one track at most, as a whole. The others are then examined in parts: an observation may
be one more part of a track that is partly hidden, and a track may be a part of an observation that two tracks share.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from dloftbs._arrays import FloatArray
from dloftbs.config import TrackingConfig
from dloftbs.observation import Observation, U, sample_curve
from dloftbs.tracking.alignment import locate_on_track, snap_to_end
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels import alignment as kernels
from dloftbs.tracking.kernels.routing import MAX_BRIDGE, MAX_BRIDGE_CHANGE
from dloftbs.tracking.partial_match import WHOLE, PartialMatch, TrackObservation, hidden_spans
from dloftbs.tracking.prediction import PredictedTracks
from dloftbs.tracking.track_model import MAX_WIDENING, MIN_SEEN_FRAMES, WIDENING_PER_S, TrackModel, interpolate_samples
from dloftbs.tracks import TrackState

_MAX_MEAN = 0.02
"""Largest mean distance of an unambiguous match, as a share of the length.

Source: by hand; a hand's motion from frame to frame, and well below the gate.
"""

_MAX_ANYWHERE = 0.03
"""Largest distance of a sample of an unambiguous match, as a share of the length.

Source: by hand; one and a half times `_MAX_MEAN`, so that no end is missing.
"""

_MARGIN_RATIO = 3.0
"""Number of times that any other candidate must be farther than an unambiguous match.

Source: by hand.
"""

_MISFIT_CAP = 1.5
"""Largest distance of a sample that counts, as a multiple of the gate.

Source: by hand; beyond the gate, so that outliers do not decide.
"""

_UNCOVERED_COST = 0.5
"""Cost of the length of the longer curve that the shorter one lacks, as a share of the gate.

Source: by hand; half of what no match at all costs.
"""

_MAX_WIDTH_RATIO = 3.0
"""Ratio of widths above which two are different objects.

Source: by hand; a cable that comes nearer by a half is twice as wide.
"""

_MIN_GATE_WIDTHS = 3.0
"""Least gate, widths.

Source: by hand; short objects move by more than a share of their length.
"""

_PART_OVERLAP = 0.2
"""Share of a part's length that may lie where another part is assumed.

Source: by hand.
"""

_MAX_PAIR_RATIO = 1.5
"""Ratio of widths, and of lengths in space, up to which two may be one object that moved fast.

Source: by hand.
"""

_PAIR_SHIFT_WEIGHT = 0.5
"""Weight of the mean shift where it tells the direction of an object that moved fast, ratio.

Source: by hand.
"""

_BORDER_STRIDE = 9
"""Step between the samples that are tested for the image's border.

Source: bounds time; eight samples along a curve.
"""

_PART_STRIDE = 7
"""Step between the samples of a detection that an unmatched track is compared with.

Source: bounds time; ten samples along a curve.
"""

_SPAN_SAMPLES = 32
"""Number of samples of a span of a track that is compared with a detection.

Source: bounds time; half of a curve's `SAMPLES`.
"""

_END_MISFIT_RATIO = 1.5
"""Ratio of misfits up to which a part that fits better elsewhere lies at an end.

Source: by hand; a part at an end is the commoner case.
"""


def match_unambiguous(
    models: Sequence[TrackModel], predicted: PredictedTracks, observations: Sequence[Observation]
) -> list[int]:
    """Return for each track one more than the index of its observation, negative if that is reversed, 0 if ambiguous.

    A match is unambiguous if the track was seen as a whole before and is now, and nothing else is near.
    """
    if not observations:
        return [0] * len(models)
    lengths = np.array([one.length for one in observations])
    closed = np.array([one.curve.closed for one in observations])
    points = np.array([one.points for one in observations])
    whole = np.array([not (m.hidden or m.misses or m.curve.closed) for m in models])
    partner: list[int] = kernels.match_unambiguous(
        predicted.points,
        predicted.lengths,
        whole,
        points,
        lengths,
        closed,
        predicted.length_tolerances,
        _MAX_MEAN,
        _MAX_ANYWHERE,
        _MARGIN_RATIO,
    ).tolist()
    for t, p in enumerate(partner):
        if p:
            ratio = _ratio(models[t].width, observations[abs(p) - 1].width)
            if not 1.0 / _MAX_WIDTH_RATIO <= ratio <= _MAX_WIDTH_RATIO:
                partner[t] = 0
    return partner


def _ratio(one: float, other: float) -> float:
    return one / other if one > 0.0 and other > 0.0 else 1.0  # an unknown width, NaN, agrees with any


def associate(
    models: Sequence[TrackModel],
    predicted: PredictedTracks,
    observations: Sequence[Observation],
    config: TrackingConfig,
    view: View,
) -> Association:
    """Associate tracks with observations.

    Observations that are as long as no track are split at their long gaps.
    """
    whole = Association(models, predicted, observations, config, view)
    parts = [
        part for d, one in enumerate(observations) for part in ([one] if whole.is_whole(d) else one.split_at_gaps())
    ]
    association = whole if len(parts) == len(observations) else Association(models, predicted, parts, config, view)
    association.solve()
    return association


def match_remaining_pair(
    models: Sequence[TrackModel],
    predicted: PredictedTracks,
    track_observations: Sequence[TrackObservation],
    unassigned: list[Observation],
) -> list[Observation]:
    """Match the only observation left with the only track left that was seen a frame ago, however far it moved.

    They are matched only if neither width nor length clearly differs. Returns the observations that are left then.
    """
    rest = [t for t, one in enumerate(track_observations) if not (one.matches or one.absorbed or models[t].misses)]
    if len(rest) != 1 or len(unassigned) != 1 or unassigned[0].curve_span != WHOLE:
        return unassigned
    (t,), (observation,) = rest, unassigned
    model = models[t]
    lengths = model.length, observation.length
    if model.curve_3d is not None and observation.curve_3d is not None:  # in metres, a tilt does not change it
        lengths = sample_curve(model.curve_3d)[1], sample_curve(observation.curve_3d)[1]
    ratios = _ratio(model.width, observation.width), _ratio(*lengths)
    alike = all(1.0 / _MAX_PAIR_RATIO <= ratio <= _MAX_PAIR_RATIO for ratio in ratios)
    if model.curve.closed != observation.curve.closed or not alike:
        return unassigned
    forward, backward = (
        kernels.misfit_at(one.points, predicted.points[t], 1.0, 0.0, _PAIR_SHIFT_WEIGHT)
        for one in (observation, observation.reversed())
    )
    oriented = observation if forward <= backward else observation.reversed()
    track_observations[t].matches = [PartialMatch(oriented, WHOLE, WHOLE)]
    return []


class Association:
    """Association of the tracks with the observations of one frame; indices are t of tracks and d of observations.

    Attributes
    ----------
    observations : sequence of Observation
    track_observations : list of TrackObservation
        By track, once solved.
    unassigned : list of int
        Observations that show no track, once solved.
    """

    def __init__(
        self,
        models: Sequence[TrackModel],
        predicted: PredictedTracks,
        observations: Sequence[Observation],
        config: TrackingConfig,
        view: View,
    ) -> None:
        self._models = models
        self._view = view
        self._override_frames = config.override_frames
        self._points = predicted.points
        self.observations = observations
        found = np.array([one.points for one in observations])
        self._lengths = np.array([one.length for one in observations])
        self._gate = self._compute_gates(config.gate)
        closed = np.array([one.curve.closed for one in observations])
        distances = kernels.box_distances(predicted.points, found)
        self._is_near = distances < MAX_WIDENING * self._gate
        measured = (distances < _MISFIT_CAP * self._gate) & self._has_similar_width()
        self._misfit, self._start, self._backwards = kernels.align_all(
            predicted.points,
            predicted.lengths,
            predicted.closed,
            found,
            self._lengths,
            closed,
            measured * (_MISFIT_CAP * self._gate),
        )
        self._fits = self._misfit < self._gate
        self.track_observations = [TrackObservation() for _ in models]
        self.unassigned: list[int] = []

    def solve(self) -> None:
        """Find the observations of each track, and those of no track."""
        owner = self._assign()
        owned = set(owner.values())
        self.unassigned = [d for d in range(len(self.observations)) if d not in owned]
        for t, d in owner.items():
            self.track_observations[t].matches = [self._match_whole(t, d)]
        for t, d in list(owner.items()):
            self._share_with_another(t, d, owner)
        for d in sorted(self.unassigned, key=lambda d: -self._lengths[d]):
            self._assign_part(d)
        self.unassigned = [d for d in self.unassigned if not self._may_be_hidden_part(d)]
        owners: dict[int, list[int]] = {}
        for t, d in owner.items():
            owners.setdefault(d, []).append(t)
        for t, one in enumerate(self.track_observations):
            one.overlapped = not one.matches and self._is_overlapped(t, owners)

    def is_whole(self, d: int) -> bool:
        """Return True if an observation, gaps included, is as long as a near track, which is rarely a coincidence."""
        fitting = [self._models[t] for t in np.flatnonzero(self._fits[:, d]).tolist()]
        return any(abs(model.length - self._lengths[d]) < model.position_tolerance_px for model in fitting)

    def _compute_gates(self, share: float) -> FloatArray:
        """Return the largest distance for each pair, shape (tracks, observations)."""
        widening = [min(1.0 + WIDENING_PER_S * float(m.unseen_s.mean()), MAX_WIDENING) * share for m in self._models]
        least = [0.0 if math.isnan(m.width) else _MIN_GATE_WIDTHS * m.width for m in self._models]
        mean = np.sqrt(np.multiply.outer([m.length for m in self._models], self._lengths))
        gates: FloatArray = np.maximum(np.array(widening)[:, None] * mean, np.array(least)[:, None])
        return gates

    def _has_similar_width(self) -> npt.NDArray[np.bool_]:
        one = np.array([m.width for m in self._models])
        other = np.array([self._uncut_width(observation) for observation in self.observations])
        ratio = np.divide.outer(one, other)
        differs: npt.NDArray[np.bool_] = (ratio > _MAX_WIDTH_RATIO) | (ratio < 1.0 / _MAX_WIDTH_RATIO)
        return ~differs  # an unknown width agrees with any

    def _uncut_width(self, observation: Observation) -> float:
        """Return an observation's width, NaN if it lies along the image's border, which cuts it lengthwise."""
        points = observation.points[::_BORDER_STRIDE]
        along = all(self._view.is_at_border(p, observation.width) for p in points)
        return math.nan if along else observation.width

    def _assign(self) -> dict[int, int]:
        """Map tracks to observations: as many pairs as possible, with the least total cost."""
        lengths = np.array([m.length for m in self._models])
        covered = np.divide.outer(lengths, self._lengths)
        covered = np.minimum(covered, 1.0 / covered)
        cost = covered * self._misfit / self._gate + (1.0 - covered) * _UNCOVERED_COST
        # Beyond the gate all pairs cost the same, more than all others together, and are dropped afterwards.
        beyond = float(min(cost.shape)) * (_MISFIT_CAP + _UNCOVERED_COST) + 1.0
        rows, columns = linear_sum_assignment(np.where(self._fits, cost, beyond))
        return {t: d for t, d in zip(rows.tolist(), columns.tolist(), strict=True) if self._fits[t, d]}

    def _match_whole(self, t: int, d: int) -> PartialMatch:
        """Return the match of a track with an observation that is its own."""
        model, found = self._models[t], self.observations[d]
        start, backwards = float(self._start[t, d]), bool(self._backwards[t, d])
        oriented = found.reversed() if backwards else found
        if found.curve.closed:
            share = min(model.length / found.length, 1.0)
            seam = -start if model.curve.closed else 1.0 - start - share if backwards else start
            return PartialMatch(oriented, WHOLE, (seam % 1.0, seam % 1.0 + 1.0))
        if model.curve.closed:
            return PartialMatch(oriented, WHOLE, oriented.curve_span)
        if model.is_overridden_by(found, self._override_frames):
            return PartialMatch(oriented, WHOLE, oriented.curve_span)
        share = found.length / model.length
        if abs(found.length - model.length) <= model.length_tolerance_px:
            return PartialMatch(oriented, WHOLE, oriented.curve_span)
        if share > 1.0:
            low = (1.0 - start - 1.0 / share) if backwards else start
            return PartialMatch(oriented, (min(-low * share, 0.0), max((1.0 - low) * share, 1.0)), oriented.curve_span)
        span = locate_on_track(model, self._points[t], oriented, start, self._view)
        return PartialMatch(oriented, span, oriented.curve_span)

    def _share_with_another(self, t: int, d: int, owner: dict[int, int]) -> None:
        """Share an observation that is longer than its track with another track that lies there, if one does."""
        model, (match,) = self._models[t], self.track_observations[t].matches
        found, (low, high) = match.observation, match.track_span
        if found.curve.closed or model.curve.closed or (high - low - 1.0) * model.length < model.length_tolerance_px:
            return
        for other in np.flatnonzero(self._fits[:, d]).tolist():
            candidate = self._models[other]
            if other in owner or candidate.state is TrackState.TENTATIVE or candidate.curve.closed:
                continue
            both = model.length + candidate.length
            tolerance = model.position_tolerance_px + candidate.position_tolerance_px
            if abs(both - found.length) > tolerance:
                continue
            if model.merged_frames >= self._override_frames:
                self.track_observations[other].absorbed = True
                return
            share = candidate.length / both
            misfit, first, backwards = self._align_at_ends(other, d, found.points, share, tolerance / found.length)
            if misfit > self._gate[other, d]:
                continue
            mine, others = ((share, 1.0), (0.0, share)) if first else ((0.0, 1.0 - share), (1.0 - share, 1.0))
            self.track_observations[t] = TrackObservation([PartialMatch(found, WHOLE, _within(found.curve_span, mine))])
            oriented, span = (found.reversed(), _reverse(others)) if backwards else (found, others)
            self.track_observations[other] = TrackObservation(
                [PartialMatch(oriented, WHOLE, _within(oriented.curve_span, span))]
            )
            owner[other] = d
            return

    def _align_at_ends(
        self, t: int, d: int, points: FloatArray, share: float, tolerance: float
    ) -> tuple[float, bool, bool]:
        """Return a track's misfit at the better end of an observation, if that is the first end, and if reversed."""
        cap, track = _MISFIT_CAP * self._gate[t, d], self._points[t]
        latest = 1.0 - share
        first, _, one = kernels.align_in_range(track, points, share, 0.0, min(tolerance, latest), 0, cap)
        last, _, other = kernels.align_in_range(track, points, share, max(latest - tolerance, 0.0), latest, 0, cap)
        return (first, True, one) if first <= last else (last, False, other)

    def _assign_part(self, d: int) -> None:
        """Assign an observation that is left to the track of which it is one more part, if there is one."""
        best: tuple[float, int, PartialMatch] | None = None
        for t in np.flatnonzero(self._is_near[:, d]).tolist():
            model, matches = self._models[t], self.track_observations[t].matches
            if not matches or model.curve.closed or self.observations[d].curve.closed:
                continue
            for low, high in hidden_spans(matches):
                unseen_s = float(np.interp(0.5 * (low + high), U, model.unseen_s))
                gate = self._gate[t, d] * min(1.0 + WIDENING_PER_S * unseen_s, MAX_WIDENING)
                candidate = self._match_hidden_span(t, d, low, high)
                if candidate is not None and candidate[0] < gate and (best is None or candidate[0] / gate < best[0]):
                    best = candidate[0] / gate, t, candidate[1]
        if best is not None:
            _, t, match = best
            one = self.track_observations[t]
            one.matches = sorted([*one.matches, match], key=lambda m: m.track_span)
            self.unassigned.remove(d)

    def _may_be_hidden_part(self, d: int) -> bool:
        """Return True if an observation that is left lies where a track is hidden, and may be a part of it."""
        observation = self.observations[d]
        for t in np.flatnonzero(self._is_near[:, d]).tolist():
            model, matches = self._models[t], self.track_observations[t].matches
            if model.state is TrackState.TENTATIVE or not matches:
                continue
            for low, high in hidden_spans(matches):
                if (high - low) * model.length > observation.length:
                    track = interpolate_samples(self._points[t], np.linspace(low, high, _SPAN_SAMPLES))
                    away = np.linalg.norm(track[:, None] - observation.points[None, ::_PART_STRIDE], axis=2)
                    if away.min(axis=0).max() < 0.5 * self._gate[t, d]:
                        return True
        return False

    def _match_hidden_span(self, t: int, d: int, low: float, high: float) -> tuple[float, PartialMatch] | None:
        """Return the misfit and the match of an observation with a hidden span of a track; None if it cannot be."""
        model, found = self._models[t], self.observations[d]
        share = found.length / model.length
        tolerance = model.position_tolerance_px / model.length
        if (
            share > high - low + tolerance + _PART_OVERLAP * share
            or np.interp(0.5 * (low + high), U, model.seen_frames) < MIN_SEEN_FRAMES
        ):
            return None
        first, last = max(low - tolerance, 0.0), min(high + tolerance, 1.0) - share
        misfit, start, backwards = kernels.align_in_range(
            found.points,
            self._points[t],
            share,
            min(first, max(last, 0.0)),
            max(last, 0.0),
            0,
            _MISFIT_CAP * self._gate[t, d],
        )
        oriented = found.reversed() if backwards else found
        if low <= 0.0 or high >= 1.0:  # one occluder is likelier than two
            end = 0.0 if low <= 0.0 else 1.0 - share
            at_end = kernels.misfit_at(oriented.points, self._points[t], share, end, 1.0)
            if at_end < _END_MISFIT_RATIO * misfit + model.position_tolerance_px:
                misfit, start = at_end, end
        span = snap_to_end(start, share, model)
        span = (max(span[0], low), min(span[1], high))
        if span[1] <= span[0]:
            return None
        match = PartialMatch(oriented, span, oriented.curve_span)
        return (misfit, match) if self._is_reachable(t, match) else None

    def _is_reachable(self, t: int, match: PartialMatch) -> bool:
        """Return True if hidden spans can connect a match with its neighbours, by their lengths and their chords."""
        model = self._models[t]
        tolerance = 2.0 * model.position_tolerance_px
        for other in self.track_observations[t].matches:
            before, after = (other, match) if other.track_span < match.track_span else (match, other)
            span = (before.track_span[1], after.track_span[0])
            ends = (before.observation.points[-1], after.observation.points[0])
            chord = float(np.linalg.norm(ends[1] - ends[0]))
            hidden = max(span[1] - span[0], 0.0) * model.length
            expected = float(np.linalg.norm(np.diff(interpolate_samples(self._points[t], np.array(span)), axis=0)))
            if chord > MAX_BRIDGE * hidden + tolerance or abs(chord - expected) > (
                MAX_BRIDGE_CHANGE * hidden + tolerance
            ):
                return False
        return True

    def _is_overlapped(self, t: int, owners: dict[int, list[int]]) -> bool:
        """Return True if an unseen track lies on an observation where the track that took it was not before."""
        model = self._models[t]
        for d in np.flatnonzero(self._fits[t] & (self._lengths >= model.length)).tolist():
            start = float(self._start[t, d])
            middle = interpolate_samples(
                self.observations[d].points, np.array([start + 0.5 * model.length / float(self._lengths[d])])
            )
            for other in owners.get(d, ()):
                reach = 2.0 * self._models[other].position_tolerance_px
                near = np.linalg.norm(self._points[other] - middle, axis=1).min()
                if near > reach or model.overlapped_frames:
                    return True
        return False


def _within(span: tuple[float, float], part: tuple[float, float]) -> tuple[float, float]:
    """Return a part of a span, given as shares of it."""
    low, high = span
    return low + part[0] * (high - low), low + part[1] * (high - low)


def _reverse(span: tuple[float, float]) -> tuple[float, float]:
    return 1.0 - span[1], 1.0 - span[0]
