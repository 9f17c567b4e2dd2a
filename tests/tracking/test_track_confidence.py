"""The confidence of tracks: what speaks for a curve, and the probability that follows."""

from __future__ import annotations

import pytest
from builders import part, wave
from hypothesis import given
from hypothesis import strategies as st
from tracked_curves import see, shown_for

from dloftbs.tracking import Tracker
from dloftbs.tracking.hypotheses import MAX_NATS, Hypothesis
from dloftbs.tracking.track_confidence import Signs, probability_of, signs_of
from dloftbs.tracking.track_model import TrackModel

SURE = Signs(6.9, 0.0, MAX_NATS, 0.0)
"""A cable that clear frames show as a whole, and nothing else."""


def model_of(tracker: Tracker) -> TrackModel:
    (model,) = tracker._hypotheses[0].models
    return model


def test_what_clear_frames_show_as_a_whole_is_sure():
    assert probability_of(SURE) > 0.97


@pytest.mark.parametrize(
    "worse",
    [{"belief": 1.0}, {"in_parts": 1.0}, {"agreement": 0.0}, {"length_off": 0.3}],
    ids=lambda worse: next(iter(worse)),
)
def test_each_sign_counts(worse):
    assert probability_of(SURE._replace(**worse)) < probability_of(SURE) - 0.01


@given(st.floats(-7.0, 7.0), st.booleans(), st.floats(-MAX_NATS, MAX_NATS), st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_more_for_a_curve_makes_it_no_less_probable(belief, in_parts, agreement, length_off, more):
    signs = Signs(belief, float(in_parts), agreement, length_off)
    least = probability_of(signs)
    assert 0.0 < least < 1.0
    better = (
        signs._replace(belief=belief + more),
        signs._replace(in_parts=0.0),
        signs._replace(agreement=agreement + more),
        signs._replace(length_off=max(length_off - more, 0.0)),
    )
    assert all(probability_of(one) >= least for one in better)


def test_a_cable_in_sight_has_the_signs_of_one():
    tracker = Tracker()
    shown_for(tracker, 5, wave())
    belief, *others = signs_of(model_of(tracker), tracker._hypotheses)
    assert belief > 6.0
    assert others == [0.0, MAX_NATS, pytest.approx(0.0, abs=1e-6)]


def test_parts_and_another_length_are_signs_against_a_curve():
    tracker = Tracker()
    shown_for(tracker, 5, wave())
    (track,) = see(tracker, part(wave(), 0.0, 0.3), part(wave(), 0.5, 1.0))
    assert signs_of(model_of(tracker), tracker._hypotheses).in_parts == 1.0
    assert track.confidence < probability_of(SURE)
    see(tracker, wave())
    assert signs_of(model_of(tracker), tracker._hypotheses).in_parts == 0.0
    model_of(tracker).lengths.px *= 1.2
    assert signs_of(model_of(tracker), tracker._hypotheses).length_off == pytest.approx(0.18, abs=0.01)


def test_the_odds_of_hypotheses_with_another_curve_count_against_it():
    tracker, elsewhere = Tracker(), Tracker()
    shown_for(tracker, 3, wave())
    shown_for(elsewhere, 3, wave((0.0, 40.0)))
    models, others = [model_of(tracker)], [model_of(elsewhere)]
    beside = [
        signs_of(models[0], [Hypothesis(models), Hypothesis(others, nats)]).agreement for nats in (-9.0, -2.0, 0.0)
    ]
    assert beside == pytest.approx([MAX_NATS, 2.0, 0.0])
    assert signs_of(models[0], [Hypothesis(models), Hypothesis([])]).agreement == pytest.approx(0.0)


def test_hypotheses_that_differ_in_direction_alone_have_the_same_curve():
    tracker = Tracker()
    shown_for(tracker, 3, wave())
    model = model_of(tracker)
    back = model.copied()
    back.points = model.points[::-1]
    assert signs_of(model, [Hypothesis([model]), Hypothesis([back])]).agreement == MAX_NATS


def test_a_track_has_the_probability_of_its_signs_by_all_hypotheses():
    tracker = Tracker()
    shown_for(tracker, 10, wave())
    for _ in range(3):
        (track,) = see(tracker, part(wave(), 0.0, 0.75))
    signs = signs_of(model_of(tracker), tracker._hypotheses)
    assert len(tracker._hypotheses) > 1
    assert signs.agreement < MAX_NATS
    assert track.confidence == pytest.approx(probability_of(signs) * model_of(tracker).sight.confidence)
