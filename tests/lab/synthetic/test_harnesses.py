"""Drawn harnesses: what their truth says of where branches meet."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from dloftbs.errors import InputError
from dloftbs_lab.synthetic import HARNESS_VIEWS, HarnessSequence, harnesses

SIZE = (360, 640)


@pytest.mark.parametrize("view", HARNESS_VIEWS)
def test_branches_meet_in_threes_and_all_of_it_is_in_the_image(view):
    sequence = HarnessSequence(3, view, 6, SIZE, 4)
    assert sequence.is_branched
    for index in (0, 5):
        truth = sequence.truth(index)
        assert len(truth.curves) == 7
        ends = np.array([(curve.start, curve.end) for curve in truth.curves]).reshape(-1, 2)
        shared = (np.hypot(*(ends[:, None] - ends).transpose(2, 0, 1)) < 1e-6).sum(axis=1)
        assert sorted(shared.tolist()) == [1] * 5 + [3] * 9
        points = np.concatenate([curve.sample(50) for curve in truth.curves])
        assert (points > 0).all()
        assert (points < (639, 359)).all()
    assert not np.array_equal(sequence.frame(0).mask, sequence.frame(5).mask)


def test_the_same_arguments_give_the_same_frames():
    one = HarnessSequence(2, "drawn", 3, SIZE, 1)
    again = pickle.loads(pickle.dumps(one))
    assert np.array_equal(one.frame(2).mask, again.frame(2).mask)
    assert one.truth(2).to_dict() != HarnessSequence(2, "drawn", 3, SIZE, 2).truth(2).to_dict()


def test_what_cannot_be_drawn_is_an_error():
    with pytest.raises(InputError, match=r"branches must be in 1\.\.6, got 7"):
        HarnessSequence(7)
    with pytest.raises(InputError, match="view must be one of 'drawn', 'in perspective', got 'from below'"):
        HarnessSequence(2, "from below")
    with pytest.raises(InputError, match="no harness of 6 branches fits an image of"):
        HarnessSequence(6, size=(72, 128), width_px=2.4)


def test_a_suite_has_them_clean_noisy_and_occluded():
    found = harnesses(0.05, size=SIZE)
    assert len({one.name for one in found}) == len(found) == 12
    assert all(one.is_branched for one in found)
