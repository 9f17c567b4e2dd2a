"""Messages of ROS and recordings of them, which is where robots keep their frames; ROS itself is not needed.

>>> for frame in dloftbs.sources.open("run.mcap", topic="/camera/color/image_raw"):  # doctest: +SKIP
...     print(frame.index, frame.stamp, frame.frame_id)

Messages are taken by their fields, whatever library made their classes: rosbags, rclpy or rospy. Recordings need the
packages of the extra ``ros`` (``pip install 'dloftbs[ros]'``); converting messages needs none.
"""

from __future__ import annotations

from dloftbs.ros.bag_sink import BagSink
from dloftbs.ros.bag_source import BagSource
from dloftbs.ros.camera_messages import camera_of
from dloftbs.ros.frame_messages import FrameMaker, RosFrame
from dloftbs.ros.image_messages import pixels_of
from dloftbs.ros.marker_messages import MarkerWriter
from dloftbs.ros.message_factory import MessageFactory, RclpyFactory, RosbagsFactory
from dloftbs.ros.recording import Recording
from dloftbs.ros.result_messages import (
    Header,
    answers_message,
    camera_message,
    diagnostics_message,
    header_of,
    image_message,
    mask_message,
    picture_message,
    points_message,
)
from dloftbs.ros.track_samples import SampledTrack, objects_of, sample_m, sample_px, sampled_m

__all__ = [
    "BagSink",
    "BagSource",
    "FrameMaker",
    "Header",
    "MarkerWriter",
    "MessageFactory",
    "RclpyFactory",
    "Recording",
    "RosFrame",
    "RosbagsFactory",
    "SampledTrack",
    "answers_message",
    "camera_message",
    "camera_of",
    "diagnostics_message",
    "header_of",
    "image_message",
    "mask_message",
    "objects_of",
    "picture_message",
    "pixels_of",
    "points_message",
    "sample_m",
    "sample_px",
    "sampled_m",
]


def __dir__() -> list[str]:
    return sorted(__all__)
