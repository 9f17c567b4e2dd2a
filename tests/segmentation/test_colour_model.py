"""Colours learned from strokes: what is found, with whatever light and hand, and what is kept."""

import cv2
import numpy as np
import pytest
from busy_pictures import STROKES, busy

import dloftbs
from dloftbs.config import ColourConfig, Config, SegmentationConfig
from dloftbs.data.frame import Frame
from dloftbs.errors import ConfigError, InputError
from dloftbs.segmentation import ColourModel, Stroke, make_segmenter
from dloftbs.segmentation.pixel_samples import PixelSample

SIZE = 160, 240
ALONG = Stroke(points=[(30, 80), (120, 80)])


def photo(colour, ground=(90, 130, 150), gain=1.0, seed=0):
    """Return a noisy picture of a cable of 9 px on a ground, and where the cable is."""
    rng = np.random.default_rng(seed)
    true = np.zeros(SIZE, np.uint8)
    cv2.polylines(true, [np.array([(20, 80), (130, 80), (200, 30)])], False, 1, 9)
    image = np.where(true[..., None] > 0, np.array(colour, float), np.array(ground, float))
    shade = gain * np.linspace(0.9, 1.1, SIZE[1])[None, :, None]
    return np.clip(image * shade + rng.normal(0.0, 3.0, image.shape), 0, 255).round().astype(np.uint8), true > 0


def iou(mask, true):
    return np.sum((mask > 0) & true) / np.sum((mask > 0) | true)


COLOURS = {
    "red, whose hue wraps": (40, 30, 200),
    "magenta": (120, 20, 200),
    "green": (60, 160, 50),
    "black": (25, 25, 25),
    "white": (235, 235, 235),
    "grey": (60, 60, 60),
}


@pytest.mark.parametrize("colour", COLOURS.values(), ids=COLOURS)
def test_a_stroke_finds_the_cable_in_other_light_too(colour):
    image, true = photo(colour)
    model = ColourModel.fit(image, [ALONG])
    assert iou(model(image), true) > 0.97
    other, true = photo(colour, gain=0.92, seed=1)
    assert iou(model(other), true) > 0.95


def test_a_grey_cable_is_told_from_a_grey_ground_by_lightness():
    image, true = photo((70, 70, 70), ground=(150, 150, 150))
    assert iou(ColourModel.fit(image, [ALONG])(image), true) > 0.97


def test_a_stroke_may_lie_beside_the_cable_in_part():
    image, true = photo((40, 30, 200))
    astray = Stroke(points=[(30, 80), (90, 80), (90, 100)], radius_px=3.0)
    assert iou(ColourModel.fit(image, [astray])(image), true) > 0.97


def test_a_stroke_says_what_is_no_cable():
    image, true = photo((40, 30, 200))
    other = image.copy()
    other[120:150, 20:220] = (70, 50, 205)  # a box of nearly the same red
    model = ColourModel.fit(image, [ALONG])
    assert model(other)[120:150, 20:220].all()
    on_box = Stroke(points=[(30, 135), (200, 135)], cable=False, radius_px=6.0)
    refused = ColourModel.fit_many([(image, [ALONG], ""), (other, [on_box], "")])
    assert iou(refused(other), true) > 0.95


@pytest.mark.large
@pytest.mark.parametrize("order", [1, -1])
def test_a_stroke_on_a_picture_without_cables_says_what_is_none_where_pixels_are_classified(order):
    image, _ = busy()
    other = busy(seed=3, shift=np.array([0, 40]))[0]  # something as grey, elsewhere
    on_it = Stroke(points=[(40, 140), (240, 140)], cable=False)
    pictures = [(image, STROKES, "cable"), (other, [on_it], "none")][::order]
    plain, refused = ColourModel.fit(image, STROKES), ColourModel.fit_many(pictures)
    assert not refused.by_colour_alone
    assert refused.classifier.width_px == pytest.approx(plain.classifier.width_px)
    assert [picture.source for picture in refused.to_config().pictures] == ["cable", "none"][::order]
    found = [model(other)[136:145, 30:270].mean() for model in (plain, refused)]
    assert found[1] < 0.5 * found[0]


def test_a_picture_without_cables_needs_another_to_show_their_width():
    image, _ = photo((40, 30, 200))
    on_ground = Stroke(points=[(30, 135), (200, 135)], cable=False)
    both = ColourModel.pictures_of([(image, [ALONG], ""), (image, [on_ground], "")])
    (alone,) = ColourModel.pictures_of([(image, [on_ground], "")])
    assert alone.pixels == ""
    assert ColourModel.pictures_of([(image, [on_ground], "")], others=both[:1]) == both[1:]
    assert not PixelSample.from_text(both[1].pixels).shows_cables


