"""Messages of what was found in a frame: points, the mask, the overlay, the state of things.

Each function takes a `MessageFactory`, so that a bag and a node publish the same. Points in metres are in the camera's
frame; those in pixels carry a frame of their own, which no transform leads to: nothing can take them for metres.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.data.answers import BendLimit, with_answers
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.ros.frame_messages import RosFrame
from dloftbs.ros.message_factory import MessageFactory
from dloftbs.ros.message_fields import NS_PER_S
from dloftbs.ros.track_samples import SampledTrack, checked_samples
from dloftbs.support.array_likes import as_array
from dloftbs.support.arrays import AnyArray, check_depth, check_image, check_mask
from dloftbs.support.json_text import encode_line
from dloftbs.support.text import readable
from dloftbs.support.values import (
    DEPTH_UNITS_M,
    MILLIMETRE_M,
    check_integer,
    check_number,
    check_size,
    check_text,
    check_type,
    set_fields,
)

PIXELS = "/pixels"
"""Ending of the frame's name for points in pixels."""

_FLOAT32, _UINT32, _UINT8 = 7, 6, 2
"""Datatypes of ``sensor_msgs/PointField``."""
_FIELD_TYPES: dict[str, tuple[str, int]] = {
    **dict.fromkeys(("x", "y", "z", "s", "confidence"), ("<f4", _FLOAT32)),
    "id": ("<u4", _UINT32),
    "inferred": ("u1", _UINT8),
}
_DEPTH_ENCODINGS = {"uint16": "16UC1", "float32": "32FC1", "float64": "64FC1"}
"""Encodings of depth by its type: counts are of a millimetre, as readers of ROS take them; the others are metres."""
_PLUMB_BOB = 5
"""Most coefficients of the distortion model of that name."""
_MAX_NS = 2**63 - 1
_LAST_S = 2**31 - 1
"""Latest time of a message, in 2038."""
_OK, _WARN = 0, 1
"""Levels of ``diagnostic_msgs/DiagnosticStatus``."""


