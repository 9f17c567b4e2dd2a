"""Cables beneath strokes: how wide they are, and what is theirs."""

import tracemalloc

import numpy as np
import pytest

from dloftbs.config import Stroke
from dloftbs.segmentation.stroke_widths import cables_beneath


@pytest.mark.parametrize("width", [5, 11, 19])
@pytest.mark.parametrize("off", [0, 1])
def test_the_width_and_the_pixels_are_found_from_a_stroke_that_is_off_the_axis(width, off):
    image = np.full((200, 300, 3), 90, np.uint8)
    true = np.zeros(image.shape[:2], bool)
    true[100 - width // 2 : 101 + width // 2] = True
    image[true] = 140
    image[:, 120:125] = 250  # something lies across
    found = cables_beneath(image, [Stroke(points=[(50, 100 + off), (250, 100 + off)], radius_px=1.0)])
    assert found.width_px == pytest.approx(width, abs=1.0)
    assert true[found.cable].mean() > 0.9
    assert found.cable[:, 60:240].sum() > 0.85 * true[:, 60:240].sum()
    assert not true[found.beside].any()


def test_a_stroke_on_plain_ground_shows_no_width():
    found = cables_beneath(np.full((100, 100, 3), 90, np.uint8), [Stroke(points=[(10, 50), (90, 50)])])
    assert np.isnan(found.width_px)
    assert not found.beside.any()
    assert found.cable.any()


def test_a_wide_cable_in_a_small_picture_is_found():
    image = np.full((40, 60, 3), 90, np.uint8)
    image[17:24] = (20, 20, 200)
    found = cables_beneath(image, [Stroke(points=[(10, 20), (50, 20)])])
    assert found.width_px == pytest.approx(7.0, abs=1.0)
    assert found.beside.any()


def test_the_memory_of_a_long_stroke_on_a_large_picture_is_bounded():
    image = np.full((1500, 2000, 3), 90, np.uint8)
    image[745:756] = (20, 20, 200)
    tracemalloc.start()
    found = cables_beneath(image, [Stroke(points=[(50, 750), (1950, 750)])])
    _, most_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert found.width_px == pytest.approx(11.0, abs=1.0)
    assert most_bytes < 3e8  # the sums of all its places would be 0.8 GB
