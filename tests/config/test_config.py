"""The configuration as a whole: its way through YAML, its changes, and the parameters of the paper."""

from __future__ import annotations

import pickle
import re
from pathlib import Path
from types import MappingProxyType

import pytest

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
    choose_config,
)
from dloftbs.errors import ConfigError

SECTIONS = {name: type(getattr(Config(), name)) for name in Config.__struct_fields__}

CHANGED = Config(
    segmentation=SegmentationConfig(hsv=(HsvRange(hue=(170, 10)), HsvRange(hue=(1, 2), value=(3, 4)))),
    cleaning=CleaningConfig(open_px=1, close_px=5),
    segments=SegmentsConfig(max_segments=7),
    linking=LinkingConfig(objects=3, max_gap_widths=0.123456789012345678),
    fitting=FittingConfig(knots=40),
    lifting=LiftingConfig(min_depth_m=0.3, max_depth_m=1e6),
    tracking=TrackingConfig(gate=0.3, keep_lost_s=0.0),
)

EACH = [Config(), Config.paper(), CHANGED]


@pytest.mark.parametrize("changes", [None, 5, [("fitting.knots", 5)], {1: 2}])
def test_changes_that_are_no_dictionary_are_refused(changes):
    with pytest.raises(ConfigError, match="changes must be a dictionary of values by dotted paths, got"):
        Config().replace(changes)


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
    assert Config.from_file(path) == config
    assert Config.from_file(str(path)) == config
    assert Config.from_dict(config.to_dict()) == config


def test_yaml_states_every_value():
    text = Config().to_yaml()
    fields = [field for section in SECTIONS.values() for field in section.__struct_fields__]
    assert [name for name in (*SECTIONS, *fields) if f"{name}:" not in text] == []