@dataclass(frozen=True)
class Header:
    """Time and coordinate frame that all messages of a result carry.

    Parameters
    ----------
    stamp_ns : int
    frame_id : str

    Raises
    ------
    InputError
        If one is of another type, or the time has more than 64 bits.
    """

    stamp_ns: int
    frame_id: str

    def __post_init__(self) -> None:
        stamp_ns = check_integer("stamp_ns", self.stamp_ns, -_MAX_NS, _MAX_NS)
        set_fields(self, stamp_ns=stamp_ns, frame_id=check_text("frame_id", self.frame_id))

    def message(self, make: MessageFactory, ending: str = "") -> Any:
        """Return a ``std_msgs/Header``, with an ending of the frame's name.

        Raises
        ------
        InputError
            If the time is none that a message can have: seconds from 0 on, of 31 bits.
        """
        check_type("make", make, MessageFactory)
        check_text("ending", ending)
        seconds, nanoseconds = divmod(self.stamp_ns, NS_PER_S)
        if not 0 <= seconds <= _LAST_S:
            raise InputError(f"the time of a message must be 0 to {_LAST_S} s, got {self.stamp_ns / NS_PER_S:g} s")
        stamp = make("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
        return make("std_msgs/msg/Header", stamp=stamp, frame_id=f"{self.frame_id}{ending}")


def header_of(frame: Frame, frame_id: str = "camera") -> Header:
    """Return the header of a frame's results: its message's to the nanosecond, or else its own time.

    Parameters
    ----------
    frame : Frame
        Without a time it is said to be at its index in seconds.
    frame_id : str
        Name of the camera's frame where the frame knows none.

    Raises
    ------
    InputError
        If it is no frame, or the name no text.
    """
    check_type("frame", frame, Frame)
    if isinstance(frame, RosFrame) and frame.stamp_ns is not None:
        return Header(frame.stamp_ns, frame.frame_id or frame_id)
    seconds = float(frame.index) if frame.stamp is None else frame.stamp
    known = frame.frame_id if isinstance(frame, RosFrame) else ""
    return Header(round(seconds * NS_PER_S), known or frame_id)


def points_message(make: MessageFactory, header: Any, samples: Iterable[SampledTrack], dims: int) -> Any:
    """Return a ``sensor_msgs/PointCloud2`` of all tracks: x, y, z (of `dims`), id, s, confidence, inferred.

    Parameters
    ----------
    make : MessageFactory
    header : std_msgs/Header
    samples : iterable of SampledTrack
    dims : int
        2 for points in pixels, without z; 3 for points in metres.

    Raises
    ------
    InputError
        If an argument is of another type, or points have other dimensions.
    """
    check_type("make", make, MessageFactory)
    dims = check_integer("dims", dims, 2, 3)
    samples = checked_samples(samples, dims)
    names = [*"xyz"[:dims], "id", "s", "confidence", "inferred"]
    row = np.dtype([(name, _FIELD_TYPES[name][0]) for name in names], align=True)
    parts = [_rows(sample, row, dims) for sample in samples]
    points = np.concatenate([np.zeros(0, row), *parts])
    assert row.fields is not None  # it is made of them
    fields = [
        make("sensor_msgs/msg/PointField", name=name, offset=row.fields[name][1], datatype=datatype, count=1)
        for name, datatype in ((name, _FIELD_TYPES[name][1]) for name in names)
    ]
    return make(
        "sensor_msgs/msg/PointCloud2",
        header=header,
        height=1,
        width=len(points),
        fields=fields,
        is_bigendian=False,
        point_step=row.itemsize,
        row_step=row.itemsize * len(points),
        data=np.frombuffer(points.tobytes(), np.uint8),
        is_dense=True,
    )


def mask_message(make: MessageFactory, header: Any, mask: AnyArray) -> Any:
    """Return a mask (H, W) as a ``sensor_msgs/Image`` of mono8, in which cable is 255.

    Raises
    ------
    InputError
        If it is no mask.
    """
    check_type("make", make, MessageFactory)
    return _image(make, header, np.where(check_mask(mask) != 0, 255, 0).astype(np.uint8), "mono8")


def image_message(make: MessageFactory, header: Any, pixels: AnyArray, depth_unit_m: float = MILLIMETRE_M) -> Any:
    """Return an image (H, W, 3), BGR, or depth (H, W), counts or metres, as a ``sensor_msgs/Image``.

    Depth that messages have no encoding for becomes metres of 32 bits, NaN where it is 0: counts of another unit than
    a millimetre, or of another type than uint16, and floating point of 16 bits.

    Parameters
    ----------
    make : MessageFactory
    header : std_msgs/Header
    pixels : numpy.ndarray, shape (H, W, 3), uint8, or shape (H, W), floating point or integer
    depth_unit_m : float
        Metres per count of integer depth.

    Raises
    ------
    InputError
        If it is neither, or an argument is of another type or out of range.
    """
    check_type("make", make, MessageFactory)
    depth_unit_m = check_number("depth_unit_m", depth_unit_m, *DEPTH_UNITS_M)
    pixels = as_array("pixels", pixels)
    pixels = check_image(pixels) if pixels.ndim == 3 else _in_unit_of_messages(check_depth(pixels), depth_unit_m)
    return _image(make, header, pixels, "bgr8" if pixels.ndim == 3 else _DEPTH_ENCODINGS[pixels.dtype.name])


def _image(make: MessageFactory, header: Any, pixels: AnyArray, encoding: str) -> Any:
    little = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder("<"))
    return make(
        "sensor_msgs/msg/Image",
        header=header,
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        is_bigendian=0,
        step=little.nbytes // max(len(pixels), 1),
        data=little.view(np.uint8).ravel(),
    )


def _in_unit_of_messages(depth: AnyArray, depth_unit_m: float) -> AnyArray:
    """Return depth (H, W) as it is where messages have an encoding for it, and else in metres, float32."""
    is_counts = depth.dtype.kind != "f"
    if depth.dtype.name in _DEPTH_ENCODINGS and not (is_counts and depth_unit_m != MILLIMETRE_M):
        return depth
    metres = depth * (depth_unit_m if is_counts else 1.0)
    return np.where(depth != 0, metres, np.nan).astype(np.float32)


