"""Cables that colour does not tell: their contrast, ridges and lines do."""

import numpy as np
import pytest
from busy_pictures import SIZE, STROKES, busy, iou

from dloftbs.config import Config, SegmentationConfig
from dloftbs.errors import ConfigError
from dloftbs.segmentation import ColourModel, Stroke, cross_validate


@pytest.mark.large
def test_a_cable_of_the_grounds_colours_is_found_by_its_look():
    image, true = busy()
    model = ColourModel.fit(image, STROKES)
    assert not model.by_colour_alone
    by_colour = model.colour_log_odds(image) > 2.2
    assert iou(model(image), true) > iou(by_colour, true) + 0.1
    other, true = busy(seed=1, shift=30)
    assert iou(model(other), true) > iou(model.colour_log_odds(other) > 2.2, true)


@pytest.mark.large
def test_the_mask_is_the_probability_from_one_half_on():
    image, _ = busy()
    model = ColourModel.fit(image, STROKES)
    probability = model.probability(image)
    assert (probability.dtype, probability.shape) == (np.float32, SIZE)
    assert probability.min() >= 0.0
    assert probability.max() <= 1.0
    mask = model(image)
    assert mask.dtype == np.bool_
    np.testing.assert_array_equal(mask, probability >= 0.5)


def test_where_colour_will_do_it_decides_alone_and_the_probability_agrees():
    image, true = busy()
    image[true] = (40, 30, 200)
    model = ColourModel.fit(image, STROKES)
    assert model.by_colour_alone
    np.testing.assert_array_equal(model(image), model.probability(image) >= 0.5)


@pytest.mark.large
def test_the_file_is_small_and_gives_the_same_probability_bit_for_bit():
    image, _ = busy()
    model = ColourModel.fit(image, STROKES)
    text = Config(segmentation=SegmentationConfig(colour=model.to_config())).to_yaml()
    assert len(text) < 200_000
    again = ColourModel(Config.from_yaml(text).segmentation.colour)
    np.testing.assert_array_equal(again.probability(image), model.probability(image))


def test_a_file_of_an_earlier_version_is_read_as_colours_alone():
    image, true = busy()
    image[true] = (40, 30, 200)
    section = SegmentationConfig(colour=ColourModel.fit(image, STROKES).to_config())
    data = Config(segmentation=section).to_dict()
    del data["segmentation"]["colour"]["pictures"][0]["pixels"]
    old = ColourModel(Config.from_dict(data).segmentation.colour)
    assert old.by_colour_alone
    assert iou(old(image), true) > 0.9


@pytest.mark.large
@pytest.mark.parametrize("text", ["x", "AAAA", "eJwDAAAAAAE="])
def test_broken_samples_of_pixels_are_refused(text):
    image, _ = busy()
    section = SegmentationConfig(colour=ColourModel.fit(image, STROKES).to_config())
    data = Config(segmentation=section).to_dict()
    data["segmentation"]["colour"]["pictures"][0]["pixels"] = text
    with pytest.raises(ConfigError, match="cannot read the samples of pixels"):
        ColourModel(Config.from_dict(data).segmentation.colour)


def test_a_click_shows_no_width_and_gives_colours_alone():
    image, _ = busy()
    assert ColourModel.fit(image, [Stroke(points=[(100, 100)])]).by_colour_alone


def test_each_stroke_is_found_by_the_others():
    image, true = busy()
    image[true] = (40, 30, 200)
    expected = cross_validate(image, STROKES)
    assert expected.cable > 0.9
    assert expected.ground < 0.05
    assert cross_validate(image, STROKES[:1]) is None
