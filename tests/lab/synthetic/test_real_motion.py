"""Real motion before a camera: the mask is where the projected line is, and a frame is the same whenever it is made."""

import pickle

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dloftbs.errors import InputError
from dloftbs_lab.synthetic import REAL_MOTION_VARIANTS, RealMotionSequence, missing_recordings, real_motion

SIZE = (360, 640)


@pytest.fixture(scope="module")
def folder(shared_data):
    if missing_recordings(shared_data / "motion") is not None:
        pytest.skip("needs ../shared/data/motion")
    return shared_data / "motion"


@pytest.mark.parametrize("cables", [1, 3])
def test_masks_are_where_the_projected_lines_are(folder, cables):
    sequence = RealMotionSequence(folder, cables, size=SIZE)
    assert (sequence.family, sequence.cables, sequence.fps, len(sequence)) == ("mask", cables, 30.0, 150)
    for index in (0, 149):
        truth = sequence.truth(index)
        np.testing.assert_array_equal(sequence.frame(index).mask, truth.mask)
        for curve, mask in zip(truth.curves, truth.visible_masks, strict=True):
            rows, columns = np.nonzero(mask)
            assert cKDTree(curve.sample(1000)).query(np.column_stack((columns, rows)))[0].max() < 12.0
        assert min(sum(high - low for low, high in spans) for spans in truth.shown_spans) > 0.5


@pytest.mark.parametrize("variant", REAL_MOTION_VARIANTS)
def test_a_frame_has_what_its_variant_says_and_is_the_same_after_pickling(folder, variant):
    one = RealMotionSequence(folder, 2, variant, size=SIZE, seed=3)
    again = pickle.loads(pickle.dumps(one))
    again.truth(5)
    frame, same = one.frame(75), again.frame(75)
    assert (frame.depth is not None, frame.image is not None) == ("depth" in variant, "image" in variant)
    for name in ("mask", "depth", "image"):
        np.testing.assert_array_equal(getattr(frame, name), getattr(same, name))
    hidden = [1.0 - sum(high - low for low, high in spans) for spans in one.truth(75).shown_spans]
    assert (max(hidden) > 0.03) == ("occluders" in variant)


def test_cables_in_a_coloured_image_differ_in_colour(folder):
    sequence = RealMotionSequence(folder, 3, "coloured image", size=SIZE)
    image, truth = sequence.frame(0).image, sequence.truth(0)
    hues = [np.median(image[mask], axis=0) for mask in truth.visible_masks]
    hues = [hue / np.linalg.norm(hue) for hue in hues]
    assert max(hues[a] @ hues[b] for a, b in ((0, 1), (0, 2), (1, 2))) < 0.9


def test_the_suite_has_every_other_variant_and_more_sequences_by_scale(folder):
    assert {one.family for one in real_motion(folder, 0.01)} == set(REAL_MOTION_VARIANTS) - {"coloured image"}
    assert len(real_motion(folder, 0.1)) == 2 * len(real_motion(folder, 0.01))


def test_what_cannot_be_is_refused(folder, tmp_path):
    with pytest.raises(InputError, match="cables must be in"):
        RealMotionSequence(folder, 5)
    with pytest.raises(InputError, match="last 150 frames"):
        RealMotionSequence(folder, frames=151)
    with pytest.raises(InputError, match="variant must be one of"):
        RealMotionSequence(folder, variant="fog")
    assert "real-motion:FOLDER" in missing_recordings(tmp_path)
