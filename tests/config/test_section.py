"""Sections of the configuration: the range of each value, and what is no value."""

from __future__ import annotations

from fractions import Fraction

import msgspec
import numpy as np
import pytest
from builders import through_json

from dloftbs.config import (
    CleaningConfig,
    ColourConfig,
    ColourPicture,
    Config,
    FittingConfig,
    GreedyLinkingConfig,
    HsvRange,
    LiftingConfig,
    LinkingConfig,
    NetworkConfig,
    PixelLiftingConfig,
    SegmentationConfig,
    SegmentsConfig,
    TrackingConfig,
)
from dloftbs.errors import ConfigError

INF, NAN = float("inf"), float("nan")

SECTIONS = {name: type(getattr(Config(), name)) for name in Config.__struct_fields__}

GOOD = [
    (CleaningConfig, "open_px", [1, 3, 99]),
    (CleaningConfig, "close_px", [1, 3, 99]),
    (CleaningConfig, "thin_px", [0, 1, 500, 1_000_000_000]),
    (CleaningConfig, "fill_holes", [True, False]),
    (SegmentsConfig, "max_segments", [1]),
    (LinkingConfig, "objects", [None, 1, 50]),
    (LinkingConfig, "max_gap_widths", [0, 0.5, 1e9]),
    (GreedyLinkingConfig, "min_length_px", [2, 10_000]),
    (GreedyLinkingConfig, "distance_weight", [0, 0.0, 1.0]),
    (GreedyLinkingConfig, "max_cost", [0.0, 3, 1e9]),
    (GreedyLinkingConfig, "direction_px", [2]),
    (FittingConfig, "knots", [None, 2, 1000]),
    (FittingConfig, "tolerance_px", [1e-9, 1]),
    (LiftingConfig, "min_depth_m", [0, 19.9]),
    (LiftingConfig, "max_depth_m", [0.001, 1e9]),
    (PixelLiftingConfig, "max_depth_m", [0.001, 1e9]),
    (TrackingConfig, "gate", [1e-9, 5]),
    (TrackingConfig, "keep_lost_s", [0, 0.0]),
]

BAD = [
    (CleaningConfig, "open_px", [0, -1, 2, 101, 3.0, "3", True, None]),
    (CleaningConfig, "close_px", [0, -1, 2, 101, 3.0, "3", True, None]),
    (CleaningConfig, "thin_px", [-1, 2.0, 1e30, "20", True, None]),
    (CleaningConfig, "fill_holes", [0, 1, "yes", None]),
    (SegmentsConfig, "max_segments", [0, 1.0, True]),
    (LinkingConfig, "objects", [0, -1, 1.0, "1", True]),
    (LinkingConfig, "max_gap_widths", [-1e-9, NAN, "8", True, None]),
    (GreedyLinkingConfig, "min_length_px", [1, 0, 10.0, "10", True]),
    (GreedyLinkingConfig, "distance_weight", [-0.01, 1.01, NAN, "0.5", True, None]),
    (GreedyLinkingConfig, "max_cost", [-1e-9, NAN, "8", True]),
    (GreedyLinkingConfig, "direction_px", [1, 10.0, True]),
    (FittingConfig, "knots", [1, 1001, 25.0, True]),
    (FittingConfig, "tolerance_px", [0, -0.1, INF, NAN, "1", True, None]),
    (LiftingConfig, "min_depth_m", [-0.1, 20.0, 21.0, NAN, True]),
    (LiftingConfig, "max_depth_m", [0.0, -1.0, NAN, "1"]),
    (PixelLiftingConfig, "max_depth_m", [0.0, -1.0, NAN, "1"]),
    (TrackingConfig, "gate", [0, -1.0, NAN, "x", True]),
    (TrackingConfig, "keep_lost_s", [-0.1, float("inf"), float("nan"), "1"]),
    (HsvRange, "hue", [(0, 180), (-1, 5), (5,), (1, 2, 3), [0, 10], (0, 10.0), (False, True), 5, None]),
    (SegmentationConfig, "hsv", [[], HsvRange(hue=(0, 1)), ((0, 1),), None]),
]

NUMBERS = [
    (section, name)
    for section in (*SECTIONS.values(), GreedyLinkingConfig, PixelLiftingConfig)
    for name, default in zip(section.__struct_fields__, section.__struct_defaults__, strict=True)
    if (isinstance(default, (int, float)) and not isinstance(default, bool)) or name in ("objects", "knots")
]
NO_NUMBERS = {
    "inf": INF,
    "nan": NAN,
    "1e300": 1e300,
    "1e30": 1e30,
    "-1": -1,
    "400 digits": 10**400,
    "5000 digits": 10**5000,
    "bool": np.True_,
    "time": np.timedelta64(3, "s"),
    "count of time": np.timedelta64(3),
    "text": np.str_("3"),
    "complex": 3j,
    "array": np.array([3]),
    "fraction": Fraction(10**400),
}


def each_value(rows):
    return [pytest.param(cls, name, v, id=f"{cls.__name__}.{name}={v!r}") for cls, name, values in rows for v in values]


@pytest.mark.parametrize(("section", "name", "value"), each_value(GOOD))
def test_a_value_within_the_range_is_taken(section, name, value):
    assert getattr(section(**{name: value}), name) == value


@pytest.mark.parametrize(("section", "name", "value"), each_value(BAD))
def test_a_value_out_of_range_is_named_with_what_came(section, name, value):
    with pytest.raises(ConfigError) as caught:
        section(**{name: value})
    expected, _, got = str(caught.value).partition(", got ")
    assert name in expected.partition(" must be ")[0]
    assert repr(value) in got


@pytest.mark.parametrize("value", NO_NUMBERS.values(), ids=NO_NUMBERS)
def test_no_number_is_without_bounds(value):
    for section, name in NUMBERS:
        with pytest.raises(ConfigError, match=f"{name}.* must be .*, got ") as caught:
            section(**{name: value})
        assert len(str(caught.value)) < 500


@pytest.mark.parametrize("value", [10**400, 1e300, INF, True], ids=["400 digits", "1e300", "inf", "bool"])
def test_nor_is_one_in_a_dictionary(value):
    for section, name in NUMBERS:
        place = next(place for place, default in SECTIONS.items() if section.__name__.endswith(default.__name__))
        method = {"method": section.__struct_config__.tag} if section.__struct_config__.tag else {}
        with pytest.raises(ConfigError, match=name):
            Config.from_dict({place: {**method, name: value}})


def test_numbers_of_numpy_are_kept_as_plain_ones():
    for section, name in NUMBERS:
        default = dict(zip(section.__struct_fields__, section.__struct_defaults__, strict=True))[name]
        given = np.float32(0.5) if isinstance(default, float) else np.int16(9)
        made = section(**{name: given})
        assert type(getattr(made, name)) is (float if isinstance(default, float) else int), name
        assert getattr(made, name) == given
        through_json(msgspec.to_builtins(made))


@pytest.mark.parametrize("size", [[480, 640], (np.int64(480), np.int64(640))])
def test_sizes_of_any_integers_are_kept_as_plain_ones(size: object) -> None:
    picture = ColourPicture(size=size, cable=("1,1:2,2",), sample="")  # type: ignore[arg-type]  # as users have them
    network = NetworkConfig(file="model.onnx", size=size)  # type: ignore[arg-type]
    config = Config(segmentation=SegmentationConfig(colour=ColourConfig(pictures=(picture,)), onnx=network))
    assert Config.from_yaml(config.to_yaml()) == config
    assert len({network, NetworkConfig(file="model.onnx", size=(480, 640))}) == 1
