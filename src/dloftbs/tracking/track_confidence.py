"""Confidence in a track: the probability that its curve is right."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from dloftbs.tracking.confidence_weights import TRACK_CONFIDENCE
from dloftbs.tracking.hypotheses import MAX_NATS, Hypothesis
from dloftbs.tracking.kernels.pairs import mean_distance
from dloftbs.tracking.track_model import TrackModel


class Signs(NamedTuple):
    """Signs for the curve of a track, and against it.

    Parameters
    ----------
    belief : float
        Log-odds of its shape, by the frames, nats.
    in_parts : float
        1 where the frame does not show the object as a whole, else 0.
    agreement : float
        Log-odds that the hypotheses have the same curve for it, nats.
    length_off : float
        How much its length differs from that in most full views: the absolute logarithm of the ratio.
    """

    belief: float
    in_parts: float
    agreement: float
    length_off: float


def signs_of(model: TrackModel, hypotheses: Sequence[Hypothesis]) -> Signs:
    """Return the signs of a track of the likeliest hypothesis, which comes first, after a frame's update."""
    is_whole = model.visible is None and not model.misses
    ratio = model.length / model.lengths.usual_px
    length_off = 0.0 if math.isnan(ratio) else abs(math.log(ratio))
    return Signs(model.belief.log_odds, 0.0 if is_whole else 1.0, _agreement(model, hypotheses), length_off)


def probability_of(signs: Signs) -> float:
    """Return the probability that the curve of a track is right."""
    log_odds = sum(per * sign for per, sign in zip(TRACK_CONFIDENCE, (1.0, *signs), strict=True))
    return 1.0 / (1.0 + math.exp(-log_odds))


def _agreement(model: TrackModel, hypotheses: Sequence[Hypothesis]) -> float:
    """Return the log-odds that hypotheses have the same curve for a track, at most those at which one is given up."""
    same, other = 1.0, 0.0  # it is one of the likeliest hypothesis
    for hypothesis in hypotheses[1:]:
        share = math.exp(hypothesis.nats)
        if any(one.id == model.id and _is_same(one, model) for one in hypothesis.models):
            same += share
        else:
            other += share
    return MAX_NATS if other == 0.0 else min(max(math.log(same / other), -MAX_NATS), MAX_NATS)


def _is_same(one: TrackModel, other: TrackModel) -> bool:
    """Return whether two curves, in either direction, are nearer to each other than a length is known to a track."""
    apart = min(mean_distance(way, other.points) for way in (one.points, one.points[::-1]))
    return apart <= other.length_tolerance_px
