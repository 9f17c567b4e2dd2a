"""Belief: evidence of frames, in nats, that is forgotten at one rate."""

from __future__ import annotations

import pytest

from dloftbs.tracking.belief import Belief


def believed(*log_odds: float) -> Belief:
    belief = Belief()
    for one in log_odds:
        belief.add(one)
    return belief


def test_nothing_is_believed_before_the_first_frame_which_counts_as_it_is():
    assert (Belief().log_odds, Belief().probability) == (0.0, 0.5)
    assert believed(0.3).log_odds == pytest.approx(0.3)
    assert believed(*[2.0] * 50).log_odds == pytest.approx(2.0)


def test_a_second_frame_outweighs_the_first_one_if_it_is_clearer():
    assert believed(0.3, -4.0).log_odds < 0.0 < believed(4.0, -0.3).log_odds


def test_the_last_frames_count_most():
    assert believed(-5.0, 5.0).log_odds > 0.0 > believed(5.0, -5.0).log_odds


def test_what_was_believed_for_long_is_given_up_as_frames_speak_against_it():
    belief = believed(*[6.0] * 100)
    assert belief.probability > 0.99
    found = []
    for _ in range(20):
        belief.add(-6.0)
        found.append(belief.log_odds)
    assert found == sorted(found, reverse=True)
    assert found[1] > 0.0 > found[4]
    assert belief.probability < 0.01
