"""Branch points: places at which ends of branches meet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dloftbs.data.centerline import Point
from dloftbs.errors import InputError
from dloftbs.support.arrays import LARGEST
from dloftbs.support.values import (
    MAX_WHOLE,
    check_integer,
    check_number,
    check_pair,
    list_of,
    set_fields,
    shown,
    values_of,
)

End = tuple[int, int]
"""End of a branch: the index of its detection in `FrameResult.detections`, and the end's ``u``, 0 or 1."""


@dataclass(frozen=True)
class BranchPoint:
    """Place at which three or more ends of branches meet.

    Parameters
    ----------
    position : (float, float)
        ``(x, y)`` px.
    members : tuple of (int, int)
        Ends that meet there, as ``(detection, end)``: the index of a detection in `FrameResult.detections`, and 0 or 1,
        the ``u`` of its end.
    confidence : float
        Probability that it is a branch point, in 0..1.
    position_3d : (float, float, float), optional
        In the camera's frame, metres; None where there is no depth.
    id : int, optional
        Number of it in a stream, from 1 on, never used again; None in a frame by itself.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    position: Point
    members: tuple[End, ...]
    confidence: float
    position_3d: tuple[float, float, float] | None = None
    id: int | None = None

    def __post_init__(self) -> None:
        set_fields(
            self,
            position=check_pair("position", self.position, -LARGEST, LARGEST),
            members=tuple([check_end("a member", one) for one in list_of("members", self.members)]),
            confidence=check_number("confidence", self.confidence, 0.0, 1.0),
            position_3d=None if self.position_3d is None else _in_space(self.position_3d),
            id=None if self.id is None else check_integer("id", self.id, 1, MAX_WHOLE),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "id": self.id,
            "position": list(self.position),
            "position_3d": None if self.position_3d is None else list(self.position_3d),
            "members": [{"detection": detection, "end": end} for detection, end in self.members],
            "confidence": self.confidence,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> BranchPoint:
        """Build a branch point from what `to_dict` gave, without loss.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        keys = "id", "position", "position_3d", "members", "confidence"
        number, position, position_3d, rows, confidence = values_of("a branch point", data, *keys)
        members = tuple([tuple(values_of("a member", row, "detection", "end")) for row in list_of("members", rows)])
        return cls(position, members, confidence, position_3d, number)


def check_end(name: str, value: object) -> End:
    """Return an end ``(detection, end)``, checked.

    Raises
    ------
    InputError
        If it is none.
    """
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise InputError(f"{name} must be (detection, end), got {shown(value)}")
    return check_integer(f"detection of {name}", value[0], 0, MAX_WHOLE), check_integer(
        f"end of {name}", value[1], 0, 1
    )


def _in_space(value: object) -> tuple[float, float, float]:
    if not isinstance(value, (tuple, list)) or len(value) != 3:
        raise InputError(f"position_3d must be (x, y, z), got {shown(value)}")
    x, y, z = [check_number("position_3d", one, -LARGEST, LARGEST) for one in value]
    return x, y, z
