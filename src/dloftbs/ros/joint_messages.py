"""Positions of a robot's joints from a recording."""

from __future__ import annotations

import logging
from collections import defaultdict
from pathlib import Path

import numpy as np

from dloftbs.errors import InputError, SourceError
from dloftbs.robot import JointStates
from dloftbs.ros.message_fields import NS_PER_S, field_of, stamp_ns_of
from dloftbs.ros.message_types import MessageTypes
from dloftbs.ros.recording import Recording

logger = logging.getLogger("dloftbs.sources")

JOINT_TYPE = "sensor_msgs/msg/JointState"


def read_joints(path: str | Path, topic: str) -> JointStates:
    """Return the joints of a topic of ``sensor_msgs/JointState``, at the times of their headers.

    Messages may hold some of the joints each, as of an arm and its gripper. One that cannot be read is left out; the
    first is named in a warning.

    Raises
    ------
    SourceError
        If the recording cannot be read, or has no such topic, or no joints on it.
    """
    recording = Recording(path)
    try:
        known = [found.name for found in recording.topics if found.type_name == JOINT_TYPE]
        if topic not in known:
            listed = ", ".join(known) or "none"
            raise SourceError(f"{path}: there are no joints on {topic!r}; topics of JointState are: {listed}")
        rows = _rows(recording, topic)
    finally:
        recording.close()
    times = np.unique([time for row in rows.values() for time in row])
    if not len(times):
        raise SourceError(f"{path}: no message of {topic} holds the position of a joint")
    positions = {}
    for name, row in rows.items():
        keys = sorted(row)
        positions[name] = np.interp(times, keys, [row[key] for key in keys])
    return JointStates(times, positions)


def _rows(recording: Recording, topic: str) -> dict[str, dict[float, float]]:
    """Return the positions of each joint by time, seconds."""
    types = MessageTypes(is_ros1=recording.is_ros1)
    rows: dict[str, dict[float, float]] = defaultdict(dict)
    has_failed = False
    for raw in recording.messages({topic}):
        try:
            message = types.read(raw.data, JOINT_TYPE)
            stamp_ns = stamp_ns_of(message) or raw.stamp_ns
            names, places = field_of(message, "name"), np.asarray(field_of(message, "position"), np.float64)
            if len(places) not in (0, len(names)) or not np.isfinite(places).all():
                raise InputError(
                    f"a JointState has {len(names)} names and {len(places)} positions, or one is not finite"
                )
        except InputError as error:
            if not has_failed:
                logger.warning("%s: a message of %s is left out: %s", recording.path, topic, error)
            has_failed = True
            continue
        for name, place in zip(names, places.tolist(), strict=False):  # drivers may leave all positions out
            rows[name][stamp_ns / NS_PER_S] = place
    return rows
