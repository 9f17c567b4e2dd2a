"""Pixels that are darker, or brighter, than what surrounds them."""

import cv2
import numpy as np
import pytest
from uneven_pictures import SIZE, iou, line, lit, picture

from dloftbs.config import LocalConfig
from dloftbs.errors import InputError
from dloftbs.segmentation import LocalSegmenter


def found(image, tone="darker", **settings):
    return LocalSegmenter(LocalConfig(tone=tone, **settings))(image)


@pytest.mark.parametrize("width_px", [None, 6.0])
@pytest.mark.parametrize(
    ("ground", "change", "width"),
    [(80, -12, 6), (130, -110, 8), (200, -90, 3), (80, -14, 4)],
    ids=["dim worm", "black cable", "wire", "thin worm"],
)
def test_lines_under_a_lamp_are_found_as_wide_as_they_are(ground, change, width, width_px):
    truth = line(width)
    mask = found(picture(truth, ground, change, light=lit()), width_px=width_px)
    assert mask.dtype == np.uint8
    assert set(np.unique(mask)) == {0, 1}
    assert iou(mask, truth) > 0.85


def test_brighter_is_darker_in_the_negative():
    image = picture(line(6), 80, -12, light=lit())
    assert np.array_equal(found(255 - image, "brighter"), found(image))
    assert iou(found(255 - image), line(6)) < 0.02


@pytest.mark.parametrize("quality", [None, 60])
@pytest.mark.parametrize("noise", [0.0, 1.0, 3.0, 8.0])
@pytest.mark.parametrize("at", [(0.3, 0.3), (1.0, 0.5)])
def test_light_and_noise_alone_are_no_lines(noise, quality, at):
    image = picture(np.zeros(SIZE), 80, 0, light=lit(at=at), noise=noise)
    if quality is not None:
        image = cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_COLOR)
    for tone in ("darker", "brighter"):
        assert found(image, tone).sum() == 0


def test_the_edge_of_what_is_wider_than_the_window_is_no_line():
    image = np.full((*SIZE, 3), 60, np.uint8)
    image[:, 160:] = 200  # a screen
    image[100:104] = 20  # a wire before it
    truth = np.zeros(SIZE, np.uint8)
    truth[100:104] = 1
    assert iou(found(image), truth) > 0.95
    assert found(image, "brighter").sum() == 0


def test_a_line_along_the_border_is_found_where_the_ground_slopes():
    truth = np.zeros(SIZE, np.uint8)
    truth[:5] = 1
    slope = np.linspace(0.4, 1.6, SIZE[0])[:, None] * np.ones(SIZE)
    assert iou(found(picture(truth, 100, -60, light=slope)), truth) > 0.7
    assert found(picture(np.zeros(SIZE), 100, 0, light=slope)).sum() == 0


def test_a_cable_wider_than_a_window_needs_its_width():
    truth = line(30)
    image = picture(truth, 160, -80)
    assert iou(found(image), truth) < 0.7
    assert iou(found(image, width_px=30), truth) > 0.95


def test_a_contrast_of_the_user_takes_the_place_of_the_noise():
    strong, weak = line(5), line(5, phase=np.pi)
    image = np.minimum(picture(strong, 150, -80), picture(weak, 150, -20))
    apart = strong.astype(bool) & ~cv2.dilate(weak, np.ones((15, 15))).astype(bool)
    both, one = found(image), found(image, contrast=40)
    assert iou(both, strong | weak) > 0.85
    assert one[apart].mean() > 0.85
    assert one[(weak > 0) & (cv2.dilate(strong, np.ones((15, 15))) == 0)].sum() == 0


@pytest.mark.parametrize("size", [(1, 1), (1, 90), (7, 3), (40, 5), (0, 5), (5, 0)])
def test_any_size_is_taken(size):
    assert found(np.zeros((*size, 3), np.uint8)).shape == size


def test_an_image_stays_as_it_is_and_gives_the_same_mask_again():
    image = picture(line(6), 80, -12)
    image.flags.writeable = False
    segmenter = LocalSegmenter(LocalConfig(tone="darker"))
    first = segmenter(image)
    segmenter(255 - image)
    assert np.array_equal(segmenter(image), first)


def test_what_is_no_image_is_refused():
    with pytest.raises(InputError, match="image must have shape"):
        found(np.zeros((5, 5), np.uint16))
