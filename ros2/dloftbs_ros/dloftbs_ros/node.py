"""The node: images, depth and camera in, curves out.

``image``, ``depth`` and ``camera_info`` are remapped to what the camera publishes, and the parameter ``mask_topic``
names the topic of a segmenter. With a `robot`, its joints come on ``joint_states``. A topic is subscribed once somebody
publishes it, with its type, raw or compressed, its reliability and its durability. Results go to ``~/points``,
``~/markers``, ``~/points_px``, ``~/overlay/compressed``, ``~/mask``, ``~/answers`` and ``~/diagnostics``, as in
recordings (docs/ros.md).
"""

from __future__ import annotations

import logging
import signal
import sys
import threading
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from time import monotonic
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState, PointCloud2
from std_msgs.msg import String
from std_srvs.srv import Empty
from visualization_msgs.msg import MarkerArray

from dloftbs import viz
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import DloftbsError, InputError
from dloftbs.pipeline.kernel_loading import load_kernels
from dloftbs.ros import (
    FrameMaker,
    Header,
    MarkerWriter,
    RclpyFactory,
    SampledTrack,
    answers_message,
    diagnostics_message,
    header_of,
    mask_message,
    objects_of,
    picture_message,
    points_message,
    sample_px,
    sampled_m,
)
from dloftbs.ros.bag_file import Topic
from dloftbs.ros.joint_messages import JOINT_TYPE
from dloftbs.ros.message_fields import stamp_ns_of
from dloftbs.ros.result_messages import PIXELS
from dloftbs.ros.stamp_pairing import MASK_TOLERANCE_S, WAITING_FOR_MASKS, StampPairing
from dloftbs.ros.topic_choice import COMPRESSED_TYPE, IMAGE_TYPE, IMAGE_TYPES, INFO_TYPE, Topics
from dloftbs.sinks._images import encode
from dloftbs.sources.pixels import kind_for
from dloftbs_ros.newest import Newest
from dloftbs_ros.parameters import Parameters
from dloftbs_ros.publishers import Publisher, choose
from dloftbs_ros.robot import RobotError, RobotInView, read_robot
from dloftbs_ros.transforms import TransformError, Transforms, moved, moved_points
from dloftbs_ros.watch import SILENT_S, Watch

LOOK_S = 0.5
"""Time between looks at who publishes what."""
DEPTH = 10
"""Messages that the transport keeps for a subscription or a publisher."""

_CLASSES: dict[str, Any] = {
    IMAGE_TYPE: Image,
    COMPRESSED_TYPE: CompressedImage,
    INFO_TYPE: CameraInfo,
    JOINT_TYPE: JointState,
}
_INPUTS = {"image": IMAGE_TYPES, "depth": IMAGE_TYPES, "camera_info": (INFO_TYPE,)}
"""Inputs that are remapped, and their types; masks have the types of images."""
_JOINTS = "joint_states"
"""Input that is remapped where there is a robot."""
_OUTPUTS: dict[str, Any] = {
    "points": PointCloud2,
    "markers": MarkerArray,
    "points_px": PointCloud2,
    "overlay/compressed": CompressedImage,
    "mask": Image,
    "answers": String,
    "diagnostics": DiagnosticArray,
}
_WARN, _ERROR = 1, 2


@dataclass(frozen=True)
class _Arrived:
    """A message, and when it came."""

    message: Any
    stamp_ns: int


Pair = tuple[_Arrived, "_Arrived | None"]
"""An image and its depth."""
Moment = tuple[Pair, "_Arrived | None"]
"""An image and its depth, and their mask where there is a topic of masks."""


