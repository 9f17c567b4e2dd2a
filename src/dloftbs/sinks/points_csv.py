"""Sampled points as a table, for spreadsheets and plotting tools."""

from __future__ import annotations

import math
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.spans import inside
from dloftbs.data.u_mapping import is_in_front, to_space
from dloftbs.errors import InputError
from dloftbs.sinks._rows import ObjectRow, object_rows
from dloftbs.sinks.sink import PathSink
from dloftbs.support.arrays import FloatArray
from dloftbs.support.safe_files import AppendFile
from dloftbs.support.values import check_flag

_OF_POINTS = {
    "i": "d",
    "u": ".6f",
    "x_px": ".3f",
    "y_px": ".3f",
    "inferred": "d",
    "u_3d": ".6f",
    "x_m": ".6f",
    "y_m": ".6f",
    "z_m": ".6f",
    "inferred_3d": "d",
    "tangent_x": ".6f",
    "tangent_y": ".6f",
    "tangent_x_3d": ".6f",
    "tangent_y_3d": ".6f",
    "tangent_z_3d": ".6f",
    "length_px": ".3f",
    "length_m": ".6f",
}
"""Columns of points, and how they are written."""

_OF_BENDS = {"bend_radius_px": ".3f", "bend_radius_m": ".6f"}
"""Columns that are written on request, and how."""

_OF_BRANCHES = ("harness", "branch")
_OF_OBJECTS = ("frame", "stamp", "object", "state")
HEADER = ",".join((*_OF_OBJECTS, *_OF_POINTS)) + "\n"


class CsvSink(PathSink):
    """Writes points at evenly spaced ``u`` of every object, a row each.

    A result's objects are its tracks, or its detections where it has none. The columns: ``frame`` the index; ``stamp``
    in seconds, empty where the frame has none; ``object`` the track's id, or the detection's number from 0; ``state``
    of the track, empty for a detection; ``i`` the point's number and ``u`` its parameter; ``x_px, y_px``; ``inferred``
    1 where this frame does not show the point (it lies across a gap of the mask, or the track remembers it), else 0.
    Then the same point in space, empty without a curve there: ``u_3d`` its parameter on that curve, which is the arc
    length in space and not that in the image; ``x_m, y_m, z_m``; ``inferred_3d`` 1 where this frame's depth does not
    show the point. Then the unit tangents towards growing ``u``, ``tangent_x, tangent_y`` in the image and
    ``tangent_x_3d, tangent_y_3d, tangent_z_3d`` in space. Last the lengths of the whole curves, ``length_px`` and
    ``length_m``.

    Each frame's rows are on their way to the disk before `write` returns: whenever the process dies, every frame
    written is whole.

    Parameters
    ----------
    path : str or Path
        The file; missing folders are made, an older file is replaced with the first frame.
    samples : int
        Points per object, at least 2.
    bends : bool
        Whether to write two columns more, the radius of the bend at each point: ``bend_radius_px`` in the image, and
        ``bend_radius_m`` in space, empty without a curve there; ``inf`` where it is straight.
    branches : bool
        Whether to write two columns more, of objects that branch: ``harness``, its id in a stream, else its number from
        0, and ``branch``, the number of the object among its branches; empty where it is none of this frame's.

    Raises
    ------
    InputError
        If `samples` is less than 2 or no integer.
    SinkError
        If the file cannot be opened or written.
    """

    def __init__(self, path: str | Path, samples: int = 100, *, bends: bool = False, branches: bool = False) -> None:
        super().__init__(path)
        self._u = _even(samples)
        self._bends = check_flag("bends", bends)
        self._branches = check_flag("branches", branches)
        more = (*(_OF_BENDS if bends else ()), *(_OF_BRANCHES if branches else ()))
        self._file = AppendFile(self._path, ",".join((HEADER.rstrip("\n"), *more)).encode() + b"\n")

    def _write(self, frame: Frame, result: FrameResult) -> None:
        stamp = "" if result.stamp is None else repr(float(result.stamp))
        branches = _branch_texts(result) if self._branches else {}
        nothing = ",," if self._branches else ""
        rows = "".join(
            _object_text(f"{result.index},{stamp}", row, self._u, self._bends, branches.get(row.number, nothing))
            for row in object_rows(result)
        )
        self._file.append(rows.encode())

    def _close(self) -> None:
        self._file.close()


