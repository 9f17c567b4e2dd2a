"""Ranges of hue, saturation and value."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.config import BackgroundConfig, Config, HsvRange, LocalConfig, SegmentationConfig, read_colour
from dloftbs.errors import ConfigError


@pytest.mark.parametrize("name", ["saturation", "value"])
@pytest.mark.parametrize("bounds", [(0, 256), (-1, 4), (20, 10)])
def test_only_hue_wraps_around(name, bounds):
    with pytest.raises(ConfigError, match=f"{name} must be .* low before high"):
        HsvRange(hue=(170, 10), **{name: bounds})


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("20:40", HsvRange(hue=(20, 40))),
        ("170:10,80:255", HsvRange(hue=(170, 10), saturation=(80, 255))),
        ("170:10,80:255,60:250", HsvRange(hue=(170, 10), saturation=(80, 255), value=(60, 250))),
        (" 0:179 , 0:255 , 0:255 ", HsvRange(hue=(0, 179), saturation=(0, 255), value=(0, 255))),
    ],
)
def test_an_hsv_range_is_read_from_text(text, expected):
    assert HsvRange.parse(text) == expected


@pytest.mark.parametrize(
    "text", [5, None, "", "20", "20:", ":", "20:40:60", "20:40,", "a:b", "1.5:2", "1:2,3:4,5:6,7:8", "1-2", "1:2;3:4"]
)
def test_text_of_another_form_is_refused_with_an_example(text):
    with pytest.raises(ConfigError, match=r"such as '170:10,80:255,60:255' or a colour .*, got") as caught:
        HsvRange.parse(text)
    assert repr(text) in str(caught.value)


@pytest.mark.parametrize("text", ["0:180", "0:10,9:3", "0:10,0:255,0:256"])
def test_text_out_of_range_is_refused(text):
    with pytest.raises(ConfigError, match="must be"):
        HsvRange.parse(text)


@given(st.tuples(st.integers(0, 179), st.integers(0, 179)), *[st.tuples(st.integers(0, 99), st.integers(99, 255))] * 2)
def test_the_notation_is_read_as_it_is_written(hue, saturation, value):
    colours = HsvRange(hue=hue, saturation=saturation, value=value)
    assert HsvRange.parse(str(colours)) == colours


def test_a_hue_alone_leaves_out_what_is_nearly_grey_or_black():
    assert str(HsvRange.parse("100:130")) == "100:130,40:255,40:255"


def test_a_colour_is_a_range_or_several():
    red, blue = HsvRange.parse("170:10"), HsvRange.parse("100:130")
    assert read_colour("170:10") == read_colour(red) == read_colour(["170:10"]) == (red,)
    assert read_colour(("170:10", blue)) == (red, blue)
    for wrong in (None, 5, [5], {"hue": (1, 2)}, b"170:10"):
        with pytest.raises(
            ConfigError,
            match="hsv must be a range such as '170:10,80:255,60:255', a colour such as 'red', or several, got",
        ):
            read_colour(wrong)


@pytest.mark.parametrize("text", ["350:10", "0:360"])
def test_a_hue_in_degrees_is_said_to_be_one(text: str) -> None:
    with pytest.raises(ConfigError, match=r"0\.\.179 \(half degrees: 180 of them are a circle\)"):
        HsvRange.parse(text)


@pytest.mark.parametrize(
    ("settings", "section"),
    [
        ({"local": "darker"}, SegmentationConfig(local=LocalConfig(tone="darker"))),
        (
            {"local": {"tone": "brighter", "width_px": 9, "contrast": 20, "join": "or"}},
            SegmentationConfig(local=LocalConfig(tone="brighter", width_px=9.0, contrast=20.0, join="or")),
        ),
        ({"background": "empty.png"}, SegmentationConfig(background=BackgroundConfig(file="empty.png"))),
        (
            {"background": {"file": "a b.npy", "join": "or"}, "local": "brighter"},
            SegmentationConfig(background=BackgroundConfig(file="a b.npy", join="or"), local="brighter"),
        ),
    ],
)
def test_a_word_or_a_file_stands_for_a_section_and_comes_back_from_yaml(settings, section):
    config = Config.from_dict({"segmentation": settings})
    assert config.segmentation == section
    assert Config.from_yaml(config.to_yaml()) == config
    assert Config.from_yaml(config.explain()) == config
    assert Config.from_dict(config.to_dict()) == config


@pytest.mark.parametrize(
    "changes",
    [
        {"segmentation.local": "darker", "segmentation.local.join": "or"},
        {"segmentation.local.join": "or", "segmentation.local.tone": "darker"},
        {"segmentation.local": {"tone": "darker"}, "segmentation.local.join": "or"},
    ],
)
def test_settings_within_a_section_are_set_one_by_one_in_any_order(changes):
    assert Config().replace(changes).segmentation.local == LocalConfig(tone="darker", join="or")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"local": "dark"}, "tone must be 'darker' or 'brighter', got 'dark'"),
        ({"local": 5}, "got `int` - at `.*local"),
        ({"local": {"width_px": 5}}, "missing required field `tone`"),
        ({"local": {"tone": "darker", "width_px": 0}}, "width_px must be .* in 1..1000, got 0"),
        ({"local": {"tone": "darker", "contrast": 300}}, "contrast must be .* in 1..255, got 300"),
        ({"local": {"tone": "darker", "join": "xor"}}, "join must be 'and' or 'or', got 'xor'"),
        ({"local": {"tone": "darker", "widht": 5}}, "unknown field `widht`"),
        ({"background": ""}, "file must be the path of a picture, in UTF-8, got ''"),
        ({"background": {"file": "a", "join": None}}, "join"),
        ({"background": {"file": "a", "contrast": "b"}}, "contrast"),
    ],
)
def test_wrong_settings_of_local_masks_are_refused(settings, message):
    with pytest.raises(ConfigError, match=message):
        Config.from_dict({"segmentation": settings})


@pytest.mark.parametrize("name", ["local", "background"])
def test_what_is_no_section_is_refused(name):
    with pytest.raises(ConfigError, match=f"{name} must be a .*Config or None, got 5"):
        SegmentationConfig(**{name: 5})
