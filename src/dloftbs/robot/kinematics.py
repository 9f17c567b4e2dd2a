"""Joints of a robot, and where they put its links."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dloftbs.camera import rotation_about
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs.support.values import check_number

CONTINUOUS = "continuous"
TURNING, SLIDING, FIXED = ("revolute", CONTINUOUS), ("prismatic",), ("fixed",)
"""Types of joints, as URDF names them.

Source: by definition.
"""

DEFAULT_BASE = "base"
"""Name of the only link of a robot without joints."""

_FARTHEST = 1e6
"""Largest position of a joint, radians or metres."""


@dataclass(frozen=True, eq=False)
class RobotJoint:
    """A joint between two links.

    Parameters
    ----------
    name : str
    kind : str
        One of `TURNING`, `SLIDING` and `FIXED`.
    parent, child : str
        Names of links.
    origin : numpy.ndarray, shape (4, 4)
        Pose of the child in the parent where the joint's position is 0.
    axis : numpy.ndarray, shape (3,)
        Unit vector in the child's frame; of any length where the joint is fixed.
    mimic : (str, float, float), optional
        Joint that this one follows, a factor and an offset.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: FloatArray
    axis: FloatArray
    mimic: tuple[str, float, float] | None = None

    @property
    def moves(self) -> bool:
        """True if it has a position of its own."""
        return self.kind not in FIXED and self.mimic is None

    def pose(self, position: float) -> FloatArray:
        """Return the pose (4, 4) of the child in the parent."""
        motion = np.eye(4)
        if self.kind in TURNING:
            motion[:3, :3] = rotation_about(self.axis, position)
        elif self.kind in SLIDING:
            motion[:3, 3] = position * self.axis
        moved: FloatArray = self.origin @ motion
        return moved


def checked_axis(name: str, kind: str, axis: FloatArray) -> FloatArray:
    """Return the axis (3,) of a joint as a unit vector; exporters write zeros for fixed joints, which need none.

    Raises
    ------
    InputError
        If the joint moves and its axis has no length.
    """
    if kind in FIXED:
        return axis
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        raise InputError(f"the axis of joint {name} must have a length")
    return axis / length


def sort_joints(joints: Sequence[RobotJoint]) -> tuple[RobotJoint, ...]:
    """Return the joints from the base outwards; those that follow another one follow one with a position of its own.

    Raises
    ------
    InputError
        If a link has two parents, two joints have one name, there is more than one base, or joints run in a circle or
        follow each other in one.
    """
    children, names = [joint.child for joint in joints], [joint.name for joint in joints]
    for what, values in (("link is the child of two joints", children), ("joint has the name of another", names)):
        twice = sorted({value for value in values if values.count(value) > 1})
        if twice:
            raise InputError(f"a {what}: {', '.join(twice)}")
    bases = sorted({joint.parent for joint in joints} - {*children})
    if joints and len(bases) != 1:
        raise InputError(
            f"a robot must have one base, a link that is no joint's child; got {', '.join(bases) or 'none'}"
        )
    known, left, ordered = {*bases}, [*joints], []
    while ready := [joint for joint in left if joint.parent in known]:
        ordered += ready
        known |= {joint.child for joint in ready}
        left = [joint for joint in left if joint.child not in known]
    if left:
        raise InputError(f"joints run in a circle: {', '.join(joint.name for joint in left)}")
    mimics = {joint.name: joint.mimic for joint in joints if joint.mimic is not None}
    return tuple([replace(joint, mimic=_leader(joint.name, mimics)) if joint.mimic else joint for joint in ordered])


def _leader(name: str, mimics: Mapping[str, tuple[str, float, float]]) -> tuple[str, float, float]:
    """Return the joint at the end of a chain of joints that follow each other, and the factor and offset to it."""
    source, factor, offset = mimics[name]
    passed = [name]
    while source in mimics:
        passed.append(source)
        if source in passed[:-1]:
            raise InputError(f"joints follow each other in a circle: {', '.join(passed)}")
        source, further, shift = mimics[source]
        factor, offset = factor * further, factor * shift + offset
    return source, factor, offset


def place_links(joints: Sequence[RobotJoint], base: str, positions: Mapping[str, float]) -> dict[str, FloatArray]:
    """Return the pose (4, 4) of each link in the base, of joints as `sort_joints` has them.

    Raises
    ------
    InputError
        If a joint has no position, or one that is no finite number.
    """
    missing = [joint.name for joint in joints if joint.moves and joint.name not in positions]
    if missing:
        known = ", ".join(sorted(positions)) or "none"
        raise InputError(f"joints without a position: {', '.join(missing)}; there are positions of {known}")
    poses = {base: np.eye(4)}
    for joint in joints:
        poses[joint.child] = poses[joint.parent] @ joint.pose(_position(joint, positions))
    return poses


def _position(joint: RobotJoint, positions: Mapping[str, float]) -> float:
    if joint.kind in FIXED:
        return 0.0
    source, factor, offset = joint.mimic or (joint.name, 1.0, 0.0)
    if source not in positions:
        raise InputError(f"joint {joint.name} follows {source}, which has no position")
    return factor * check_number(f"position of joint {source}", positions[source], -_FARTHEST, _FARTHEST) + offset