def points_table(result: FrameResult, samples: int) -> Any:
    """Return a result as `FrameResult.to_dataframe` says."""
    u = _even(samples)
    try:
        pandas = import_module("pandas")
    except ImportError as error:
        raise InputError("a table needs pandas: pip install pandas") from error
    rows = list(object_rows(result))
    of_objects = (
        np.full(len(rows), result.index),
        np.full(len(rows), np.nan if result.stamp is None else result.stamp),
        np.array([row.name for row in rows], np.int64),
        np.array([row.state for row in rows], object),
    )
    points = [_points(row, u) for row in rows] or [dict.fromkeys(_OF_POINTS, np.empty(0))]
    columns = {name: np.repeat(values, samples) for name, values in zip(_OF_OBJECTS, of_objects, strict=True)}
    return pandas.DataFrame(columns | {name: np.concatenate([part[name] for part in points]) for name in _OF_POINTS})


def _even(samples: int) -> FloatArray:
    if isinstance(samples, bool) or not isinstance(samples, int) or samples < 2:
        raise InputError(f"samples must be an integer of at least 2, got {samples!r}")
    return np.linspace(0.0, 1.0, samples)


def _branch_texts(result: FrameResult) -> dict[int, str]:
    """Return the last columns of each detection that is a branch, by its number."""
    return {
        detection: f",{number if harness.id is None else harness.id},{branch}"
        for number, harness in enumerate(result.harnesses)
        for branch, detection in enumerate(harness.branches)
    }


def _object_text(moment: str, row: ObjectRow, u: FloatArray, bends: bool, end: str) -> str:
    start = f"{moment},{row.name},{row.state}"
    points = _points(row, u) | (_bends(row, u) if bends else {})
    forms = _OF_POINTS | (_OF_BENDS if bends else {})
    columns = [[_text(value, form) for value in points[name].tolist()] for name, form in forms.items()]
    return "".join([f"{start},{','.join(line)}{end}\n" for line in zip(*columns, strict=True)])


def _text(value: float, form: str) -> str:
    return "" if math.isnan(value) else format(value, form)


def _points(row: ObjectRow, u: FloatArray) -> dict[str, npt.NDArray[Any]]:
    """Return the columns of the points at `u` (n,) of an object; NaN in space where it has no curve there."""
    points, tangents = row.curve(u), row.curve.tangent(u)
    in_image = (np.arange(len(u)), u, *points.T, inside(u, row.source.inferred).astype(np.int64))
    length = np.full(len(u), row.curve.length)
    if row.curve_3d is None:
        nothing = np.full(len(u), np.nan)
        return dict(
            zip(_OF_POINTS, (*in_image, *[nothing] * 5, *tangents.T, *[nothing] * 3, length, nothing), strict=True)
        )
    at = _u_in_space(row, row.curve_3d, u)
    in_space = (at, *row.curve_3d(at).T, inside(at, row.source.inferred_3d).astype(np.int64))
    lengths = length, np.full(len(u), row.curve_3d.length)
    values = (*in_image, *in_space, *tangents.T, *row.curve_3d.tangent(at).T, *lengths)
    return dict(zip(_OF_POINTS, values, strict=True))


def _bends(row: ObjectRow, u: FloatArray) -> dict[str, npt.NDArray[Any]]:
    """Return the radii of the bends at `u` (n,) of an object; NaN in space where it has no curve there."""
    one = row.source
    nothing = np.full(len(u), np.nan)
    in_space = nothing if row.curve_3d is None else one.bend_radius_3d(_u_in_space(row, row.curve_3d, u))
    return dict(zip(_OF_BENDS, (one.bend_radius(u), in_space), strict=True))


def _u_in_space(row: ObjectRow, curve_3d: BSplineCurve, u: FloatArray) -> FloatArray:
    """Return the parameters (n,) in space of the points that are at `u` in the image."""
    if row.camera is None or not is_in_front(curve_3d):
        return u
    return to_space(u, curve_3d, row.camera)
