"""Grippers: places on a robot at which cables are held."""

from __future__ import annotations

from dataclasses import dataclass

from dloftbs.support.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class RobotGripper:
    """Place on a link at which cables are held.

    Parameters
    ----------
    link : str
    point : numpy.ndarray, shape (3,)
        In the link's frame, metres.
    radius_m : float
        A cable's end this near is held.
    joint : str, optional
        Joint that opens the gripper; without one, it always holds.
    closed_below : float
        Position of the joint below which it holds.
    """

    link: str
    point: FloatArray
    radius_m: float
    joint: str | None = None
    closed_below: float = 0.0
