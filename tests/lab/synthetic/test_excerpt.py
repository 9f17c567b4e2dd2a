import pickle

import numpy as np
import pytest

from dloftbs.errors import InputError
from dloftbs_lab.synthetic import Excerpt, KindSequence

WHOLE = KindSequence("high curvature", 120, (180, 320))


def test_an_excerpt_is_a_part_of_the_motion_at_its_speed():
    excerpt = Excerpt(WHOLE, 40, 3)
    assert (len(excerpt), excerpt.name, excerpt.fps) == (3, WHOLE.name, WHOLE.fps)
    for i, frame in enumerate(excerpt):
        whole = WHOLE.frame(40 + i)
        assert (frame.index, frame.stamp) == (i, whole.stamp)
        np.testing.assert_array_equal(frame.mask, whole.mask)
        assert excerpt.truth(i).to_dict() == WHOLE.truth(40 + i).to_dict()


def test_it_has_the_attributes_of_the_sequence_and_can_be_pickled():
    excerpt = pickle.loads(pickle.dumps(Excerpt(WHOLE, 1, 2)))
    assert excerpt.width_px == WHOLE.width_px
    assert not hasattr(excerpt, "ladder")
    np.testing.assert_array_equal(excerpt.frame(1).mask, WHOLE.frame(2).mask)


@pytest.mark.parametrize(("start", "frames"), [(-1, 2), (119, 2), (0, 0), (0, 121)])
def test_frames_that_are_not_there_are_refused(start, frames):
    with pytest.raises(InputError, match="some of the 120 frames"):
        Excerpt(WHOLE, start, frames)


@pytest.mark.parametrize("index", [-1, 2])
def test_an_index_outside_is_refused(index):
    excerpt = Excerpt(WHOLE, 5, 2)
    with pytest.raises(InputError, match=r"index must be in 0\.\.1"):
        excerpt.frame(index)
    with pytest.raises(InputError, match=r"index must be in 0\.\.1"):
        excerpt.truth(index)