def camera_message(make: MessageFactory, header: Any, camera: PinholeCamera, size: tuple[int, int]) -> Any:
    """Return a camera as a ``sensor_msgs/CameraInfo`` of images of a size (H, W).

    Raises
    ------
    InputError
        If an argument is of another type.
    """
    check_type("make", make, MessageFactory)
    check_type("camera", camera, PinholeCamera)
    size = check_size("size", size)
    k = camera.matrix
    model = {"fisheye": "equidistant"}.get(camera.model)
    return make(
        "sensor_msgs/msg/CameraInfo",
        header=header,
        height=size[0],
        width=size[1],
        distortion_model=model or ("rational_polynomial" if len(camera.distortion) > _PLUMB_BOB else "plumb_bob"),
        d=np.array(camera.distortion),
        k=k.ravel(),
        r=np.eye(3).ravel(),
        p=np.hstack((k, np.zeros((3, 1)))).ravel(),
    )


def picture_message(make: MessageFactory, header: Any, jpeg: bytes) -> Any:
    """Return a picture as a ``sensor_msgs/CompressedImage``.

    Raises
    ------
    InputError
        If it is not of bytes.
    """
    check_type("make", make, MessageFactory)
    check_type("jpeg", jpeg, bytes)
    return make("sensor_msgs/msg/CompressedImage", header=header, format="jpeg", data=np.frombuffer(jpeg, np.uint8))


def answers_message(make: MessageFactory, result: FrameResult, kinds: Sequence[str]) -> Any:
    """Return a result with answers as a ``std_msgs/String``: a line of JSON, as a `JsonLinesSink` writes it.

    Parameters
    ----------
    make : MessageFactory
    result : FrameResult
    kinds : sequence of str
        As `data.answers.with_answers` takes them: ``"topology"``, ``"shape"``, ``"std"``.

    Raises
    ------
    InputError
        If an argument is of another type, or there is no such answer.
    """
    check_type("make", make, MessageFactory)
    check_type("result", result, FrameResult)
    return make("std_msgs/msg/String", data=encode_line(with_answers(result, kinds)).decode().rstrip())


def diagnostics_message(
    make: MessageFactory, header: Any, result: FrameResult, name: str = "dloftbs", limit: BendLimit | None = None
) -> Any:
    """Return a ``diagnostic_msgs/DiagnosticArray``.

    It is a warning where nothing was found, a cable bends too much, or the input is strange (`FrameResult.diagnosis`).

    Parameters
    ----------
    make : MessageFactory
    header : std_msgs/Header
    result : FrameResult
    name : str
    limit : BendLimit, optional
        Least radius of bends; in metres, an object without a curve in space is a warning, too.

    Raises
    ------
    InputError
        If an argument is of another type.
    """
    check_type("make", make, MessageFactory)
    check_type("result", result, FrameResult)
    check_text("name", name)
    values = {
        "frame": str(result.index),
        "detections": str(len(result.detections)),
        "tracks": str(len(result.tracks)),
        **{f"{stage} ms": f"{ms:.3f}" for stage, ms in result.stage_ms.items()},
        "pipeline ms": f"{result.total_ms:.3f}",
    }
    bends = []
    if limit is not None:
        reasons = dict.fromkeys(limit.unknown(result).values())
        bends = [*limit.violations(result), *(f"bends cannot be compared with {limit}: {why}" for why in reasons)]
    found = readable(result.reason) if result.reason else f"{len(result.tracks)} tracks"
    status = make(
        "diagnostic_msgs/msg/DiagnosticStatus",
        level=_OK if result.reason is None and not bends and not result.diagnosis else _WARN,
        name=name,
        message="; ".join((found, *bends, *map(readable, result.diagnosis))),
        values=[make("diagnostic_msgs/msg/KeyValue", key=key, value=value) for key, value in values.items()],
    )
    return make("diagnostic_msgs/msg/DiagnosticArray", header=header, status=[status])


def _rows(sample: SampledTrack, row: np.dtype[Any], dims: int) -> npt.NDArray[Any]:
    rows = np.zeros(len(sample.points), row)
    for axis, name in enumerate("xyz"[:dims]):
        rows[name] = sample.points[:, axis]
    rows["id"], rows["s"] = sample.track.id, sample.s
    rows["confidence"], rows["inferred"] = sample.track.confidence, sample.inferred
    return rows