def test_several_pictures_add_up():
    one, first = photo((40, 30, 200))
    two, second = photo((60, 160, 50), seed=1)
    model = ColourModel.fit_many([(one, [ALONG], "one"), (two, [ALONG], "two")])
    assert iou(model(one), first) > 0.95
    assert iou(model(two), second) > 0.95
    assert [picture.source for picture in model.to_config().pictures] == ["one", "two"]


def test_the_model_comes_back_from_the_configuration_without_the_picture():
    image, _ = photo((40, 30, 200))
    model = ColourModel.fit(image, [ALONG, Stroke(points=[(10, 10)], cable=False)], source="photo.jpg")
    config = Config(segmentation=SegmentationConfig(colour=model.to_config()))
    again = Config.from_yaml(config.to_yaml())
    assert again == config
    assert len(config.to_yaml()) < 200_000
    (picture,) = again.segmentation.colour.pictures
    assert (picture.source, picture.size, picture.strokes[0]) == ("photo.jpg", SIZE, ALONG)
    segmenter = make_segmenter(again.segmentation)
    np.testing.assert_array_equal(segmenter(Frame(image=image)), model(image))


def test_the_same_strokes_give_the_same_model():
    image, _ = photo((40, 30, 200))
    one, other = (ColourModel.fit(image, [ALONG]) for _ in range(2))
    assert one.to_config() == other.to_config()
    np.testing.assert_array_equal(one(image), other(image))


def test_it_is_a_segmenter_for_all_that_take_one():
    image, _ = photo((40, 30, 200))
    model = dloftbs.ColourModel.fit(image, [dloftbs.Stroke(points=[(30, 80), (120, 80)])])
    assert len(dloftbs.detect(image, segmenter=model)) == 1
    assert [len(result.tracks) for result in dloftbs.track([image, image], segmenter=model)] == [1, 1]
    with pytest.raises(InputError, match="x is a mask already"):
        dloftbs.detect(model(image) != 0, segmenter=model)


def test_a_stroke_that_leaves_the_picture_is_refused():
    image, _ = photo((40, 30, 200))
    with pytest.raises(InputError, match=r"must lie in the picture of 240 x 160 px, got the point 240,10"):
        ColourModel.fit(image, [Stroke(points=[(20, 10), (240, 10)])])


def test_a_stroke_that_is_taken_back_beneath_a_wider_one_leaves_its_colours():
    image, _ = photo((40, 30, 200))
    model = ColourModel.fit(image, [ALONG, Stroke(points=ALONG.points, cable=False, radius_px=30.0)])
    assert model.by_colour_alone
    assert ColourModel(model.to_config()).by_colour_alone


def test_of_very_many_pictures_each_has_samples():
    image, _ = photo((40, 30, 200))
    sample = PixelSample.of(image, [ALONG], share=1 / 900)
    assert min(part.shape[1] for part in (sample.kinds[0], sample.kinds[-1])) > 0
    assert PixelSample.from_text(sample.to_text()).width_px == sample.width_px


def test_without_a_stroke_on_a_cable_there_is_no_colour():
    image, _ = photo((40, 30, 200))
    with pytest.raises(ConfigError, match="a stroke on a cable at least"):
        ColourModel.fit(image, [Stroke(points=[(20, 10)], cable=False)])


@pytest.mark.parametrize("sample", ["", "x", "AAAA", "eJwDAAAAAAE="])
def test_a_broken_sample_is_refused(sample):
    image, _ = photo((40, 30, 200))
    data = Config(segmentation=SegmentationConfig(colour=ColourModel.fit(image, [ALONG]).to_config())).to_dict()
    data["segmentation"]["colour"]["pictures"][0]["sample"] = sample
    config = Config.from_dict(data)
    with pytest.raises(ConfigError, match="cannot read the sample of colours"):
        dloftbs.Pipeline(config)


def test_a_picture_that_is_drawn_on_all_over_has_no_rest():
    image = np.full((8, 8, 3), (40, 30, 200), np.uint8)
    model = ColourModel.fit(image, [Stroke(points=[(4, 4)], radius_px=50)])
    assert model(image).all()
    assert isinstance(model.to_config(), ColourConfig)
