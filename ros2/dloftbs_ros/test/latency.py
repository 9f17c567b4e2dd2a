"""HD frames from one process at 30 a second, the node in another, its curves in a third: what is answered, and when.

Run it with ``.venv-ros/bin/python ros2/dloftbs_ros/test/latency.py [SECONDS]``. The stamp of a frame is the moment at
which it is sent. The listener takes the images, too: the time until they arrive there is the transport's own. Talker
and listener handle images as bytes, so that what is measured is the node.
"""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, sleep, time_ns
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image, PointCloud2

from dloftbs import Config
from dloftbs.config import SegmentationConfig
from dloftbs.ros import RclpyFactory, image_message
from dloftbs_lab.synthetic import DemoSequence

RATE = 30.0
SECONDS = 30.0
QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
NS_PER_S, NS_PER_MS = 1_000_000_000, 1e6
STAMP = struct.Struct("<iI")
STAMP_AT = 4
"""Place of the stamp in a serialized image: behind the mark of its byte order."""
TICKS_PER_S = os.sysconf("SC_CLK_TCK")


def talk(seconds: float) -> None:
    """Publish once there are two subscriptions."""
    make = RclpyFactory()
    frames = [image_message(make, make("std_msgs/msg/Header"), frame.image) for frame in DemoSequence()]
    messages = [bytearray(serialize_message(frame)) for frame in frames]
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
        STAMP.pack_into(message, STAMP_AT, *divmod(time_ns(), NS_PER_S))
        publisher.publish(bytes(message))
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

    def arrived(times: dict[int, float], second: int, nanosecond: int) -> None:
        stamp = second * NS_PER_S + nanosecond
        times[stamp] = (time_ns() - stamp) / NS_PER_MS

    def on_curves(message: PointCloud2) -> None:
        arrived(answered, message.header.stamp.sec, message.header.stamp.nanosec)

    node.create_subscription(
        Image, "/image", lambda message: arrived(sent, *STAMP.unpack_from(message, STAMP_AT)), QOS, raw=True
    )
    node.create_subscription(PointCloud2, "/dloftbs/points_px", on_curves, QOS)
    node.create_subscription(DiagnosticArray, "/dloftbs/diagnostics", diagnostics.append, QOS)
    memory_kib: list[int] = []
    with TemporaryDirectory() as folder:
        config = Path(folder, "demo.yaml")
        config.write_text(Config(segmentation=SegmentationConfig(hsv=DemoSequence().hsv)).to_yaml())
        track = [str(Path(sys.executable).parent / "track"), "--ros-args", "-p", f"config:={config}"]
        with (
            subprocess.Popen(track) as tracker,
            subprocess.Popen([sys.executable, __file__, "talk", str(seconds)]) as talker,
        ):
            before = {}
            while talker.poll() is None:
                rclpy.spin_once(node, timeout_sec=0.1)
                if not before and sent:
                    before = {pid: cpu_s(pid) for pid in (talker.pid, tracker.pid, os.getpid())}
                if len(answered) > len(memory_kib) * RATE:
                    memory_kib.append(resident_kib(tracker.pid))
                if sent:
                    spent = {pid: cpu_s(pid) - s for pid, s in before.items() if pid != talker.pid}
            tracker.send_signal(signal.SIGINT)
    report(round(seconds * RATE), sent, answered, diagnostics)
    spent_ms = [1e3 * s / len(sent) for s in spent.values()]
    print(f"processor time a frame: node {spent_ms[0]:.1f} ms, listener {spent_ms[1]:.1f} ms")
    print(f"load of the machine: {os.getloadavg()[0]:.1f}")
    some = memory_kib[:: max(1, len(memory_kib) // 8)]
    print(f"memory of the node, MiB: {', '.join(f'{kib / 1024:.0f}' for kib in some)}")


def report(count: int, sent: dict[int, float], answered: dict[int, float], diagnostics: list[Any]) -> None:
    """Print what was answered, and when."""
    transport, curves = (np.array(list(times.values())) for times in (sent, answered))
    beyond = np.array([answered[stamp] - sent[stamp] for stamp in answered.keys() & sent.keys()])
    print(f"{count} frames of 1280 x 720, bgr8, reliable, {RATE:g} a second")
    print(f"answered {len(answered)} ({len(answered) / count:.1%}); the node counts {counts(diagnostics[-1])}")
    for what, ms in (("image sent -> image received", transport), ("image sent -> curves received", curves)):
        print(f"{what}: median {np.median(ms):.1f} ms, 99 % {np.percentile(ms, 99):.1f} ms")
    print(f"beyond the transport's own: median {np.median(beyond):.1f} ms, 99 % {np.percentile(beyond, 99):.1f} ms")
    computed = [
        float(pair.value) for said in diagnostics for pair in said.status[0].values if pair.key == "pipeline ms"
    ]
    print(f"of these the pipeline: median {np.median(computed):.1f} ms, 99 % {np.percentile(computed, 99):.1f} ms")


def counts(message: Any) -> str:
    """Return the node's counts."""
    names = ("received", "answered", "dropped", "unreadable")
    return ", ".join(f"{pair.key} {pair.value}" for pair in message.status[0].values if pair.key in names)


def cpu_s(pid: int) -> float:
    """Return the processor time of a process, in seconds."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def resident_kib(pid: int) -> int:
    """Return the memory of a process, in KiB."""
    return int(Path(f"/proc/{pid}/status").read_text().partition("VmRSS:")[2].split()[0])


if __name__ == "__main__":
    if sys.argv[1:2] == ["talk"]:
        talk(float(sys.argv[2]))
    else:
        main()
