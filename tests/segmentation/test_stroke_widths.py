"""Cables beneath strokes: how wide they are, and what is theirs."""

import tracemalloc

import cv2
import numpy as np
import pytest

import dloftbs
from dloftbs.config import Stroke
from dloftbs.segmentation import ColourModel
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


def _rows(ground, at, width, colour=(40, 30, 200)):
    """Return an image (H, 640, 3) of cables in rows of a noisy ground, (H, 3) or one colour."""
    image = np.zeros((480, 640, 3)) + np.asarray(ground, float).reshape(-1, 1, 3)
    image = np.clip(np.random.default_rng(0).normal(image, 8.0), 0, 255).astype(np.uint8)
    for row in at:
        image[row - width // 2 : row + width // 2 + 1, 60:580] = colour
    return image


def _widths(image, rows):
    strokes = [Stroke(points=[(x, row), (x + 150, row)]) for row in rows for x in (190, 320)]
    return [cables_beneath(image, [stroke]).width_px for stroke in strokes]


@pytest.mark.parametrize("spacing", [1.5, 2.0, 3.0, 4.0, 6.0])
@pytest.mark.parametrize("number", [2, 5])
def test_the_width_of_parallel_cables_is_that_of_one(spacing, number):
    rows = [150 + round(k * 11 * spacing) for k in range(number)]
    assert _widths(_rows((100, 100, 100), rows, 11), rows) == pytest.approx([11.0] * 2 * number, abs=1.0)


@pytest.mark.large
def test_strokes_on_parallel_cables_make_a_model_that_finds_all():
    rows = (150, 195, 240, 285, 330)
    image = _rows((100, 100, 100), rows, 11)
    drawn = [Stroke(points=[(190, 240), (340, 240)]), Stroke(points=[(250, 150), (420, 150)])]
    model = ColourModel.fit(image, drawn)
    assert model.by_colour_alone
    assert np.array_equal(model(image), (image == (40, 30, 200)).all(axis=2))
    assert len(dloftbs.detect(image, segmenter=model)) == 5


@pytest.mark.parametrize("period", [8, 14, 30])
def test_the_width_of_parallel_cables_on_striped_ground_is_that_of_one(period):
    ground = np.where(np.arange(480) // period % 2, 230, 100)[:, None].repeat(3, axis=1)
    assert _widths(_rows(ground, (198, 243, 288), 11), [243]) == pytest.approx([11.0] * 2, abs=1.0)


@pytest.mark.parametrize("rows", [[240], [180, 240, 300], [210, 240, 270]])
@pytest.mark.parametrize("ground", [100, 220])
def test_a_stripe_of_light_is_a_part_of_the_cable(rows, ground):
    image = _rows((ground, ground, ground), rows, 21)
    for row in rows:
        cv2.line(image, (60, row - 3), (579, row - 3), (120, 110, 235), 5)
    assert _widths(image, [240]) == pytest.approx([21.0] * 2, abs=1.0)


def test_a_white_stripe_is_a_part_of_the_cable_on_white_ground():
    image = _rows((220, 220, 220), [240], 21)
    cv2.line(image, (60, 238), (579, 238), (220, 215, 250), 3)
    assert _widths(image, [240]) == pytest.approx([21.0] * 2, abs=1.0)


@pytest.mark.large
def test_the_memory_of_a_long_stroke_on_a_large_picture_is_bounded():
    image = np.full((1500, 2000, 3), 90, np.uint8)
    image[745:756] = (20, 20, 200)
    tracemalloc.start()
    found = cables_beneath(image, [Stroke(points=[(50, 750), (1950, 750)])])
    _, most_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert found.width_px == pytest.approx(11.0, abs=1.0)
    assert most_bytes < 3e8  # the sums of all its places would be 0.8 GB
