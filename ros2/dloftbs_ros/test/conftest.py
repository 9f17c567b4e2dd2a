"""A node in a process of its own, and one here that talks to it and listens."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from dloftbs.ros import Header, RclpyFactory

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
TRACK = Path(sys.executable).parent / "track"
PATIENCE_S = 40.0
"""Longest wait for anything, beside other work."""
FRAME_ID = "camera_color_optical_frame"
T0_NS = 1_700_000_000_123_456_789
PERIOD_NS = 33_333_333
MAKE = RclpyFactory()
OUTPUTS = {"points": PointCloud2, "points_px": PointCloud2, "markers": MarkerArray, "diagnostics": DiagnosticArray}


class Peer:
    """Publishes what a camera would, starts the node, and keeps what the node publishes."""

    def __init__(self, folder: Path, domain: int, name: str = "dloftbs") -> None:
        self._log = folder / "log.txt"
        self._environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=domain)
        # rclpy destroys this service twice with its node, which crashes now and then.
        no_service = Parameter("start_type_description_service", value=False)
        self.node = Node("camera", context=self._context, parameter_overrides=[no_service])
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self.heard: dict[str, list[Any]] = {output: [] for output in OUTPUTS}
        qos = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
        self._subscriptions = {
            output: self.node.create_subscription(kind, f"/{name}/{output}", self.heard[output].append, qos)
            for output, kind in OUTPUTS.items()
        }
        self.process: subprocess.Popen[bytes] | None = None

    def start(self, *arguments: str, **environment: str) -> None:
        """Start the node, with more in its environment."""
        with self._log.open("wb") as log:
            command = [str(TRACK), "--ros-args", *arguments]
            environment = {**self._environment, **environment}
            self.process = subprocess.Popen(command, stdout=log, stderr=log, env=environment)

    def stop_listening(self, *outputs: str) -> None:
        """Listen to some outputs no more."""
        for output in outputs:
            self.node.destroy_subscription(self._subscriptions.pop(output))

    def publisher(self, kind: Any, topic: str, *, reliable: bool = True, depth: int = 50) -> Any:
        """Return a publisher here."""
        policy = ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT
        return self.node.create_publisher(kind, topic, QoSProfile(depth=depth, reliability=policy))

    def holds_within(self, seconds: float, until: Callable[[], object]) -> bool:
        """Listen until something holds, and return whether it came to that."""
        end = monotonic() + seconds
        while not until():
            if monotonic() > end:
                return False
            self._executor.spin_once(timeout_sec=0.05)
        return True

    def wait(self, what: str, until: Callable[[], object]) -> None:
        """Listen until something holds; fail, with the node's log, if it does not."""
        if not self.holds_within(PATIENCE_S, until):
            pytest.fail(f"{what}: not within {PATIENCE_S:g} s; heard {self.counts()}; the node said:\n{self.log()}")

    def wait_matched(self, *publishers: Any) -> None:
        """Listen until the node has subscribed, and a moment longer, in which it learns who listens here."""
        self.wait("subscribed", lambda: all(publisher.get_subscription_count() for publisher in publishers))
        self.listen(0.5)

    def listen(self, seconds: float) -> None:
        """Listen for a while."""
        self.holds_within(seconds, lambda: False)

    def stamps(self, output: str) -> list[int]:
        """Return the times of what was heard, in nanoseconds."""
        return [stamp_of(message) for message in self.heard[output]]

    def counts(self) -> dict[str, int]:
        """Return how many messages were heard."""
        return {output: len(messages) for output, messages in self.heard.items()}

    def log(self) -> str:
        """Return what the node printed."""
        return self._log.read_text(errors="replace")

    def interrupt(self, number: int = signal.SIGINT) -> int:
        """Interrupt the node and return its exit code."""
        assert self.process is not None
        self.process.send_signal(number)
        return self.process.wait(PATIENCE_S)

    def close(self) -> None:
        """End both."""
        if self.process is not None and self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)


@pytest.fixture(scope="session", autouse=True)
def _kernels() -> None:
    """Compile the kernels, so that no test waits for them."""
    subprocess.run([TRACK.with_name("dloftbs"), "warmup"], check=True)


@pytest.fixture
def peer(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Peer]:
    """Return a peer in a domain of its own."""
    number = request.session.items.index(request.node)
    made = Peer(tmp_path, 1 + (os.getpid() + number) % 100, getattr(request, "param", "dloftbs"))
    yield made
    made.close()


def stamp_of(message: Any) -> int:
    """Return a message's time in nanoseconds."""
    stamp = (message.header if hasattr(message, "header") else message.markers[0].header).stamp
    return int(stamp.sec * 1_000_000_000 + stamp.nanosec)


def header(index: int) -> Any:
    """Return the header of a camera's frame."""
    return Header(T0_NS + index * PERIOD_NS, FRAME_ID).message(MAKE)


def rows_of(cloud: PointCloud2) -> Any:
    """Return the points of a cloud as a structured array."""
    types = {7: "<f4", 6: "<u4", 2: "u1"}
    row = np.dtype(
        {
            "names": [field.name for field in cloud.fields],
            "formats": [types[field.datatype] for field in cloud.fields],
            "offsets": [field.offset for field in cloud.fields],
            "itemsize": cloud.point_step,
        }
    )
    return np.frombuffer(bytes(cloud.data), row)


def values_of(diagnostics: DiagnosticArray) -> dict[str, str]:
    """Return the values of a diagnostic message."""
    return {pair.key: pair.value for pair in diagnostics.status[0].values}
