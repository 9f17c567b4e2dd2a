"""What is found beneath each stroke by the others."""

import numpy as np
import pytest
from busy_pictures import busy

from dloftbs.config import ColourConfig
from dloftbs.segmentation import ColourModel, Stroke, cross_validate, stroke_widths

pytestmark = pytest.mark.large  # a classifier of pixels is learned in each


def test_the_width_beneath_each_stroke_is_measured_once(monkeypatch):
    measured, axis = [], stroke_widths._axis
    monkeypatch.setattr(stroke_widths, "_axis", lambda lab, stroke: measured.append(stroke) or axis(lab, stroke))
    strokes = [Stroke(points=[(x, 100), (x + 60, 100)]) for x in (20, 90, 160, 230)]
    assert cross_validate(busy()[0], strokes) is not None
    assert measured == strokes


def test_what_is_expected_is_of_the_model_that_is_judged():
    rng = np.random.default_rng(0)
    image = np.clip(rng.normal(128.0, 30.0, (200, 300, 1)) + np.zeros(3), 0, 255).astype(np.uint8)
    image[95:106, 10:290] = np.clip(rng.normal(128.0, 12.0, (11, 280, 1)), 0, 255)  # of the ground's own colours
    image[:, 250:] = (10, 200, 10)
    strokes = [Stroke(points=[(20, 100), (110, 100)]), Stroke(points=[(130, 100), (230, 100)])]
    pictures = ColourModel.pictures_of([(image, strokes, "")])
    accepted = cross_validate(image, strokes, ColourConfig(pictures=pictures, accept_strokes=True))
    assert accepted.cable > 0.9
    assert accepted.ground > 0.3  # the price of accepting
    assert cross_validate(image, strokes[:1]) is None
    other = ColourConfig(pictures=(*pictures, *ColourModel.pictures_of([(image, strokes[:1], "")])))
    assert cross_validate(image, strokes[:1], other, number=1) is not None  # by the other picture
    assert cross_validate(image, strokes, ColourConfig(pictures=pictures), roi=(0, 0, 300, 60)) is None
