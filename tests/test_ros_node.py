"""The package of the ROS 2 node as far as no ROS is needed: its version, launch file, parameters and their tables."""

from __future__ import annotations

import ast
import re
import runpy
import sys
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml

from dloftbs._version import __version__
from dloftbs.errors import ConfigError

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "ros2" / "dloftbs_ros"
README = (PACKAGE / "README.md").read_text(encoding="utf-8")
PAGE = (ROOT / "docs" / "ros.md").read_text(encoding="utf-8")
REALSENSE = {
    "image": "/camera/camera/color/image_raw",
    "depth": "/camera/camera/aligned_depth_to_color/image_raw",
    "camera_info": "/camera/camera/color/camera_info",
    "joint_states": "/joint_states",
}


@pytest.fixture
def parameters(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return the module of the node's parameters, which needs no ROS."""
    monkeypatch.syspath_prepend(str(PACKAGE))
    import dloftbs_ros.parameters

    return dloftbs_ros.parameters


def table_below(text: str, heading: str) -> dict[str, str]:
    """Return the first two cells of each row of the table whose head begins with a heading."""
    rows = text[text.index(f"| {heading} |") :].partition("\n\n")[0].splitlines()[2:]
    cells = [[cell.strip().strip("`") for cell in row.strip("|").split("|")] for row in rows]
    return {row[0]: row[1] for row in cells}


def test_the_version_is_that_of_the_package():
    setup = ast.parse((PACKAGE / "setup.py").read_text(encoding="utf-8"))
    (call,) = (node for node in ast.walk(setup) if isinstance(node, ast.Call) and node.func.id == "setup")
    (written,) = (ast.literal_eval(word.value) for word in call.keywords if word.arg == "version")
    assert ElementTree.parse(PACKAGE / "package.xml").getroot().findtext("version") == written == __version__


def test_what_the_node_imports_is_in_the_manifest():
    manifest = ElementTree.parse(PACKAGE / "package.xml").getroot()
    assert manifest.get("format") == "3"
    names = {element.text for element in manifest.iter("exec_depend")}
    ours = {"dloftbs", "dloftbs_ros", "numpy", "scipy"}
    imported = set()
    for file in [*PACKAGE.glob("dloftbs_ros/*.py"), *PACKAGE.glob("launch/*.py")]:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                imported.add(node.module.partition(".")[0])
    assert {"rclpy", "launch_ros"} <= imported
    assert imported - sys.stdlib_module_names - ours <= names
    assert "tf2_ros_py" in names  # imported by name alone, where a target frame is asked for


@pytest.mark.parametrize("text", [README, PAGE], ids=["README", "page"])
def test_the_tables_have_the_parameters_with_their_defaults(parameters, text):
    defaults = {field.name: field.default for field in fields(parameters.Parameters)}
    written = {name: type(defaults[name])(default) for name, default in table_below(text, "parameter").items()}
    assert written == defaults


def test_the_file_of_parameters_has_all_of_them(parameters):
    (content,) = yaml.safe_load((PACKAGE / "config" / "dloftbs.yaml").read_text(encoding="utf-8")).values()
    given = content["ros__parameters"]
    asked = parameters.Parameters.declared(lambda name, _: given[name])
    assert set(given) == {field.name for field in fields(asked)}
    assert asked == parameters.Parameters()  # a colour here would come before that of a configuration


def test_the_tables_have_the_outputs():
    node = ast.parse((PACKAGE / "dloftbs_ros" / "node.py").read_text(encoding="utf-8"))
    (outputs,) = (
        [ast.literal_eval(key) for key in statement.value.keys]
        for statement in node.body
        if isinstance(statement, ast.AnnAssign) and statement.target.id == "_OUTPUTS"
    )
    assert [name.removeprefix("~/") for name in table_below(README, "output")] == outputs


def test_the_region_of_interest_is_read_as_on_the_command_line(parameters):
    assert parameters.Parameters(roi="10,20,30,40").make_pipeline().config.region.roi == (10, 20, 30, 40)
    assert parameters.Parameters(roi="0,0:9,0:9,9").make_pipeline().config.region.roi == ((0, 0), (9, 0), (9, 9))
    assert parameters.Parameters().make_pipeline().config.region.roi is None
    with pytest.raises(ConfigError, match="roi must be"):
        parameters.Parameters(roi="10,20").make_pipeline()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("image_transport", "theora"),
        ("depth_transport", "Raw"),
        ("reliability", "maybe"),
        ("max_rate", -1.0),
        ("max_rate", float("nan")),
    ],
)
def test_a_parameter_out_of_its_range_is_refused(parameters, name, value):
    with pytest.raises(ConfigError, match=f"^{name} must be"):
        parameters.Parameters(**{name: value})


