"""Frames that the pipeline cannot work on are left out, and the messages that they carry are not."""

from __future__ import annotations

import numpy as np

from dloftbs.cli.frames import UsableFrames
from dloftbs.cli.input_options import InputOptions
from dloftbs.config import Config
from dloftbs.ros import RosFrame
from dloftbs.ros.bag_file import Channel, RawMessage
from dloftbs.sources import Source

INPUTS = InputOptions("auto", None, None, None, None, None, None)


class Recorded(Source):
    """Masks of these heights, each with messages of its index."""

    def __init__(self, *heights: int) -> None:
        self.name, self._heights = "run.mcap", heights

    def __iter__(self):
        for index, height in enumerate(self._heights):
            message = RawMessage("/tf_static", index, b"")
            image = RawMessage("/image", index, b"", channel=Channel("/image", "sensor_msgs/msg/Image"))
            yield RosFrame(mask=np.ones((height, 9), bool), index=index, recorded=(message, image))


def test_messages_of_a_frame_that_is_left_out_go_with_the_next_one():
    config = Config().replace({"region.roi": (1, 1, 5, 5)})
    frames = UsableFrames(Recorded(9, 8, 8, 9, 9), config, INPUTS, "run.mcap")
    found = [
        (
            frame.index,
            [[raw.stamp_ns for raw in frame.recorded if raw.topic == name] for name in ("/tf_static", "/image")],
        )
        for frame in frames
    ]
    assert found == [(0, [[0], [0]]), (3, [[1, 2, 3], [3]]), (4, [[4], [4]])]
    assert frames.skipped == 2
