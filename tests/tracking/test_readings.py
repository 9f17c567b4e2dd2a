"""The decision between a frame's own reading and that of the tracks that are laid through it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders import detection_of, line, part, wave
from tracked_curves import level

from dloftbs.config import TrackingConfig
from dloftbs.data.curve import BSplineCurve
from dloftbs.evidence import OcclusionEvidence
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.observation import make_observations
from dloftbs.tracking.partial_match import WHOLE, PartialMatch, TrackObservation
from dloftbs.tracking.reading_features import Features, measure_reading
from dloftbs.tracking.reading_weights import WEIGHTS
from dloftbs.tracking.readings import (
    find_groups,
    list_readings,
    match_whole_objects,
    rank_readings,
    score,
    score_all,
    weigh,
)
from dloftbs.tracking.track_model import TrackModel

VIEW, GATE = View((600, 900)), TrackingConfig().gate


def followed(*curves: BSplineCurve, frames: int = 10) -> list[TrackModel]:
    """Return the tracks of curves that were seen as they are in so many frames."""
    models = []
    for number, one in enumerate(make_observations([detection_of(curve) for curve in curves]), start=1):
        models.append(TrackModel.from_observation(number, one))
        for _ in range(frames):
            models[-1].update_whole(one)
            models[-1].count_hit(1)
    return models


def whole(one) -> TrackObservation:
    return TrackObservation((PartialMatch(one, WHOLE, WHOLE),))


def measured(models, observations, reading) -> Features:
    return Features(*measure_reading(models, observations, reading, VIEW).tolist())


def test_what_is_as_before_surprises_by_nothing():
    models, seen = followed(wave()), make_observations([detection_of(wave())])
    found = measured(models, seen, {1: whole(seen[0])})
    assert found == Features(clear=seen[0].log_odds)
    assert seen[0].log_odds > 6.0


def test_what_a_reading_leaves_out_counts():
    models = followed(wave(), level(400.0))
    seen = make_observations([detection_of(wave()), detection_of(level(500.0))])
    found = measured(models, seen, {1: whole(seen[0])})
    assert found.unclaimed == pytest.approx(math.log1p(seen[1].length / seen[1].width))


def test_a_hidden_half_is_bare_or_covered_by_what_lies_on_it_or_is_known_to_hide_it():
    models, straight = followed(line((100.0, 100.0), (500.0, 100.0))), line((100.0, 100.0), (300.0, 100.0))
    across = line((300.0, 104.0), (500.0, 104.0))
    seen = make_observations([detection_of(straight), detection_of(across)])
    half = math.log1p(200.0 / seen[0].width)
    shown = {1: TrackObservation((PartialMatch(seen[0], (0.0, 0.5), WHOLE),))}
    found = measured(models, seen, shown)
    assert (found.parts, found.bare) == (1.0, 0.0)
    assert found.covered == pytest.approx(half, rel=0.02)
    assert found.belief == models[0].belief.log_odds == pytest.approx(seen[0].log_odds)
    alone = measured(models, seen[:1], shown)
    assert alone.bare == pytest.approx(half, rel=0.02)
    assert alone.covered < 1.0  # at its own end
    occluders = np.zeros((600, 900), np.bool_)
    occluders[50:150, 290:520] = True
    hidden = View((600, 900), OcclusionEvidence(occluders=occluders))
    assert Features(*measure_reading(models, seen[:1], shown, hidden)).covered == pytest.approx(half, rel=0.02)


def test_whole_objects_are_the_nearest_tracks_as_a_whole_in_either_direction():
    models = followed(level(200.0), level(400.0))
    seen = make_observations([detection_of(level(403.0).reversed()), detection_of(level(203.0))])
    found = match_whole_objects(models, seen, {}, VIEW, GATE)
    assert [found[i].matches[0].observation.detection_index for i in (1, 2)] == [1, 0]
    assert [found[i].matches[0].observation.backwards for i in (1, 2)] == [False, True]
    assert all(one.is_whole for one in found.values())


def test_what_lies_as_near_either_way_runs_as_its_part_does():
    models = followed(line((100.0, 300.0), (500.0, 300.0)))
    (seen,) = make_observations([detection_of(line((300.0, 100.0), (300.0, 500.0)))])  # across its middle
    for part_of in (seen, seen.reversed()):
        shown = {1: TrackObservation((PartialMatch(part_of, (0.4, 0.6), WHOLE),))}
        found = match_whole_objects(models, [seen], shown, VIEW, 1.0)
        assert found[1].matches[0].observation.backwards == part_of.backwards


def test_what_lies_beyond_the_gate_is_no_object_of_a_track():
    models, length = followed(level(200.0)), level(200.0).length
    near, far = (make_observations([detection_of(level(200.0 + share * GATE * length))]) for share in (0.9, 1.1))
    assert match_whole_objects(models, near, {}, VIEW, GATE)
    assert not match_whole_objects(models, far, {}, VIEW, GATE)


def test_what_is_short_and_ends_under_what_hides_the_rest_is_not_whole():
    models, seen = followed(level(200.0)), make_observations([detection_of(part(level(200.0), 0.0, 0.8))])
    occluders = np.zeros((600, 900), np.bool_)
    x = round(float(seen[0].curve.end[0]))
    occluders[150:250, x : x + 100] = True
    hidden = View((600, 900), OcclusionEvidence(occluders=occluders))
    assert match_whole_objects(models, seen, {}, VIEW, 1.0)
    assert not match_whole_objects(models, seen, {}, hidden, 1.0)


def test_a_track_that_is_not_seen_costs_more_the_longer_it_is_and_only_against_other_tracks():
    models = followed(level(100.0), level(400.0), level(500.0, 250.0))
    seen = make_observations([detection_of(level(100.0))])
    reading = {1: whole(seen[0])}
    group = models[:1], seen
    alone, both, short = (score_all((some, seen), reading, VIEW) for some in (models[:1], models[:2], models[::2]))
    assert alone == score(group, reading, VIEW)
    assert both < short < alone
    assert score((models, seen), reading, VIEW) == pytest.approx(alone)


def test_groups_are_what_any_reading_connects():
    models = followed(level(100.0), level(200.0), level(400.0))
    seen = make_observations([detection_of(level(y)) for y in (100.0, 200.0, 400.0, 500.0)])
    one = {1: whole(seen[0]), 2: whole(seen[1]), 3: whole(seen[2])}
    other = {1: TrackObservation((*whole(seen[0]).matches, *whole(seen[1]).matches))}
    found = [
        (sorted(model.id for model in tracks), sorted(one.detection_index for one in parts))
        for tracks, parts in find_groups(models, seen, (one, other))
    ]
    assert sorted(found) == [([1, 2], [0, 1]), ([3], [2])]


def test_each_group_has_the_reading_with_the_highest_sum():
    models = followed(level(100.0), level(400.0))
    seen = make_observations([detection_of(part(level(y), 0.0, 0.9)) for y in (100.0, 400.0)])
    tracks = {i: TrackObservation((PartialMatch(one, (0.0, 0.9), WHOLE),)) for i, one in zip((1, 2), seen, strict=True)}
    for _ in range(20):
        models[1].belief.add(-6.9)
    (lost, chosen), *others = rank_readings(models, seen, tracks, VIEW, 1.0)
    assert lost == 0.0
    for k, model in enumerate(models):
        group = [model], [seen[k]]
        candidates = list_readings(group, {model.id: tracks[model.id]}, VIEW)
        assert [one[model.id].is_whole for one in candidates] == [False, True]
        sums = [np.dot(WEIGHTS, measure_reading(*group, reading, VIEW)) for reading in candidates]
        assert weigh(group, candidates, VIEW) == pytest.approx(sums)
        assert chosen[model.id] == candidates[np.argmax(sums)][model.id]
        # The other reading of this group, with the likeliest ones of all other groups:
        lost, other = others[k]
        assert lost == pytest.approx(max(sums) - min(sums))
        assert other == {**chosen, model.id: candidates[np.argmin(sums)][model.id]}
    assert chosen[1] is tracks[1]
    assert chosen[2].is_whole


def test_two_that_were_seen_to_move_apart_are_two_whatever_a_frame_reads():
    models = followed(level(100.0), level(400.0))
    (seen,) = make_observations([detection_of(level(250.0))])
    apart = {1: whole(seen)._replace(apart_from=frozenset((2,)))}
    assert list_readings((models, [seen]), apart, VIEW) == [apart]