class TrackNode(Node):
    """Receives in the executor's thread and computes in one of its own, always the newest frame.

    Attributes
    ----------
    ended : threading.Event
        Set when the node is to end.
    failure : Exception, optional
        What ended the computing thread, other than `close`.

    Raises
    ------
    DloftbsError
        If a parameter is wrong, or the configuration cannot be read.
    """

    def __init__(self) -> None:
        super().__init__("dloftbs")
        self._asked = Parameters.declared(self._declare)
        self._pipeline = self._asked.make_pipeline()
        self._bend_limit, self._answers = self._asked.bend_limit(), self._asked.answer_kinds()
        self._topics = {name: self._asked.topic(name, self.resolve_topic_name(name)) for name in _INPUTS}
        if self._asked.mask_topic:
            self._topics["mask"] = self.resolve_topic_name(self._asked.mask_topic)
        robot = read_robot(self._asked.robot) if self._asked.robot else None
        if robot is not None:
            self._topics[_JOINTS] = self.resolve_topic_name(_JOINTS)
        topic = self._topics["image"]
        self._maker = FrameMaker(
            topic,
            kind=kind_for("auto", segmented=self._pipeline.segments_images),
            mask_is=self._pipeline.config.segmentation.mask_is,
            rectified=Topics(Topic(topic, IMAGE_TYPE)).is_rectified,
            depth_unit_m=self._asked.depth_unit,
        )
        needs_tf = self._asked.target_frame or (robot is not None and not robot.has_camera)
        self._transforms = Transforms(self) if needs_tf else None
        by_tf = None if robot is None or robot.has_camera else self._transforms
        self._robot = None if robot is None else RobotInView(robot, self._topics[_JOINTS], by_tf)
        load_kernels()  # before the first frame waits for them
        self._make = RclpyFactory()
        self._markers = MarkerWriter(self._make)
        self._newest: Newest[Moment] = Newest(self._asked.max_rate)
        self._pairing: StampPairing[_Arrived, _Arrived] = StampPairing()
        self._masking: StampPairing[Pair, _Arrived] = StampPairing(MASK_TOLERANCE_S, WAITING_FOR_MASKS)
        self._inputs: dict[str, tuple[Publisher, Any]] = {}
        self._problems: dict[str, str] = {}
        self._outputs = {name: self.create_publisher(kind, f"~/{name}", DEPTH) for name, kind in _OUTPUTS.items()}
        self._received = self._unreadable = self._answered = self._untransformed = self._unmasked = 0
        self._without_robot = 0
        self._watch = Watch(self._topics, monotonic())
        self._lock = threading.Lock()  # of the pipeline and the markers: reset comes from another thread
        self.create_service(Empty, "~/reset", self._reset)
        # By a steady clock: that of ROS stands still where a simulator does not publish it.
        self.create_timer(LOOK_S, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.ended = threading.Event()
        self.failure: Exception | None = None
        self._thread = threading.Thread(target=self._work, name="dloftbs", daemon=True)
        self._thread.start()
        self._look()
        self.get_logger().info(f"kernels are ready; images are awaited on {topic}")

    def close(self) -> None:
        """End the computing thread, after the frame that it is at."""
        self._newest.close()
        self._thread.join()

    def _declare(self, name: str, default: Any) -> Any:
        descriptor = ParameterDescriptor(read_only=True, dynamic_typing=True)  # the types are checked afterwards
        return self.declare_parameter(name, default, descriptor).value

    # In the executor's thread

    def _look(self) -> None:
        """Subscribe to what is published, anew where its publisher has changed, and say so if nothing comes."""
        for name, topic in self._topics.items():
            types = (JOINT_TYPE,) if name == _JOINTS else _INPUTS.get(name, IMAGE_TYPES)
            wanted, problem = choose(self._offers(topic), types, self._asked.reliability)
            if problem is not None and self._problems.get(name) != problem:
                self.get_logger().error(problem)
            self._problems[name] = problem or ""
            if wanted is not None and wanted != self._inputs.get(name, (None,))[0]:
                self._subscribe(name, wanted)
        for text in self._watch.words(monotonic(), self._present, self._problems, self._wants_metres()):
            self.get_logger().warning(text)
            self._report(_WARN, text)

    def _wants_metres(self) -> bool:
        """Return whether depth is published, or its topic was named."""
        depth = self._topics["depth"]
        return depth != self.resolve_topic_name("depth", only_expand=True) or self.count_publishers(depth) > 0

    def _offers(self, topic: str) -> list[Publisher]:
        return [
            Publisher(
                topic,
                found.topic_type,
                found.qos_profile.reliability == ReliabilityPolicy.RELIABLE,
                found.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL,
            )
            for found in self.get_publishers_info_by_topic(topic)
        ]

    def _present(self) -> list[Publisher]:
        own = f"{self.get_fully_qualified_name()}/"
        topics = [name for name, _ in self.get_topic_names_and_types() if not name.startswith(own)]
        return [publisher for topic in topics for publisher in self._offers(topic)]

    def _subscribe(self, name: str, wanted: Publisher) -> None:
        if name in self._inputs:
            self.destroy_subscription(self._inputs.pop(name)[1])
        qos = QoSProfile(
            depth=DEPTH,
            reliability=ReliabilityPolicy.RELIABLE if wanted.reliable else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if wanted.latched else DurabilityPolicy.VOLATILE,
        )
        take = partial(self._take, name)
        self._inputs[name] = wanted, self.create_subscription(_CLASSES[wanted.type_name], wanted.topic, take, qos)
        self.get_logger().info(f"subscribed to {wanted}")

    def _take(self, name: str, message: Any) -> None:
        self._watch.hear(name, monotonic())
        try:
            if name == "camera_info":
                self._maker.take_info(message)
                return
            if name == _JOINTS and self._robot is not None:
                self._robot.take(message, self.get_clock().now().nanoseconds)
                return
            arrived = _Arrived(message, stamp_ns_of(message) or self.get_clock().now().nanoseconds)
        except DloftbsError as error:
            self._complain(f"a message of {self._topics[name]}: {error}")
            return
        if name == "mask":
            self._hand_over(self._masking.add_partner(arrived.stamp_ns, arrived))
            return
        if name == "depth":
            pairs = self._pairing.add_partner(arrived.stamp_ns, arrived)
        else:
            self._received += 1
            if self._transforms is not None and self._pairing.begins_anew(arrived.stamp_ns):
                self._transforms.forget()  # tf takes those of the new time for old ones
            pairs = self._pairing.add_image(arrived.stamp_ns, arrived)
        self._pass_on(pairs)
        if "depth" not in self._inputs or not self.count_publishers(self._topics["depth"]):
            self._pass_on(self._pairing.rest())

    def _pass_on(self, pairs: Iterable[Pair]) -> None:
        for image, depth in pairs:
            if depth is not None:
                self._watch.hear("pair", monotonic())
            if "mask" in self._topics:
                self._hand_over(self._masking.add_image(image.stamp_ns, (image, depth)))
            else:
                self._newest.put(((image, depth), None))

    def _hand_over(self, moments: Iterable[Moment]) -> None:
        """Take the images that have masks, and count the others."""
        for pair, mask in moments:
            if mask is None:
                self._unmasked += 1
            else:
                self._watch.hear("masked", monotonic())
                self._newest.put((pair, mask))

    def _reset(self, _request: Any, response: Any) -> Any:
        with self._lock:
            self._pipeline.reset()
            self._pairing = StampPairing()
            self._masking = StampPairing(MASK_TOLERANCE_S, WAITING_FOR_MASKS)
            if self._transforms is not None:
                self._transforms.forget()
            if self._robot is not None:
                self._robot.forget()
            frame_id = self._asked.target_frame or self._asked.frame_id or "camera"
            header = Header(self.get_clock().now().nanoseconds, frame_id)
            self._outputs["markers"].publish(self._markers.clear(header.message(self._make)))
        self.get_logger().info("tracking begins anew")
        return response

    # In the computing thread

    def _work(self) -> None:
        try:
            while (moment := self._newest.take()) is not None:
                (image, depth), mask = moment
                try:
                    with self._lock:
                        self._process(image, depth, mask)
                except DloftbsError as error:
                    self._unreadable += 1
                    self._complain(f"a frame is left out: {error}")
        except Exception as error:  # noqa: BLE001 - the main thread raises it
            self.failure = error
        self.ended.set()

    def _process(self, image: _Arrived, depth: _Arrived | None, mask: _Arrived | None) -> None:
        pixels = self._maker.pixels(image.message, None if mask is None else mask.message)
        frame = self._maker.make(
            image.message,
            pixels,
            None if depth is None else depth.message,
            index=self._answered,
            stamp_ns=image.stamp_ns,
            name=self._topics["image"],
        )
        frame, problem = self._with_robot(frame)
        result = self._pipeline.process(frame)
        self._answered += 1
        self._publish(frame, result, problem)

    def _with_robot(self, frame: Frame) -> tuple[Frame, str | None]:
        """Return a frame with the robot in it; or as it is, and why, where nobody knows where the robot is."""
        if self._robot is None:
            return frame, None
        known = header_of(frame)
        try:
            return self._robot.into(frame, self._asked.frame_id or known.frame_id, known.stamp_ns), None
        except (RobotError, TransformError, InputError) as error:
            self._without_robot += 1
            text = f"a frame goes without the robot: {error}"
            self.get_logger().warning(text, throttle_duration_sec=SILENT_S)
            return frame, text

    def _publish(self, frame: Frame, result: FrameResult, robot_problem: str | None) -> None:
        """Publish what somebody listens to; nobody waits for messages that nobody gets."""
        known, make = header_of(frame), self._make
        header = Header(known.stamp_ns, self._asked.frame_id or known.frame_id)
        in_camera, pixels = header.message(make), header.message(make, PIXELS)
        if self._is_heard("points_px"):
            in_image = [sample_px(track) for track in objects_of(result)]
            self._outputs["points_px"].publish(points_message(make, pixels, in_image, 2))
        if self._pipeline.mask is not None and self._is_heard("mask"):
            self._outputs["mask"].publish(mask_message(make, in_camera, self._pipeline.mask))
        if self._is_heard("overlay/compressed"):
            picture = encode(viz.draw(frame, result), ".jpg")
            self._outputs["overlay/compressed"].publish(picture_message(make, in_camera, picture))
        if self._answers and self._is_heard("answers"):
            self._outputs["answers"].publish(answers_message(make, result, self._answers))
        # After those in pixels, which need not wait for tf.
        problems = [text for text in (robot_problem, self._publish_in_space(header, result)) if text is not None]
        diagnostics = diagnostics_message(make, in_camera, result, self.get_name(), self._bend_limit)
        (status,) = diagnostics.status
        status.values.extend(self._counts())
        if problems:
            status.level, status.message = bytes([_WARN]), "; ".join([status.message, *problems])
        self._outputs["diagnostics"].publish(diagnostics)

    def _publish_in_space(self, header: Header, result: FrameResult) -> str | None:
        """Publish curves in metres; return why, where they cannot be given in the frame that was asked for."""
        make, target = self._make, self._asked.target_frame
        if not (self._is_heard("points") or self._is_heard("markers")):
            return None
        samples: list[SampledTrack] = list(sampled_m(result))
        points = result.branch_points
        problem = None
        if self._transforms is not None and target and target != header.frame_id:
            try:
                pose = self._transforms.pose(header.frame_id, target, header.stamp_ns)
                samples, points = moved(samples, pose), moved_points(points, pose)
            except TransformError as error:
                self._untransformed += 1
                problem = f"no curves in space: {error}"
                self.get_logger().warning(problem, throttle_duration_sec=SILENT_S)
                samples, points = [], ()
        message_header = Header(header.stamp_ns, target or header.frame_id).message(make)
        if problem is None and self._is_heard("points"):
            self._outputs["points"].publish(points_message(make, message_header, samples, 3))
        if self._is_heard("markers"):
            self._outputs["markers"].publish(self._markers.message(message_header, samples, points))
        return problem

    def _is_heard(self, output: str) -> bool:
        return bool(self._outputs[output].get_subscription_count() > 0)

    # In both

    def _complain(self, text: str) -> None:
        self.get_logger().error(text, throttle_duration_sec=SILENT_S)
        self._report(_ERROR, text)

    def _report(self, level: int, text: str) -> None:
        """Publish diagnostics that go with no result."""
        make = self._make
        header = Header(self.get_clock().now().nanoseconds, self._asked.frame_id).message(make)
        status = make(
            "diagnostic_msgs/msg/DiagnosticStatus",
            level=level,
            name=self.get_name(),
            message=text,
            values=self._counts(),
        )
        message = make("diagnostic_msgs/msg/DiagnosticArray", header=header, status=[status])
        self._outputs["diagnostics"].publish(message)

    def _counts(self) -> list[Any]:
        counts = {
            "received": self._received,
            "answered": self._answered,
            "dropped": self._newest.dropped,
            "over max_rate": self._newest.skipped,
            "unreadable": self._unreadable,
            "without mask": self._unmasked,
            "without transform": self._untransformed,
            "without robot": self._without_robot,
        }
        return [self._make("diagnostic_msgs/msg/KeyValue", key=key, value=str(count)) for key, count in counts.items()]


class _ToRos(logging.Handler):
    """Hands the package's warnings to the node's log."""

    def __init__(self, node: Node) -> None:
        super().__init__(logging.WARNING)
        self._node = node

    def emit(self, record: logging.LogRecord) -> None:
        """Log a record."""
        self._node.get_logger().warning(record.getMessage())


def main() -> None:
    """Run the node until it is interrupted."""
    # Its own handlers would end the context in the midst of a callback.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = None
    code = 0
    try:
        node = TrackNode()
        logging.getLogger("dloftbs").addHandler(_ToRos(node))
        run(node)
    except KeyboardInterrupt:  # while it starts
        pass
    except DloftbsError as error:
        rclpy.logging.get_logger("dloftbs").fatal(str(error))
        code = 2
    finally:
        if node is not None:
            node.close()
            node.destroy_node()
        rclpy.shutdown()
    sys.exit(code)


def run(node: TrackNode) -> None:
    """Receive until the node has ended, by a signal or by an error, which is raised."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: node.ended.set())
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not node.ended.is_set():
        executor.spin_once(timeout_sec=LOOK_S)
    executor.shutdown()
    if node.failure is not None:
        raise node.failure


if __name__ == "__main__":
    main()
