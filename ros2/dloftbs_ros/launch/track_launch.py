"""The node with its parameter file: ``ros2 launch dloftbs_ros track_launch.py image:=/camera/color/image_raw``."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

TOPICS = {
    "image": "/camera/color/image_raw",
    "depth": "/camera/aligned_depth_to_color/image_raw",
    "camera_info": "/camera/color/camera_info",
}


def generate_launch_description() -> LaunchDescription:
    """Return the node, its topics and its parameters."""
    params = PathJoinSubstitution([FindPackageShare("dloftbs_ros"), "config", "dloftbs.yaml"])
    arguments = [DeclareLaunchArgument(name, default_value=topic) for name, topic in TOPICS.items()]
    node = Node(
        package="dloftbs_ros",
        executable="track",
        name="dloftbs",
        output="screen",
        parameters=[LaunchConfiguration("params")],
        remappings=[(name, LaunchConfiguration(name)) for name in TOPICS],
    )
    return LaunchDescription([*arguments, DeclareLaunchArgument("params", default_value=params), node])
