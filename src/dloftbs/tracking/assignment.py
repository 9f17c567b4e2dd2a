"""Assignment of observations, and of parts of them, to tracks.

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
from dloftbs.observation import Observation
from dloftbs.tracking.alignment import locate_on_track
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels import alignment as kernels
from dloftbs.tracking.partial_match import WHOLE, PartialMatch
from dloftbs.tracking.prediction import PredictedTracks
from dloftbs.tracking.track_model import MAX_WIDENING, WIDENING_PER_S, TrackModel
from dloftbs.tracking.unambiguous_matches import MAX_WIDTH_RATIO

_MISFIT_CAP = 1.5
"""Largest distance of a sample that counts, as a multiple of the gate.

Source: by hand; beyond the gate, so that outliers do not decide.
"""

_UNCOVERED_COST = 0.5
"""Cost of the length of the longer curve that the shorter one lacks, as a share of the gate.

Source: by hand; half of what no match at all costs.
"""

_MIN_GATE_WIDTHS = 3.0
"""Least gate, widths.

Source: by hand; short objects move by more than a share of their length.
"""

_BORDER_STRIDE = 9
"""Step between the samples that are tested for the image's border.

Source: bounds time; eight samples along a curve.
"""


def assign(
    models: Sequence[TrackModel],
    predicted: PredictedTracks,
    observations: Sequence[Observation],
    config: TrackingConfig,
    view: View,
) -> Assignment:
    """Assign observations to tracks; those that are as long as no track are split at their long gaps."""
    whole = Assignment(models, predicted, observations, config, view)
    parts = [
        part for d, one in enumerate(observations) for part in ([one] if whole.is_whole(d) else one.split_at_gaps())
    ]
    result = whole if len(parts) == len(observations) else Assignment(models, predicted, parts, config, view)
    result.solve()
    return result


class Assignment:
    """Assignment of the observations of one frame to the tracks; indices are t of tracks and d of observations.

    Attributes
    ----------
    observations : sequence of Observation
    matches : list of list of PartialMatch
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
        self.matches: list[list[PartialMatch]] = [[] for _ in models]
        self.unassigned: list[int] = []

    def solve(self) -> None:
        """Find the observations of each track, and those of no track."""
        owner = self._assign()
        owned = set(owner.values())
        self.unassigned = [d for d in range(len(self.observations)) if d not in owned]
        for t, d in owner.items():
            self.matches[t] = [self._match_whole(t, d)]

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
        differs: npt.NDArray[np.bool_] = (ratio > MAX_WIDTH_RATIO) | (ratio < 1.0 / MAX_WIDTH_RATIO)
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
