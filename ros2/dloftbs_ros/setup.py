"""The package as colcon and pip build it; dloftbs itself comes from pip or a checkout."""

from setuptools import setup

NAME = "dloftbs_ros"

setup(
    name=NAME,
    version="0.1.0",
    description="A ROS 2 node around dloftbs",
    license="BSD-3-Clause",
    packages=[NAME],
    python_requires=">=3.10",
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/track_launch.py"]),
        (f"share/{NAME}/config", ["config/dloftbs.yaml"]),
        (f"share/{NAME}/rviz", ["rviz/dloftbs.rviz"]),
    ],
    entry_points={"console_scripts": [f"track = {NAME}.node:main"]},
)
