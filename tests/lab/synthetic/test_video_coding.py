"""The drawn codec: whole numbers, half the colour, blocks."""

import hashlib

import numpy as np
import pytest

from dloftbs_lab.synthetic.video_coding import coded, thresholded


def noise(size=(37, 51), seed=0):
    return np.random.default_rng(seed).integers(0, 256, (*size, 3), np.uint8)


def test_a_picture_of_one_colour_comes_out_as_it_was_to_a_few_levels():
    for colour in ((0, 0, 0), (255, 255, 255), (20, 190, 235), (200, 30, 60)):
        picture = np.full((33, 40, 3), colour, np.uint8)
        assert np.abs(coded(picture, 4).astype(int) - colour).max() <= 3


def test_the_size_stays_and_the_input_too():
    picture = noise()
    before = picture.copy()
    assert coded(picture, 20).shape == picture.shape
    np.testing.assert_array_equal(picture, before)


def test_grey_detail_outlives_a_small_step_and_colour_detail_does_not():
    grey = np.repeat(noise()[..., :1] // 2 + 60, 3, axis=2)
    assert np.abs(coded(grey, 1).astype(int) - grey).max() <= 3
    stripes = np.zeros((32, 32, 3), np.uint8)
    stripes[::2] = (0, 0, 200)
    stripes[1::2] = (200, 0, 0)
    out = coded(stripes, 1).astype(int)
    # Half the rows have the colour of their neighbour: all that is left is how bright each is.
    assert np.abs(out[0::2, :, 2] - out[1::2, :, 2]).max() < 60


def test_a_larger_step_leaves_more_error():
    picture = noise((64, 64))
    error = [np.abs(coded(picture, step).astype(int) - coded(picture, 1)).mean() for step in (4, 16, 64)]
    assert error == sorted(error)
    assert error[0] < error[2] / 3.0


def test_every_machine_makes_the_same_bytes():
    picture = (np.arange(40 * 56 * 3).reshape(40, 56, 3) * 7919 % 251).astype(np.uint8)
    assert hashlib.sha256(coded(picture, 18).tobytes()).hexdigest()[:16] == "d85649b7b1fb9bae"


@pytest.mark.parametrize(
    ("colour", "inside"),
    [((0, 200, 200), True), ((200, 200, 200), False), ((0, 50, 50), False), ((150, 200, 200), False)],
)
def test_a_colour_range_takes_what_is_colourful_and_bright(colour, inside):
    picture = np.full((3, 4, 3), colour, np.uint8)
    assert (thresholded(picture, 90, 110) == inside).all()