@pytest.mark.parametrize(
    ("name", "resolved", "topic"),
    [
        ("image", "/cam/image_raw", "/cam/image_raw/compressed"),
        ("image", "/cam/image_raw/compressed", "/cam/image_raw/compressed"),
        ("depth", "/cam/depth", "/cam/depth/compressedDepth"),
        ("depth", "/cam/depth/compressed", "/cam/depth/compressedDepth"),
        ("camera_info", "/cam/camera_info", "/cam/camera_info"),
    ],
)
def test_a_transport_is_part_of_the_topic(parameters, name, resolved, topic):
    asked = parameters.Parameters(image_transport="compressed", depth_transport="compressedDepth")
    assert asked.topic(name, resolved) == topic
    assert parameters.Parameters().topic(name, resolved) == resolved


class Launched:
    """The launch file, read with stand-ins for the modules of launch."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        def recorded(kind: str, *names: str) -> Callable[..., SimpleNamespace]:
            return lambda *values, **keywords: SimpleNamespace(
                kind=kind, **dict(zip(names, values, strict=True)), **keywords
            )

        stand_ins: dict[str, dict[str, Any]] = {
            "launch": {"LaunchContext": object, "LaunchDescription": lambda entities: entities},
            "launch.actions": {
                "DeclareLaunchArgument": recorded("argument", "name"),
                "OpaqueFunction": recorded("function"),
            },
            "launch.substitutions": {
                "LaunchConfiguration": recorded("substitution", "name"),
                "PathJoinSubstitution": "/".join,
            },
            "launch_ros": {},
            "launch_ros.actions": {"Node": recorded("node")},
            "launch_ros.parameter_descriptions": {"ParameterValue": recorded("value", "of")},
            "launch_ros.substitutions": {"FindPackageShare": lambda package: f"/share/{package}"},
        }
        for name, content in stand_ins.items():
            module = ModuleType(name)
            module.__dict__.update(content)
            monkeypatch.setitem(sys.modules, name, module)
        generate = runpy.run_path(str(PACKAGE / "launch" / "track_launch.py"))["generate_launch_description"]
        *self._arguments, self._start = generate()
        assert {argument.kind for argument in self._arguments} == {"argument"}
        self.defaults = {argument.name: argument.default_value for argument in self._arguments}
        assert all(argument.description for argument in self._arguments)

    def start(self, **given: str) -> tuple[SimpleNamespace, ...]:
        """Return what is started with arguments, with the values that `launch` makes of substitutions."""
        assert set(given) <= set(self.defaults)
        values = {**self.defaults, **given}
        nodes = self._start.function(SimpleNamespace(launch_configurations=values))
        for node in nodes:
            for entry in getattr(node, "parameters", []):
                if isinstance(entry, dict):
                    for name, value in entry.items():
                        # A bare text has to be of the type, and a value without one is read as YAML.
                        assert value.of.kind == "substitution"
                        entry[name] = value.value_type(values[value.of.name])
        return tuple(nodes)


@pytest.fixture
def launched(monkeypatch: pytest.MonkeyPatch) -> Launched:
    return Launched(monkeypatch)


def test_the_launch_file_has_the_topics_of_a_realsense(launched):
    assert {name: launched.defaults[name] for name in REALSENSE} == REALSENSE
    (track,) = launched.start()
    assert dict(track.remappings) == REALSENSE
    assert track.parameters == ["/share/dloftbs_ros/config/dloftbs.yaml"]
    assert (track.package, track.executable, track.namespace) == ("dloftbs_ros", "track", "")


def test_the_launch_file_has_each_parameter_and_the_tables_each_argument(launched, parameters):
    names = {field.name for field in fields(parameters.Parameters)}
    others = {"params", "namespace", "rviz"}
    assert set(launched.defaults) == names | set(REALSENSE) | others
    arguments = table_below(README, "launch argument")
    assert set(arguments) == set(REALSENSE) | others
    assert {name: arguments[name] for name in REALSENSE} == REALSENSE
    inputs = PAGE[PAGE.index("| input, by remap |") :].partition("\n\n")[0]
    assert all(topic in inputs for topic in REALSENSE.values())


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("config", "cable.yaml", "cable.yaml"),
        ("hsv", "170:10", "170:10"),
        ("hsv", "20", "20"),
        ("objects", "2", 2),
        ("image_transport", "compressed", "compressed"),
        ("depth_transport", "compressedDepth", "compressedDepth"),
        ("reliability", "reliable", "reliable"),
        ("frame_id", "007", "007"),
        ("target_frame", "base_link", "base_link"),
        ("max_rate", "5", 5.0),
        ("depth_unit", "0.0001", 0.0001),
        ("mask_topic", "/sam2/mask", "/sam2/mask"),
        ("min_bend_radius", "0.03", "0.03"),
        ("min_bend_radius", "40px", "40px"),
        ("robot", "arm.urdf", "arm.urdf"),
        ("answers", "topology,std", "topology,std"),
    ],
)
def test_an_argument_reaches_the_node_in_its_type(launched, parameters, name, text, value):
    (track,) = launched.start(**{name: text})
    file, given = track.parameters
    assert file == launched.defaults["params"]
    assert given == {name: value}
    assert type(given[name]) is type(value)
    asked = parameters.Parameters.declared(given.get)
    assert getattr(asked, name) == value


def test_topics_file_and_namespace_are_those_that_were_asked_for(launched):
    (track,) = launched.start(image="/oak/rgb/image_raw", depth="", params="mine.yaml", namespace="left_arm")
    left = {name: REALSENSE[name] for name in ("camera_info", "joint_states")}
    assert dict(track.remappings) == {"image": "/oak/rgb/image_raw", **left}
    assert track.parameters == ["mine.yaml"]
    assert track.namespace == "left_arm"


def test_rviz_looks_at_the_outputs_of_the_node(launched):
    _, viewer = launched.start(rviz="true", namespace="left_arm", target_frame="base_link")
    layout = PACKAGE / "rviz" / "dloftbs.rviz"
    assert viewer.package == viewer.executable == "rviz2"
    assert viewer.arguments == ["-d", f"/share/dloftbs_ros/rviz/{layout.name}", "-f", "base_link"]
    shown = re.findall(r"Value: (/dloftbs/\S+)", layout.read_text(encoding="utf-8"))
    assert shown
    assert set(shown) <= {topic for topic, _ in viewer.remappings}
    assert all(topic == f"/{ours}" for topic, ours in viewer.remappings)
    assert viewer.namespace == "left_arm"
    _, viewer = launched.start(rviz="true")
    assert "-f" not in viewer.arguments


def test_the_cameras_of_the_readme_are_named_by_arguments(launched):
    for arguments in table_below(README, "camera").values():
        given = dict(argument.split(":=", 1) for argument in arguments.split())
        (track,) = launched.start(**given)
        joints = {"joint_states": REALSENSE["joint_states"]}
        assert dict(track.remappings) == {**joints, **{name: topic for name, topic in given.items() if topic}}


def test_the_commands_of_the_readme_give_arguments_that_are_there(launched):
    commands = re.findall(r"^ros2 launch dloftbs_ros track_launch.py (.*)$", README + PAGE, re.MULTILINE)
    assert len(commands) >= 2
    for command in commands:
        launched.start(**dict(argument.split(":=", 1) for argument in command.partition("#")[0].split()))
    assert all("align_depth.enable:=true" in text for text in (README, PAGE))
