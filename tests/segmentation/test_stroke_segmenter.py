"""Strokes in a stream: near the tracks, elsewhere now and then, and in light that drifts."""

import logging

import numpy as np
import pytest
from busy_pictures import STROKES, busy, iou

from dloftbs.config import ColourConfig, Config, SegmentationConfig
from dloftbs.data.prompt import Prompt
from dloftbs.pipeline import Pipeline
from dloftbs.segmentation import ColourModel, Stroke
from dloftbs.segmentation.stroke_segmenter import StrokeSegmenter

pytestmark = pytest.mark.large  # a classifier of pixels is learned in each


def prompt_on(mask, row=100.0):
    x = np.linspace(20.0, 280.0, 8)
    points, beside = np.stack([x, np.full(8, row)], 1), np.stack([x, np.full(8, row - 25.0)], 1)
    return Prompt(points, np.zeros(8, int), beside, np.array([[10.0, row - 6, 290.0, row + 6]]), mask)


def test_near_tracks_the_mask_is_that_of_the_whole_image_and_elsewhere_it_is_so_every_fifth_frame():
    image, true = busy()
    model = ColourModel.fit(image, STROKES)
    image[20:31, 10:290] = image[95:106, 10:290]  # another cable, far from the first
    whole = model(image)
    assert whole[20:31].any()
    segmenter = StrokeSegmenter(model, follows_light=False)
    np.testing.assert_array_equal(segmenter(image, Prompt()), whole)
    masks = [segmenter(image, prompt_on(true)) for _ in range(10)]
    assert [bool(mask[:40].any()) for mask in masks] == [False] * 4 + [True] + [False] * 4 + [True]
    assert np.mean(masks[0][80:120] == whole[80:120]) > 0.999
    segmenter.reset()
    assert not segmenter(image, prompt_on(true))[:40].any()


def test_frames_by_themselves_do_not_keep_a_stream_from_looking_at_the_whole_image():
    image, mask = busy()
    stream = StrokeSegmenter(ColourModel.fit(image, STROKES))
    for _ in range(7):
        stream(image, prompt_on(mask))
        stream.alone()(image, Prompt())
    assert stream._since == 7
    before = stream.light.copy()
    stream.alone()((0.8 * image).astype(np.uint8), prompt_on(mask))
    assert (stream.light == before).all()


def grey(factor):
    """Return a light grey cable on darker grey, in some light."""
    rng = np.random.default_rng(5)
    image = np.array([105.0, 110.0, 115.0]) + rng.normal(0, 4, (200, 300, 3))
    image[95:106, 10:290] = 165 + rng.normal(0, 3, (11, 280, 1))
    true = np.zeros((200, 300), bool)
    true[95:106, 10:290] = True
    return np.clip(image * factor, 0, 255).round().astype(np.uint8), true


@pytest.mark.parametrize("end", [0.6, 1.45])
def test_light_that_drifts_slowly_is_followed_and_stated(end):
    image, true = grey(1.0)
    segmenter = StrokeSegmenter(ColourModel.fit(image, STROKES))
    for factor in np.geomspace(1.0, end, 60):
        mask = segmenter(grey(factor)[0], prompt_on(true))
    assert iou(mask, true) > 0.85
    assert segmenter.light.mean() == pytest.approx(end, rel=0.1)
    segmenter.reset()
    assert segmenter.light.tolist() == [1.0, 1.0, 1.0]


def test_steady_light_changes_nothing():
    image, true = grey(1.0)
    segmenter = StrokeSegmenter(ColourModel.fit(image, STROKES))
    for _ in range(20):
        segmenter(image, prompt_on(true))
    assert segmenter.light.tolist() == [1.0, 1.0, 1.0]


@pytest.mark.parametrize("level", [105.0, 120.0])
def test_still_light_is_not_given_up_for_another_that_tells_grey_from_grey_a_little_better(level):
    rng = np.random.default_rng(0)
    image = np.linspace(105.0, 180.0, 300)[None, :, None] * np.ones((200, 1, 3))
    image[95:106, 10:290] = level * (1.3 - 0.11 * np.abs(np.arange(-5.0, 6.0)))[:, None, None]  # round, so darker aside
    image = np.clip(image + rng.normal(0, 4, image.shape), 0, 255).round().astype(np.uint8)
    true = np.zeros((200, 300), bool)
    true[95:106, 10:290] = True
    segmenter = StrokeSegmenter(ColourModel.fit(image, [Stroke(points=[(40, 100), (240, 100)])]))
    for _ in range(30):
        segmenter(image, prompt_on(true))
    assert segmenter.light.tolist() == [1.0, 1.0, 1.0]


def test_without_tracks_the_light_goes_back_to_that_of_the_strokes_and_cables_are_found_again():
    image, true = grey(1.0)
    segmenter = StrokeSegmenter(ColourModel.fit(image, STROKES))
    for factor in np.geomspace(1.0, 0.6, 60):
        segmenter(grey(factor)[0], prompt_on(true))
    assert iou(segmenter(image, Prompt()), true) < 0.5  # the light is back at once
    for _ in range(25):
        mask = segmenter(image, Prompt())
    assert segmenter.light.tolist() == [1.0, 1.0, 1.0]
    assert iou(mask, true) > 0.85


def test_light_is_followed_within_bounds_and_their_end_is_said_once(caplog):
    image, true = grey(1.0)
    segmenter = StrokeSegmenter(ColourModel.fit(image, STROKES))
    with caplog.at_level(logging.WARNING, "dloftbs"):
        for factor in np.geomspace(1.0, 0.45, 90):
            segmenter(grey(factor)[0], prompt_on(true))
    assert 0.5 < segmenter.light.mean() < 0.6
    assert [record.message.startswith("the light has drifted") for record in caplog.records] == [True]


def test_light_is_not_followed_where_that_is_switched_off():
    image, _ = grey(1.0)
    pictures = ColourModel.fit(image, [Stroke(points=[(40, 100), (240, 100)])]).to_config().pictures
    found = {}
    for follows in (True, False):
        colour = ColourConfig(pictures=pictures, follow_light=follows)
        pipeline = Pipeline(Config(segmentation=SegmentationConfig(colour=colour)))
        results = [pipeline.process(grey(factor)[0]) for factor in np.geomspace(1.0, 0.6, 50)]
        found[follows] = np.mean([len(result) for result in results[-5:]])
    assert found == {True: 1.0, False: 0.0}
