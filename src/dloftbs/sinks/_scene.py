"""Base of the sinks that write cables as the scene of a simulator."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy.typing as npt

from dloftbs.camera import as_pose
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.sinks._in_space import SpaceObject, SpaceObjects, check_radius
from dloftbs.sinks.sink import PathSink
from dloftbs.support.arrays import FloatArray
from dloftbs.support.safe_files import claim_replaceable


class SceneSink(PathSink):
    """A sink of one file with a scene in the camera's frame, or with a pose in the world.

    Parameters
    ----------
    path : str or Path
    radius_m : float, optional
        Of all cables.
    pose : array_like, shape (4, 4), or mapping, optional
        Pose of the camera in the world.

    Raises
    ------
    InputError
        If the suffix is another or an argument is wrong.
    SinkError
        If the file cannot be written.
    """

    _suffix: str
    _what: str

    def __init__(
        self, path: str | Path, *, radius_m: float | None = None, pose: npt.ArrayLike | Mapping[str, Any] | None = None
    ) -> None:
        super().__init__(path)
        if self._path.suffix.lower() != self._suffix:
            raise InputError(f"{self._what}'s name must end in {self._suffix}, got {str(path)!r}")
        self._radius_m = check_radius(radius_m)
        self._pose = None if pose is None else as_pose("pose", pose)
        self._in_space = SpaceObjects(self._path)
        self._claim = claim_replaceable(self._path)

    def _placed(self, points: FloatArray) -> FloatArray:
        """Return points (n, 3) of the camera's frame in the scene."""
        return points if self._pose is None else points @ self._pose[:3, :3].T + self._pose[:3, 3]

    def _radius_of(self, one: SpaceObject, frame: Frame) -> float:
        """Return the radius of a cable, metres: that of all cables, or its own."""
        return self._radius_m or one.radius_m(frame.camera)

    @property
    def _frame_text(self) -> str:
        """Name of the coordinate frame for people."""
        return "the camera's frame: x right, y down, z forward" if self._pose is None else "the world, z upwards"
