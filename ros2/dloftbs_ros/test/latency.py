"""HD frames from one process at 30 a second, the node in another, its curves in a third: what is answered, and when.

Run it with ``.venv-ros/bin/python ros2/dloftbs_ros/test/latency.py [SECONDS]``. The stamp of a frame is the moment at
which it is sent. The listener takes the images, too: the time until they arrive there is the transport's own.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep, time_ns
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image, PointCloud2

from dloftbs.ros import Header, RclpyFactory, image_message
from dloftbs.synthetic import DemoSequence

RATE = 30.0
SECONDS = 30.0
QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
NS_PER_MS = 1e6


def talk(seconds: float) -> None:
    """Publish once there are two subscriptions."""
    make = RclpyFactory()
    messages = [image_message(make, make("std_msgs/msg/Header"), frame.image) for frame in DemoSequence(frames=30)]
    rclpy.init()
    node = rclpy.create_node("talker")
    publisher = node.create_publisher(Image, "/image", QOS)
    while publisher.get_subscription_count() < 2:
        sleep(0.1)
    sleep(3.0)  # until the node knows who listens to it
    since = monotonic()
    for index in range(round(seconds * RATE)):
        sleep(max(0.0, since + index / RATE - monotonic()))
        message = messages[index % len(messages)]
        message.header = Header(time_ns(), "camera").message(make)
        publisher.publish(message)
    sleep(2.0)  # the last ones are on their way


def main() -> None:
    """Print the figures."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    os.environ |= {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": str(1 + os.getpid() % 100)}
    rclpy.init()
    node = rclpy.create_node("listener")
    sent: dict[int, float] = {}
    answered: dict[int, float] = {}
    diagnostics: list[Any] = []

    def arrived(times: dict[int, float], message: Any) -> None:
        stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        times[stamp] = (time_ns() - stamp) / NS_PER_MS

    node.create_subscription(Image, "/image", lambda message: arrived(sent, message), QOS)
    node.create_subscription(PointCloud2, "/dloftbs/points_px", lambda message: arrived(answered, message), QOS)
    node.create_subscription(DiagnosticArray, "/dloftbs/diagnostics", diagnostics.append, QOS)
    track = [str(Path(sys.executable).parent / "track"), "--ros-args", "-p", "hsv:=170:10,80:255,60:255"]
    with (
        subprocess.Popen(track) as tracker,
        subprocess.Popen([sys.executable, __file__, "talk", str(seconds)]) as talker,
    ):
        memory_kib: list[int] = []
        while talker.poll() is None:
            rclpy.spin_once(node, timeout_sec=0.1)
            if len(answered) > len(memory_kib) * RATE:
                status = Path(f"/proc/{tracker.pid}/status").read_text()
                memory_kib.append(int(status.partition("VmRSS:")[2].split()[0]))
        tracker.send_signal(signal.SIGINT)
    transport, curves = (np.array(list(times.values())) for times in (sent, answered))
    beyond = np.array([answered[stamp] - sent[stamp] for stamp in answered.keys() & sent.keys()])
    count = round(seconds * RATE)
    print(f"{count} frames of 1280 x 720, bgr8, reliable, {RATE:g} a second")
    print(f"answered {len(answered)} ({len(answered) / count:.1%}); the node counts {counts(diagnostics[-1])}")
    for what, ms in (("image sent -> image received", transport), ("image sent -> curves received", curves)):
        print(f"{what}: median {np.median(ms):.1f} ms, 99 % {np.percentile(ms, 99):.1f} ms")
    print(f"beyond the transport's own: median {np.median(beyond):.1f} ms, 99 % {np.percentile(beyond, 99):.1f} ms")
    computed = [
        float(pair.value) for said in diagnostics for pair in said.status[0].values if pair.key == "pipeline ms"
    ]
    print(f"of these the pipeline: median {np.median(computed):.1f} ms, 99 % {np.percentile(computed, 99):.1f} ms")
    some = memory_kib[:: max(1, len(memory_kib) // 8)]
    print(f"memory of the node, MiB: {', '.join(f'{kib / 1024:.0f}' for kib in some)}")


def counts(message: Any) -> str:
    """Return the node's counts."""
    names = ("received", "answered", "dropped", "unreadable")
    return ", ".join(f"{pair.key} {pair.value}" for pair in message.status[0].values if pair.key in names)


if __name__ == "__main__":
    if sys.argv[1:2] == ["talk"]:
        talk(float(sys.argv[2]))
    else:
        main()
