"""The node, and RViz where asked: ``ros2 launch dloftbs_ros track_launch.py hsv:=170:10 rviz:=true``.

The topics are those of a RealSense whose driver, version 4.54 or later, runs with ``align_depth.enable:=true``.
"""

from typing import Any

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

TOPICS = {
    "image": ("/camera/camera/color/image_raw", "topic of the images, or of masks"),
    "depth": ("/camera/camera/aligned_depth_to_color/image_raw", "topic of depth in the pixels of the images"),
    "camera_info": ("/camera/camera/color/camera_info", "topic of the camera of the images"),
    "joint_states": ("/joint_states", "topic of the joints of a robot"),
}
PARAMETERS: dict[str, tuple[type, str]] = {
    "config": (str, "file of settings, as `dloftbs config` prints them"),
    "hsv": (str, "colour of the cable, such as 170:10"),
    "objects": (int, "number of cables, 0 if it is not known"),
    "roi": (str, "region of interest in pixels, such as 100,50,640,480 for x, y, width, height"),
    "image_transport": (str, "raw or compressed"),
    "depth_transport": (str, "raw, compressedDepth or compressed"),
    "reliability": (str, "auto, reliable or best_effort"),
    "frame_id": (str, "coordinate frame of the camera, in place of that of the images"),
    "target_frame": (str, "coordinate frame of curves in space, reached by tf"),
    "max_rate": (float, "frames a second at most, 0: all"),
    "depth_unit": (float, "metres per count of integer depth"),
    "mask_topic": (str, "topic of the images' masks, as a segmenter publishes them"),
    "min_bend_radius": (str, "least radius of bends, in metres, or in pixels as in 40px"),
    "robot": (str, "YAML or URDF of a robot that hides cables"),
    "answers": (str, "answers to publish: topology,shape,std"),
}
"""Parameters of the node and their types; an empty argument leaves the value to the file of parameters."""
OUTPUTS = ("points", "markers", "points_px", "overlay/compressed", "mask", "answers", "diagnostics")


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and what they start."""
    share = FindPackageShare("dloftbs_ros")
    others = {
        "params": (PathJoinSubstitution([share, "config", "dloftbs.yaml"]), "file of parameters"),
        "namespace": ("", "namespace of the node and of its outputs"),
    }
    rviz = DeclareLaunchArgument(
        "rviz", default_value="false", choices=["true", "false"], description="whether to start RViz"
    )
    return LaunchDescription(
        [
            *(_argument(name, default, text) for name, (default, text) in {**TOPICS, **others}.items()),
            *(_argument(name, "", text) for name, (_, text) in PARAMETERS.items()),
            rviz,
            OpaqueFunction(function=_start),
        ]
    )


def _argument(name: str, default: Any, text: str) -> DeclareLaunchArgument:
    return DeclareLaunchArgument(name, default_value=default, description=text)


def _start(context: LaunchContext) -> list[Node]:
    """Return the node with what was given, and RViz."""
    value = context.launch_configurations
    # With their types: launch would read 170:10 as a number to the base of 60.
    given = {
        name: ParameterValue(LaunchConfiguration(name), value_type=kind)
        for name, (kind, _) in PARAMETERS.items()
        if value[name]
    }
    track = Node(
        package="dloftbs_ros",
        executable="track",
        name="dloftbs",
        namespace=value["namespace"],
        output="screen",
        parameters=[value["params"], *([given] if given else [])],
        remappings=[(name, value[name]) for name in TOPICS if value[name]],
    )
    if value["rviz"] == "false":
        return [track]
    frame = value["target_frame"] or value["frame_id"]
    layout = PathJoinSubstitution([FindPackageShare("dloftbs_ros"), "rviz", "dloftbs.rviz"])
    viewer = Node(
        package="rviz2",
        executable="rviz2",
        namespace=value["namespace"],
        arguments=["-d", layout, *(["-f", frame] if frame else [])],
        remappings=[(f"/dloftbs/{name}", f"dloftbs/{name}") for name in OUTPUTS],
    )
    return [track, viewer]
