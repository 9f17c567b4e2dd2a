"""Objects with a curve in space, for the sinks that write nothing but those."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import NamedTuple

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.object_shape import width_in_space
from dloftbs.errors import InputError, SinkError
from dloftbs.sinks._rows import ObjectRow, object_rows

logger = logging.getLogger("dloftbs.sinks")


class SpaceObject(NamedTuple):
    """One object in one frame, with its detection and its curve in space, metres."""

    row: ObjectRow
    detection: Detection
    curve: BSplineCurve

    @property
    def name(self) -> str:
        """Name of the object in a scene: ``cable_3`` for a track, else ``detection_0``; a loop's ends in ``_loop``."""
        name = f"cable_{self.row.track_id}" if self.row.track_id else f"detection_{self.row.number}"
        return f"{name}_loop" if self.curve.closed else name

    @property
    def order(self) -> int:
        """Number of the object's colour in overlays."""
        return self.row.track_id - 1 if self.row.track_id else self.row.number

    def radius_m(self, camera: PinholeCamera | None) -> float:
        """Return half the width in space that the width in the image has there.

        Parameters
        ----------
        camera : PinholeCamera, optional
            Of the frame; the object's own where there is none.

        Raises
        ------
        InputError
            If there is neither, or the camera does not see the curve.
        """
        camera = camera or self.row.camera
        if camera is None:
            raise InputError("the radius of a tube needs the frame's camera, or radius_m; got neither")
        width_m = width_in_space(self.detection.width_px, self.curve, camera)
        if width_m is None:
            raise InputError(
                f"the radius of {self.name} is not known, since no part of its curve is in front of the frame's camera "
                "and in the field of its lens; give radius_m, or the camera that the curve was seen by"
            )
        return 0.5 * width_m


def check_radius(radius_m: float | None) -> float | None:
    """Return the radius that replaces those measured.

    Raises
    ------
    InputError
        If it is no positive number.
    """
    if radius_m is not None and not 0.0 < radius_m < math.inf:
        raise InputError(f"radius_m must be a positive number, got {radius_m!r}")
    return radius_m


class SpaceObjects:
    """Chooses the objects of results that have a curve in space, counts the others and says why they have none.

    Hidden tracks are left out without a word, since nothing of them is seen.

    Parameters
    ----------
    path : Path
        Output, for messages.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._frames = self._objects = self._left_out = 0
        self._first_reason = ""

    def of(self, result: FrameResult) -> list[SpaceObject]:
        """Return the objects of a result; the first one in the stream that is left out is a warning in the log."""
        found = []
        self._frames += 1
        for row in object_rows(result):
            if row.detection is None:
                continue
            self._objects += 1
            if row.curve_3d is None:
                self._leave_out(row, row.detection, result)
            else:
                found.append(SpaceObject(row, row.detection, row.curve_3d))
        return found

    def _leave_out(self, row: ObjectRow, detection: Detection, result: FrameResult) -> None:
        self._left_out += 1
        if self._left_out == 1:
            self._first_reason = detection.no_3d_reason or "nobody said why"
            logger.warning(
                "frame %d: object %d is not in %s, since it has no curve in space: %s",
                result.index,
                row.name,
                self._path.name,
                self._first_reason,
            )

    def check(self) -> None:
        """Count in a warning what was left out.

        Raises
        ------
        SinkError
            If there were frames, and no object had a curve in space.
        """
        if self._frames and self._objects == self._left_out:
            raise SinkError(f"nothing was written to {str(self._path)!r}: {self._why_empty()}")
        if self._left_out > 1:
            logger.warning(
                "%s lacks %d of %d objects, since they have no curve in space",
                self._path.name,
                self._left_out,
                self._objects,
            )

    def _why_empty(self) -> str:
        frames = "the frame" if self._frames == 1 else f"the {self._frames} frames"
        if self._left_out == 0:
            return f"{frames} showed no object that could have a curve in space"
        return (
            f"no object in {frames} has a curve in space: {self._first_reason}. Curves in space need depth and the "
            "camera's intrinsics (Frame.depth and Frame.camera, --depth and --camera)"
        )
