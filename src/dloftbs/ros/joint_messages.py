"""Positions of a robot's joints from messages, and from a recording of them."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import Any

import numpy as np

from dloftbs.errors import InputError, SourceError
from dloftbs.robot import JointStates
from dloftbs.ros.message_fields import NS_PER_S, field_of, stamp_ns_of
from dloftbs.ros.message_types import MessageTypes
from dloftbs.ros.recording import Recording
from dloftbs.ros.stamp_pairing import RESTART_S
from dloftbs.support.arrays import FloatArray

logger = logging.getLogger("dloftbs.sources")

JOINT_TYPE = "sensor_msgs/msg/JointState"


class JointRows:
    """Positions of joints from messages of ``sensor_msgs/JointState``, as they come.

    Messages may hold some of the joints each, as of an arm and its gripper.

    Parameters
    ----------
    keep_s : float
        Time that is kept before the newest position of each joint; where time goes back by more than `RESTART_S`,
        nothing before that is kept. Without it, all is kept.
    """

    def __init__(self, keep_s: float = math.inf) -> None:
        self._keep_s = keep_s
        self._restart_s = RESTART_S if math.isfinite(keep_s) else math.inf
        self._rows: dict[str, dict[float, float]] = {}

    def take(self, message: Any, stamp_ns: int) -> None:
        """Take the positions of a message, whatever library made it, at the time of its header.

        Parameters
        ----------
        message : sensor_msgs/JointState
        stamp_ns : int
            Time where the header has none.

        Raises
        ------
        InputError
            If the positions are neither as many as the names nor none, or one is not finite.
        """
        time = (stamp_ns_of(message) or stamp_ns) / NS_PER_S
        names, places = field_of(message, "name"), np.asarray(field_of(message, "position"), np.float64)
        if len(places) not in (0, len(names)) or not np.isfinite(places).all():
            raise InputError(f"a JointState has {len(names)} names and {len(places)} positions, or one is not finite")
        for name, place in zip(names, places.tolist(), strict=False):  # drivers may leave all positions out
            row = self._rows.setdefault(name, {})
            if row and next(reversed(row)) - time > self._restart_s:
                row.clear()
            row[time] = place
            while (first := next(iter(row))) < time - self._keep_s:
                del row[first]

    def states(self) -> JointStates | None:
        """Return the joints, each at the times of its own messages, or None where none came."""
        if not self._rows:
            return None
        return JointStates({name: _sorted(row) for name, row in self._rows.items()})


def _sorted(row: dict[float, float]) -> tuple[FloatArray, FloatArray]:
    times = np.fromiter(row, np.float64, len(row))
    order = np.argsort(times, kind="stable")  # quick for what is sorted but for little
    return times[order], np.fromiter(row.values(), np.float64, len(row))[order]


def read_joints(path: str | Path, topic: str) -> JointStates:
    """Return the joints of a topic of ``sensor_msgs/JointState``, at the times of their headers.

    A message that cannot be read is left out; the first is named in a warning.

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
        states = _read(recording, topic).states()
    finally:
        recording.close()
    if states is None:
        raise SourceError(f"{path}: no message of {topic} holds the position of a joint")
    return states


def _read(recording: Recording, topic: str) -> JointRows:
    types, rows, has_failed = MessageTypes(is_ros1=recording.is_ros1), JointRows(), False
    for raw in recording.messages({topic}):
        try:
            rows.take(types.read(raw.data, JOINT_TYPE), raw.stamp_ns)
        except InputError as error:
            if not has_failed:
                logger.warning("%s: a message of %s is left out: %s", recording.path, topic, error)
            has_failed = True
    return rows
