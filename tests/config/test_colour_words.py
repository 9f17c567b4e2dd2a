"""Words for colours: found on drawn cables, taken wherever a colour is, and a suggestion for a word that is none."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from drawings import draw_cable, wave

import dloftbs
from dloftbs.config import Config, HsvRange, read_colour
from dloftbs.config.colour_words import COLOUR_WORDS
from dloftbs.errors import ConfigError

SIZE = (120, 200)
SHADES = {  # CSS colours, (R, G, B)
    "red": [(255, 0, 0), (178, 34, 34), (220, 20, 60)],
    "orange": [(255, 165, 0), (255, 140, 0), (255, 103, 0), (255, 69, 0)],
    "yellow": [(255, 255, 0), (255, 215, 0)],
    "green": [(0, 128, 0), (50, 205, 50), (46, 139, 87)],
    "cyan": [(0, 255, 255), (64, 224, 208), (0, 139, 139)],
    "blue": [(0, 0, 255), (30, 144, 255), (65, 105, 225), (0, 0, 128)],
    "purple": [(128, 0, 128), (138, 43, 226), (75, 0, 130)],
    "magenta": [(255, 0, 255), (199, 21, 133)],
    "pink": [(255, 105, 180), (219, 112, 147), (255, 182, 193)],
    "white": [(255, 255, 255), (245, 245, 245)],
    "grey": [(128, 128, 128), (105, 105, 105)],
    "black": [(0, 0, 0), (30, 30, 30)],
}
FAR_APART = ("red", "yellow", "green", "blue", "magenta")


def drawn(rgb, ground):
    """Return an image (H, W, 3) of a cable, its light falling to seven tenths from left to right, and noise."""
    image = np.full((*SIZE, 3), ground, np.float64)
    image[draw_cable(wave(SIZE, 1.0, 0.1), 9, SIZE) > 0] = rgb[::-1]
    coloured = max(rgb) - min(rgb) > 40
    image *= np.linspace(1.0, 0.7 if coloured else 0.9, SIZE[1])[None, :, None]
    noise = np.random.default_rng(0).normal(0.0, 2.0, image.shape)
    return np.clip(np.rint(image + noise), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(("word", "rgb"), [(word, rgb) for word, shades in SHADES.items() for rgb in shades])
def test_a_cable_is_found_by_the_word_for_its_colour(word, rgb):
    ground = (60, 70, 150) if word in ("white", "grey", "black") else (150, 150, 150)
    image = drawn(rgb, ground)
    (found,) = dloftbs.detect(image, hsv=word)
    assert found.curve.length > 0.9 * SIZE[1]


@pytest.mark.parametrize("word", FAR_APART)
@pytest.mark.parametrize("other", FAR_APART)
def test_words_far_apart_find_none_of_each_others_cables(word, other):
    image = drawn(SHADES[word][0], (150, 150, 150))
    assert len(dloftbs.detect(image, hsv=other)) == (word == other)


def test_all_words_are_tried():
    assert set(SHADES) == set(COLOUR_WORDS)


@pytest.mark.parametrize("text", ["orange", "Orange", " ORANGE "])
def test_a_word_is_taken_wherever_a_colour_is(text):
    orange = HsvRange(hue=(5, 22))
    assert HsvRange.parse(text) == orange
    assert read_colour([text, "170:10"])[0] == orange
    assert Config.from_yaml(f"segmentation: {{hsv: '{text}'}}").segmentation.hsv == (orange,)
    assert Config.from_yaml(f"segmentation: {{hsv: ['{text}', blue]}}").segmentation.hsv[1] == HsvRange.parse("blue")
    assert Config().replace({"segmentation.hsv": text}).segmentation.hsv == (orange,)
    assert dloftbs.Pipeline(hsv=text).config.segmentation.hsv == (orange,)


@pytest.mark.parametrize(("text", "word"), [("gray", "grey"), ("violet", "purple"), ("turquoise", "cyan")])
def test_other_spellings_are_the_same(text, word):
    assert HsvRange.parse(text) == HsvRange.parse(word)


@pytest.mark.parametrize(
    ("text", "meant"),
    [("orang", "orange"), ("bleu", "blue"), ("dark blue", "blue"), ("red,blue", "red"), ("purpel", "purple")],
)
def test_an_unknown_word_brings_the_nearest_and_the_list(text, meant):
    with pytest.raises(ConfigError, match=f"; did you mean '{meant}'") as caught:
        HsvRange.parse(text)
    assert all(word in str(caught.value) for word in COLOUR_WORDS)


@pytest.mark.parametrize("text", ["#ff8800", "brown", "5-20"])
def test_a_colour_that_has_no_word_brings_the_list(text):
    with pytest.raises(ConfigError, match=r"or a colour \(red, orange, .*, black\), got") as caught:
        HsvRange.parse(text)
    assert "did you mean" not in str(caught.value)


def test_the_page_on_segmentation_lists_the_same_ranges():
    page = (Path(__file__).parents[2] / "docs" / "segmentation.md").read_text("utf-8")
    assert dict(re.findall(r"^\| (\w+)[^|`]* \| `([\d:,]+)` \|$", page, re.MULTILINE)) == COLOUR_WORDS
