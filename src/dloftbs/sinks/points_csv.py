"""Sampled points as a table, for spreadsheets and plotting tools."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.errors import InputError
from dloftbs.frame import Frame, FrameResult
from dloftbs.sinks._files import AppendFile
from dloftbs.sinks._rows import ObjectRow, object_rows
from dloftbs.sinks.base import PathSink

HEADER = "frame,stamp,object,state,i,u,x_px,y_px,x_m,y_m,z_m,inferred\n"


class CsvSink(PathSink):
    """Writes points at evenly spaced ``u`` of every object, a row each.

    A result's objects are its tracks, or its detections where it has none. The columns: ``frame`` the index; ``stamp``
    in seconds, empty where the frame has none; ``object`` the track's id, or the detection's number from 0; ``state``
    of the track, empty for a detection; ``i`` the point's number and ``u`` its parameter; ``x_px, y_px``; ``x_m, y_m,
    z_m``, empty without a curve in space; ``inferred`` 1 where the point was not seen in this frame (it lies across a
    gap of the mask, or the track coasts), else 0.

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
    metres = [",,"] * len(u) if row.curve_3d is None else [f"{x:.6f},{y:.6f},{z:.6f}" for x, y, z in row.curve_3d(u)]
    points = zip(u, row.curve(u), metres, _inferred(row, u), strict=True)
    lines = [f"{start},{i},{t:.6f},{x:.3f},{y:.3f},{m},{guess:d}\n" for i, (t, (x, y), m, guess) in enumerate(points)]
    return "".join(lines)


def _inferred(row: ObjectRow, u: FloatArray) -> list[bool]:
    if row.detection is None:
        return [True] * len(u)
    spans = row.detection.inferred
    return [any(low < t < high for low, high in spans) for t in u.tolist()]
