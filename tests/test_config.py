"""The configuration: its checks, its way through YAML, and the parameters of the paper."""

from __future__ import annotations

import pickle
from fractions import Fraction

import msgspec
import numpy as np
import pytest
from builders import through_json

from dloftbs.config import (
    CleaningConfig,
    Config,
    FittingConfig,
    GreedyLinkingConfig,
    HsvRange,
    LiftingConfig,
    LinkingConfig,
    PixelLiftingConfig,
    SegmentationConfig,
    SegmentsConfig,
    TrackingConfig,
)
from dloftbs.errors import ConfigError

INF, NAN = float("inf"), float("nan")

SECTIONS = {
    "segmentation": SegmentationConfig,
    "cleaning": CleaningConfig,
    "segments": SegmentsConfig,
    "linking": LinkingConfig,
    "fitting": FittingConfig,
    "lifting": LiftingConfig,
    "tracking": TrackingConfig,
}

CHANGED = Config(
    segmentation=SegmentationConfig(hsv=(HsvRange(hue=(170, 10)), HsvRange(hue=(1, 2), value=(3, 4)))),
    cleaning=CleaningConfig(open_px=1, close_px=5),
    segments=SegmentsConfig(max_segments=7),
    linking=LinkingConfig(objects=3, max_gap_widths=0.123456789012345678),
    fitting=FittingConfig(knots=40),
    lifting=LiftingConfig(integer_unit_m=1e-4, min_depth_m=0.3, max_depth_m=1e6),
    tracking=TrackingConfig(gate=0.3, min_hits=1, keep_lost_s=0.0),
)

EACH = [Config(), Config.paper(), CHANGED]

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
    (LiftingConfig, "integer_unit_m", [1e-9, 1]),
    (LiftingConfig, "min_depth_m", [0, 19.9]),
    (LiftingConfig, "max_depth_m", [0.001, 1e9]),
    (PixelLiftingConfig, "max_depth_m", [0.001, 1e9]),
    (TrackingConfig, "gate", [1e-9, 5]),
    (TrackingConfig, "min_hits", [1]),
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
    (LiftingConfig, "integer_unit_m", [0, -1.0, INF, NAN, True, 1e-300, 1e300]),
    (LiftingConfig, "min_depth_m", [-0.1, 20.0, 21.0, NAN, True]),
    (LiftingConfig, "max_depth_m", [0.0, -1.0, NAN, "1"]),
    (PixelLiftingConfig, "max_depth_m", [0.0, -1.0, NAN, "1"]),
    (TrackingConfig, "gate", [0, -1.0, NAN, "x", True]),
    (TrackingConfig, "min_hits", [0, 2.0, True]),
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
@pytest.mark.parametrize(("section", "name"), NUMBERS, ids=lambda part: getattr(part, "__name__", part))
def test_no_number_is_without_bounds(section, name, value):
    with pytest.raises(ConfigError, match=f"{name}.* must be .*, got ") as caught:
        section(**{name: value})
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("value", [10**400, 1e300, INF, True], ids=["400 digits", "1e300", "inf", "bool"])
@pytest.mark.parametrize(("section", "name"), NUMBERS, ids=lambda part: getattr(part, "__name__", part))
def test_nor_is_one_in_a_dictionary(section, name, value):
    place = next(place for place, default in SECTIONS.items() if section.__name__.endswith(default.__name__))
    method = {"method": section.__struct_config__.tag} if section.__struct_config__.tag else {}
    with pytest.raises(ConfigError, match=name):
        Config.from_dict({place: {**method, name: value}})


@pytest.mark.parametrize(("section", "name"), NUMBERS, ids=lambda part: getattr(part, "__name__", part))
def test_numbers_of_numpy_are_kept_as_plain_ones(section, name):
    default = dict(zip(section.__struct_fields__, section.__struct_defaults__, strict=True))[name]
    given = np.float32(0.5) if isinstance(default, float) else np.int16(9)
    made = section(**{name: given})
    assert type(getattr(made, name)) is (float if isinstance(default, float) else int)
    assert getattr(made, name) == given
    through_json(msgspec.to_builtins(made))


@pytest.mark.parametrize("changes", [None, 5, [("fitting.knots", 5)], {1: 2}])
def test_changes_that_are_no_dictionary_are_refused(changes):
    with pytest.raises(ConfigError, match="changes must be a dictionary of values by dotted paths, got"):
        Config().replace(changes)


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
        (" 0:179 , 0:255 , 0:255 ", HsvRange(hue=(0, 179))),
    ],
)
def test_an_hsv_range_is_read_from_text(text, expected):
    assert HsvRange.parse(text) == expected