def test_what_yaml_leaves_out_keeps_its_default(tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text("linking:\n  max_gap_widths: 5\n")
    assert Config.from_file(path) == Config(linking=LinkingConfig(max_gap_widths=5.0))
    path.write_text("linking:\n  method: greedy\n  max_cost: 5\n")
    assert Config.from_file(path) == Config(linking=GreedyLinkingConfig(max_cost=5.0))
    path.write_text("lifting:\n  max_depth_m: 5\n")
    assert Config.from_file(path) == Config(lifting=LiftingConfig(max_depth_m=5.0))
    path.write_text("lifting:\n  method: pixels\n  max_depth_m: 5\n")
    assert Config.from_file(path) == Config(lifting=PixelLiftingConfig(max_depth_m=5.0))
    path.write_text("")
    assert Config.from_file(path) == Config()


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
        (
            {"segmentation": {"hsv": ["0:1", "rosso"]}},
            ["such as '170:10,80:255,60", "'rosso'", "$.segmentation.hsv[1]"],
        ),
        ({"segmentation": {"hsv": "0:500"}}, ["hue", "500", "$.segmentation.hsv[0]"]),
        ({"segmentation": {"hsv": 5}}, ["array", "int", "$.segmentation.hsv"]),
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
        Config.from_file(path)


def test_a_file_that_is_not_there_is_refused_by_its_name(tmp_path):
    with pytest.raises(ConfigError, match=r"absent\.yaml: cannot be read: No such file"):
        Config.from_file(tmp_path / "absent.yaml")
    with pytest.raises(ConfigError, match="cannot be read"):
        Config.from_file(tmp_path)
    with pytest.raises(ConfigError, match="must be the path of a YAML file, got 5"):
        Config.from_file(5)


def test_text_is_read_as_a_file_is():
    assert Config.from_yaml("fitting:\n  knots: 7\n") == Config(fitting=FittingConfig(knots=7))
    assert Config.from_yaml("") == Config()
    for wrong in ("linking: [", "{}\n---\n{}", None, b"fitting: {knots: 7}"):
        with pytest.raises(ConfigError):
            Config.from_yaml(wrong)
    with pytest.raises(ConfigError, match=r"a file is read by Config\.from_file"):
        Config.from_yaml(Path("my.yaml"))


def test_every_value_can_be_explained_and_read_back():
    for config in EACH:
        text = config.explain()
        assert Config.from_yaml(text) == config
        lines = text.splitlines()
        keys = [place for place, line in enumerate(lines) if re.match(r"  \w+:", line)]
        stated = sum(len(section) for section in config.to_dict().values())
        assert len(keys) == stated
        without = [lines[place] for place in keys if "# " not in lines[place - 1]]
        assert [line for line in without if not line.startswith("  method:")] == []


@pytest.mark.parametrize(
    ("data", "remedy"),
    [
        ({"linkng": {}}, "did you mean 'linking'?"),
        ({"knots": 4}, "did you mean 'fitting.knots'?"),
        ({"linking": {"max_gap": 1.0}}, "did you mean 'linking.max_gap_widths'?"),
        ({"linking": {"max_cost": 1.0}}, "it is a setting of linking.method=greedy"),
        ({"fitting": {"min_length": 3}}, "did you mean 'linking.min_length_px'?"),
    ],
)
def test_an_unknown_key_is_answered_with_the_one_that_was_meant(data, remedy):
    with pytest.raises(ConfigError) as caught:
        Config.from_dict(data)
    assert str(caught.value).endswith(remedy)


def test_replace_says_which_key_was_meant():
    with pytest.raises(ConfigError, match=r"unknown configuration key 'objects'; did you mean 'linking\.objects'\?"):
        Config().replace({"objects": 2})


def test_nothing_is_proposed_for_a_key_like_no_other():
    with pytest.raises(ConfigError, match=r"'zzz'$"):
        Config().replace({"zzz": 2})


def test_replace_follows_dotted_paths_and_leaves_the_original():
    original = Config()
    replaced = original.replace({"linking.objects": 5, "fitting.knots": 40, "tracking": {"gate": 0.4}})
    assert replaced == Config(
        linking=LinkingConfig(objects=5), fitting=FittingConfig(knots=40), tracking=TrackingConfig(gate=0.4)
    )
    assert original == Config()


def test_mappings_of_any_kind_are_read_as_dictionaries():
    plain = {"linking": {"objects": 2}, "segmentation": {"hsv": "red"}}
    nested = MappingProxyType({name: MappingProxyType(section) for name, section in plain.items()})
    assert Config.from_dict(nested) == choose_config(nested, None, None) == Config.from_dict(plain)


def test_another_method_keeps_the_settings_that_both_have():
    given = Config().replace({"linking.objects": 3, "linking.min_length_px": 1, "lifting.max_depth_m": 2.0})

    changed = given.replace({"linking.method": "greedy", "linking.min_length_px": 40, "lifting.method": "pixels"})

    assert changed.linking == GreedyLinkingConfig(objects=3, min_length_px=40)
    assert changed.lifting == PixelLiftingConfig(max_depth_m=2.0)


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
    assert Config().replace({"segmentation.hsv": "20:40"}) == expected
    assert Config().replace({"segmentation.hsv": ["20:40,40:255"]}) == expected
    assert expected.to_dict()["segmentation"]["hsv"] == ["20:40,40:255,40:255"]


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
        Config.from_file(tmp_path / "a.yaml")


def test_a_file_of_text_is_said_to_hold_no_settings():
    with pytest.raises(ConfigError, match=r"holds text in place of settings, 'notes of today'; .*dloftbs config print"):
        Config.from_yaml("notes of today")


@pytest.mark.parametrize("hsv", ["170:10", "[170:10, 40:55]"])
def test_a_colour_of_one_hue_needs_no_quotes(hsv):
    boxes = tuple(HsvRange.parse(text) for text in hsv.strip("[]").split(", "))
    assert Config.from_yaml(f"segmentation:\n  hsv: {hsv}").segmentation.hsv == boxes


def test_a_key_that_is_there_twice_is_refused():
    with pytest.raises(ConfigError, match=r"the key 'objects' must stand once .* again \(line 3\)"):
        Config.from_yaml("linking:\n  objects: 1\n  objects: 2\n")
