"""Sampled points as a table, for spreadsheets and plotting tools."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.curve import BSplineCurve
from dloftbs.errors import InputError
from dloftbs.frame import Frame
from dloftbs.frame_result import FrameResult
from dloftbs.sinks._rows import ObjectRow, inside, object_rows
from dloftbs.sinks._safe_files import AppendFile
from dloftbs.sinks.sink import PathSink
from dloftbs.u_mapping import is_in_front, to_space

HEADER = (
    "frame,stamp,object,state,i,u,x_px,y_px,inferred,u_3d,x_m,y_m,z_m,inferred_3d,"
    "tangent_x,tangent_y,tangent_x_3d,tangent_y_3d,tangent_z_3d\n"
)


class CsvSink(PathSink):
    """Writes points at evenly spaced ``u`` of every object, a row each.

    A result's objects are its tracks, or its detections where it has none. The columns: ``frame`` the index; ``stamp``
    in seconds, empty where the frame has none; ``object`` the track's id, or the detection's number from 0; ``state``
    of the track, empty for a detection; ``i`` the point's number and ``u`` its parameter; ``x_px, y_px``; ``inferred``
    1 where the point was not seen in this frame (it lies across a gap of the mask, or the track is hidden), else 0.
    Then the same point in space, empty without a curve there: ``u_3d`` its parameter on that curve, which is the arc
    length in space and not that in the image; ``x_m, y_m, z_m``; ``inferred_3d`` 1 where depth was bridged, not
    measured. Last the unit tangents towards growing ``u``, ``tangent_x, tangent_y`` in the image and ``tangent_x_3d,
    tangent_y_3d, tangent_z_3d`` in space.

    Each frame's rows are on their way to the disk before `write` returns: whenever the process dies, every frame
    written is whole.

    Parameters
    ----------
    path : str or Path
        The file; missing folders are made, an older file is replaced.
    samples : int
        Points per object, at least 2.

    Raises
    ------
    InputError
        If `samples` is less than 2 or no integer.
    SinkError
        If the file cannot be opened or written.
    """

    def __init__(self, path: str | Path, samples: int = 100) -> None:
        super().__init__(path)
        if isinstance(samples, bool) or not isinstance(samples, int) or samples < 2:
            raise InputError(f"samples must be an integer of at least 2, got {samples!r}")
        self._u = np.linspace(0.0, 1.0, samples)
        self._file = AppendFile(self._path)
        try:
            self._file.append(HEADER.encode())
        except BaseException:
            self._file.close()
            raise

    def _write(self, frame: Frame, result: FrameResult) -> None:
        stamp = "" if result.stamp is None else repr(float(result.stamp))
        rows = "".join(_object_text(f"{result.index},{stamp}", row, self._u) for row in object_rows(result))
        self._file.append(rows.encode())

    def _close(self) -> None:
        self._file.close()


def _object_text(moment: str, row: ObjectRow, u: FloatArray) -> str:
    start = f"{moment},{row.track_id or row.number},{row.state}"
    inferred = _inferred(None if row.detection is None else row.detection.inferred, u)
    in_image = zip(u, row.curve(u), inferred, row.curve.tangent(u), strict=True)
    lines = [
        f"{start},{i},{t:.6f},{x:.3f},{y:.3f},{guess:d},{place},{dx:.6f},{dy:.6f},{way}\n"
        for i, ((t, (x, y), guess, (dx, dy)), (place, way)) in enumerate(zip(in_image, _in_space(row, u), strict=True))
    ]
    return "".join(lines)


def _in_space(row: ObjectRow, u: FloatArray) -> list[tuple[str, str]]:
    """Return the columns of the curve in space, and those of its tangents."""
    if row.curve_3d is None:
        return [(",,,,", ",,")] * len(u)
    at = _u_in_space(row, row.curve_3d, u)
    inferred = _inferred(None if row.detection is None else row.detection.inferred_3d, at)
    columns = zip(at, row.curve_3d(at), inferred, row.curve_3d.tangent(at), strict=True)
    return [
        (f"{t:.6f},{x:.6f},{y:.6f},{z:.6f},{guess:d}", f"{dx:.6f},{dy:.6f},{dz:.6f}")
        for t, (x, y, z), guess, (dx, dy, dz) in columns
    ]


def _u_in_space(row: ObjectRow, curve_3d: BSplineCurve, u: FloatArray) -> FloatArray:
    """Return the parameters (n,) in space of the points that are at `u` in the image."""
    if row.camera is None or not is_in_front(curve_3d):
        return u
    return to_space(u, curve_3d, row.camera)


def _inferred(spans: Sequence[tuple[float, float]] | None, u: FloatArray) -> list[bool]:
    """Return which points were not seen; without a detection, none was."""
    return [True] * len(u) if spans is None else [bool(value) for value in inside(u, spans)]