@pytest.mark.parametrize(
    "text", [5, None, "", "20", "20:", ":", "20:40:60", "20:40,", "a:b", "1.5:2", "1:2,3:4,5:6,7:8", "1-2", "1:2;3:4"]
)
def test_text_of_another_form_is_refused_with_an_example(text):
    with pytest.raises(ConfigError, match="such as '170:10,80:255,60:255', got") as caught:
        HsvRange.parse(text)
    assert repr(text) in str(caught.value)


@pytest.mark.parametrize("text", ["0:180", "0:10,9:3", "0:10,0:255,0:256"])
def test_text_out_of_range_is_refused(text):
    with pytest.raises(ConfigError, match="must be"):
        HsvRange.parse(text)


def test_the_paper_s_parameters():
    paper = Config.paper()
    assert isinstance(paper.linking, GreedyLinkingConfig)
    assert paper.linking.distance_weight == 0.05  # m
    assert paper.linking.min_length_px == 10  # p
    assert paper.fitting.knots == 25  # k
    assert paper.cleaning == CleaningConfig(open_px=3, close_px=1, thin_px=0, fill_holes=False)
    assert isinstance(paper.lifting, PixelLiftingConfig)


@pytest.mark.parametrize("config", EACH, ids=["default", "paper", "changed"])
def test_nothing_is_lost_on_the_way_through_yaml(config, tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text(config.to_yaml())
    assert Config.from_yaml(path) == config
    assert Config.from_yaml(str(path)) == config
    assert Config.from_dict(config.to_dict()) == config


def test_yaml_states_every_value():
    text = Config().to_yaml()
    fields = [field for section in SECTIONS.values() for field in section.__struct_fields__]
    assert [name for name in (*SECTIONS, *fields) if f"{name}:" not in text] == []


def test_what_yaml_leaves_out_keeps_its_default(tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text("linking:\n  max_gap_widths: 5\n")
    assert Config.from_yaml(path) == Config(linking=LinkingConfig(max_gap_widths=5.0))
    path.write_text("linking:\n  method: greedy\n  max_cost: 5\n")
    assert Config.from_yaml(path) == Config(linking=GreedyLinkingConfig(max_cost=5.0))
    path.write_text("lifting:\n  max_depth_m: 5\n")
    assert Config.from_yaml(path) == Config(lifting=LiftingConfig(max_depth_m=5.0))
    path.write_text("lifting:\n  method: pixels\n  max_depth_m: 5\n")
    assert Config.from_yaml(path) == Config(lifting=PixelLiftingConfig(max_depth_m=5.0))
    path.write_text("")
    assert Config.from_yaml(path) == Config()


@pytest.mark.parametrize(
    ("data", "culprits"),
    [
        ({"linkng": {}}, ["linkng"]),
        ({"linking": {"max_gap": 1.0}}, ["max_gap", "$.linking"]),
        ({"linking": {"max_cost": 1.0}}, ["max_cost", "$.linking"]),
        ({"linking": {"method": "greedy", "max_gap_widths": 1.0}}, ["max_gap_widths", "$.linking"]),
        ({"linking": {"method": "guess"}}, ["guess", "$.linking.method"]),
        ({"lifting": {"method": "guess"}}, ["guess", "$.lifting.method"]),
        ({"linking": {"max_gap_widths": "high"}}, ["float", "str", "$.linking.max_gap_widths"]),
        ({"linking": {"max_gap_widths": -1.0}}, ["max_gap_widths", "-1.0", "$.linking"]),
        ({"fitting": {"knots": 2.5}}, ["int", "float", "$.fitting.knots"]),
        ({"fitting": None}, ["null", "$.fitting"]),
        ({"segmentation": {"hsv": [{"hue": [0, 1]}, {"hue": [0, 500]}]}}, ["hue", "500", "$.segmentation.hsv[1]"]),
        ({"segmentation": {"hsv": [{"hue": [0, 1], "chroma": 1}]}}, ["chroma", "$.segmentation.hsv[0]"]),
        ({1: 2}, ["str"]),
        ([], ["object", "array"]),
        (None, ["object", "null"]),
    ],
)
def test_wrong_data_is_refused_with_the_path_of_the_culprit(data, culprits):
    with pytest.raises(ConfigError) as caught:
        Config.from_dict(data)
    assert [culprit for culprit in culprits if culprit not in str(caught.value)] == []


@pytest.mark.parametrize(
    "content", [b"linking: [", b"- 1", b"linking:", b"\xff\xfe\x00\x00", b"a: !!python/object:os.x {}", b"nonsense"]
)
def test_a_wrong_file_is_refused_by_its_name(content, tmp_path):
    path = tmp_path / "broken.yaml"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=r"broken\.yaml"):
        Config.from_yaml(path)


def test_a_file_that_is_not_there_is_refused_by_its_name(tmp_path):
    with pytest.raises(ConfigError, match=r"cannot read the configuration .*absent\.yaml"):
        Config.from_yaml(tmp_path / "absent.yaml")
    with pytest.raises(ConfigError, match="cannot read the configuration"):
        Config.from_yaml(tmp_path)


def test_replace_follows_dotted_paths_and_leaves_the_original():
    original = Config()
    replaced = original.replace({"linking.objects": 5, "fitting.knots": 40, "tracking": {"min_hits": 4}})
    assert replaced == Config(
        linking=LinkingConfig(objects=5), fitting=FittingConfig(knots=40), tracking=TrackingConfig(min_hits=4)
    )
    assert original == Config()


def test_replace_changes_the_method_of_a_section():
    assert Config().replace({"lifting.method": "pixels"}).lifting == PixelLiftingConfig()
    assert Config.paper().replace({"lifting.method": "axis", "lifting.max_depth_m": 3.0}).lifting == LiftingConfig(
        max_depth_m=3.0
    )
    assert Config.paper().replace({"lifting.max_depth_m": 3.0}).lifting == PixelLiftingConfig(max_depth_m=3.0)


def test_replace_takes_ranges_as_values_and_as_plain_data():
    boxes = (HsvRange(hue=(20, 40)),)
    expected = Config(segmentation=SegmentationConfig(hsv=boxes))
    assert Config().replace({"segmentation.hsv": boxes}) == expected
    assert Config().replace({"segmentation.hsv": [{"hue": [20, 40]}]}) == expected


@pytest.mark.parametrize(
    "path", ["", "linking.", ".objects", "objects", "linking.max_cost", "linking.objects.x", "segmentation.hsv.0"]
)
def test_replace_refuses_an_unknown_path(path):
    with pytest.raises(ConfigError, match="unknown configuration key") as caught:
        Config().replace({path: 1})
    assert repr(path) in str(caught.value)


def test_replace_checks_as_a_whole():
    with pytest.raises(ConfigError, match=r"min_depth_m, max_depth_m .*lifting"):
        Config().replace({"lifting.min_depth_m": 30.0})
    far = Config().replace({"lifting.min_depth_m": 30.0, "lifting.max_depth_m": 40.0})
    assert far.lifting == LiftingConfig(min_depth_m=30.0, max_depth_m=40.0)


@pytest.mark.parametrize("name", SECTIONS)
def test_a_section_must_be_of_its_own_kind(name):
    for wrong in (None, {}, HsvRange(hue=(0, 1))):
        with pytest.raises(ConfigError, match=f"{name} must be a {SECTIONS[name].__name__}.*, got"):
            Config(**{name: wrong})


def test_an_unknown_argument_is_refused():
    with pytest.raises(TypeError, match="max_cost"):
        LinkingConfig(max_cost=1.0)
    with pytest.raises(TypeError, match="positional"):
        LinkingConfig(2)  # by name only


@pytest.mark.parametrize("config", EACH, ids=["default", "paper", "changed"])
def test_a_configuration_cannot_be_changed(config):
    with pytest.raises(AttributeError, match="immutable"):
        config.fitting = FittingConfig()
    for name in SECTIONS:
        section = getattr(config, name)
        for field in section.__struct_fields__:
            value = getattr(section, field)
            with pytest.raises(AttributeError, match="immutable"):
                setattr(section, field, value)


def test_configurations_are_compared_by_value_and_can_be_keys():
    same = Config.from_dict(CHANGED.to_dict())
    assert same is not CHANGED
    assert {CHANGED: "a", Config(): "b"}[same] == "a"
    assert Config() != CHANGED
    assert pickle.loads(pickle.dumps(CHANGED)) == CHANGED


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("linking: &a [*a]", "aliases are not supported"),
        ("a: " + "[" * 20_000, "must be nested at most"),
        ("linking: {objects: " + "1" * 400 + "}", "at most 100 digits"),
        ("linking: {max_gap_widths: !!float abc}", "'abc' is no float"),
        ("linking: {max_gap_widths: 2001-99-99}", "'2001-99-99' is no timestamp"),
        ("{}\n---\n{}", "must hold one configuration, found 2 documents"),
    ],
)
def test_a_file_that_asks_for_too_much_is_refused(tmp_path, text, message):
    (tmp_path / "a.yaml").write_text(text)
    with pytest.raises(ConfigError, match=message):
        Config.from_yaml(tmp_path / "a.yaml")
