"""The line prior: a line of doubtful pixels is a cable, a blot of them is none."""

import numpy as np
import pytest

from dloftbs.segmentation.line_prior import LinePrior, PixelMaps


@pytest.mark.large
def test_a_gap_of_a_line_is_rather_cable_than_the_same_pixels_alone():
    own = np.zeros((80, 160), np.uint8)
    own[36:44, :] = 230
    own[36:44, 76:84] = 110
    own[10:18, 20:28] = 110
    found = LinePrior.fitted()(PixelMaps(own, own, np.arange(own.size)))
    assert found[40, 80] > 0.5 > found[14, 24]
    assert found[40, 20] > 0.9
    assert found[70, 80] < 0.05


def test_pixels_that_are_not_listed_are_no_cable():
    own = np.full((40, 40), 255, np.uint8)
    found = LinePrior.fitted()(PixelMaps(own, own, np.arange(40)))
    assert found[0].any()
    assert not found[1:].any()
