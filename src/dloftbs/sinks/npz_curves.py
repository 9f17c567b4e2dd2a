"""Curves as plain arrays for `numpy.load`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError, SourceError
from dloftbs.sinks._claims import Claim
from dloftbs.sinks._growing import Column, GrowingNpz
from dloftbs.sinks._rows import ObjectRow, object_rows
from dloftbs.sinks._safe_files import sink_errors
from dloftbs.sinks.sink import PathSink
from dloftbs.support.npy import BROKEN, read_members
from dloftbs.support.values import check_path

_MAX_BYTES = 1 << 30
"""Of a column that is read back: the control points of ten objects in each frame of an hour take half of it."""

# The headers are raised in this order; `frame` is last, so that all columns hold at least the rows that it counts.
_COLUMNS = (
    Column("knots", "<f8"),
    Column("knot_offsets", "<i8"),
    Column("control_points", "<f8", (2,)),
    Column("offsets", "<i8"),
    Column("knots_3d", "<f8"),
    Column("knot_offsets_3d", "<i8"),
    Column("control_points_3d", "<f8", (3,)),
    Column("offsets_3d", "<i8"),
    Column("n_control", "<i8"),
    Column("degree", "<i8"),
    Column("closed", "|b1"),
    Column("width_px", "<f8"),
    Column("confidence", "<f8"),
    Column("state", "<U12"),
    Column("stamp", "<f8"),
    Column("detection", "<i8"),
    Column("track_id", "<i8"),
    Column("frame", "<i8"),
)
_OFFSETS = {
    "knots": "knot_offsets",
    "control_points": "offsets",
    "knots_3d": "knot_offsets_3d",
    "control_points_3d": "offsets_3d",
}


class NpzSink(PathSink):
    """Writes every curve's knots and control points into one .npz of plain arrays.

    One row per object and frame: a result's tracks, or its detections where it has none. With M rows in all:

    ==================== ============ =====================================================================
    array                shape        content
    ==================== ============ =====================================================================
    frame                (M,) int     the frame's index
    stamp                (M,)         its time in seconds, NaN without one
    track_id             (M,) int     from 1; 0 where there are only detections
    detection            (M,) int     the detection's number in its frame from 0; -1 where a track has none
    state                (M,) str     the track's state; empty where there are only detections
    width_px, confidence (M,)         of the detection, NaN where a track has none
    degree, closed       (M,)         of the curve
    n_control            (M,) int     control points of the curve in the image
    knots                (sum,)       of all rows; row ``i`` has ``knots[knot_offsets[i]:knot_offsets[i + 1]]``
    control_points       (sum, 2) px  of all rows; row ``i`` has ``offsets[i]`` to ``offsets[i + 1]``
    knots_3d             (sum,)       likewise with ``knot_offsets_3d``; an empty span without a curve in space
    control_points_3d    (sum, 3) m   likewise with ``offsets_3d``
    ==================== ============ =====================================================================

    The file can be read by `numpy.load` at any moment, while it is written and whenever the process dies, with every
    frame for which `write` returned. (Killed within the microseconds in which a frame is made visible, columns may
    have that frame's rows already while ``frame``, always the last, has not: ``len(frame)`` counts the whole rows, and
    `read_npz` keeps to it.) The arrays grow in place in a file with spare room, which is copied to twice the room
    when it is used up: the cost is linear in the stream's length, and memory stays constant. `close` gives the room
    back and makes the checksums right, which numpy does not look at and ``unzip`` does.

    Parameters
    ----------
    path : str or Path
        The file; missing folders are made, an older file is replaced.

    Raises
    ------
    SinkError
        If the file cannot be opened.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path)
        self._ends = dict.fromkeys(_OFFSETS, 0)
        with sink_errors(self._path):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._claim = Claim(self._path)
            try:
                self._npz = GrowingNpz(self._path, _COLUMNS)
                empty = {column.name: np.empty((0, *column.row_shape), column.dtype) for column in _COLUMNS}
                self._npz.append(empty | {name: np.zeros(1, np.int64) for name in _OFFSETS.values()})
            except BaseException:
                self._claim.release()
                raise

    def _write(self, frame: Frame, result: FrameResult) -> None:
        rows = list(object_rows(result))
        if not rows:
            return
        arrays = _flat_arrays(rows, result)
        ends = dict(self._ends)
        for name, parts in _curve_arrays(rows).items():
            arrays[name] = np.concatenate(parts)
            arrays[_OFFSETS[name]] = ends[name] + np.cumsum([len(part) for part in parts])
            ends[name] += len(arrays[name])
        with sink_errors(self._path):
            self._npz.append(arrays)
        self._ends = ends

    def _close(self) -> None:
        with self._claim, sink_errors(self._path):
            self._npz.close()


def _flat_arrays(rows: list[ObjectRow], result: FrameResult) -> dict[str, npt.NDArray[Any]]:
    stamp = np.nan if result.stamp is None else result.stamp
    detections = [row.detection for row in rows]
    return {
        "frame": np.full(len(rows), result.index),
        "stamp": np.full(len(rows), stamp),
        "track_id": np.array([row.track_id for row in rows]),
        "detection": np.array([row.number for row in rows]),
        "state": np.array([row.state for row in rows]),
        "width_px": np.array([np.nan if d is None else d.width_px for d in detections]),
        "confidence": np.array([np.nan if d is None else d.confidence for d in detections]),
        "degree": np.array([row.curve.degree for row in rows]),
        "closed": np.array([row.curve.closed for row in rows]),
        "n_control": np.array([len(row.curve.control_points) for row in rows]),
    }


def _curve_arrays(rows: list[ObjectRow]) -> dict[str, list[npt.NDArray[np.float64]]]:
    none, none_3d = np.empty(0), np.empty((0, 3))
    in_space = [row.curve_3d for row in rows]
    return {
        "knots": [row.curve.knots for row in rows],
        "control_points": [row.curve.control_points for row in rows],
        "knots_3d": [none if curve is None else curve.knots for curve in in_space],
        "control_points_3d": [none_3d if curve is None else curve.control_points for curve in in_space],
    }


@dataclass(frozen=True)
class NpzRow:
    """One object in one frame, as a `NpzSink` wrote it.

    Parameters
    ----------
    frame : int
    stamp : float, optional
        Seconds.
    track_id : int, optional
        None where the frame had only detections.
    detection : int, optional
        The detection's number in its frame; None where a track had none.
    state : str, optional
        The track's state; None where the frame had only detections.
    curve : BSplineCurve
        In the image, px.
    curve_3d : BSplineCurve, optional
        In the camera's frame, metres.
    width_px, confidence : float, optional
        Of the detection.
    """

    frame: int
    stamp: float | None
    track_id: int | None
    detection: int | None
    state: str | None
    curve: BSplineCurve
    curve_3d: BSplineCurve | None
    width_px: float | None
    confidence: float | None


def read_npz(path: str | Path) -> list[NpzRow]:
    """Read back the curves that a `NpzSink` wrote.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    list of NpzRow
        One per object and frame, in the order in which they were written.

    Raises
    ------
    SourceError
        If the file cannot be read or is not what a `NpzSink` writes.
    """
    place = check_path("path", path)
    try:
        names = [column.name for column in _COLUMNS]
        found, arrays = read_members(place, names, _MAX_BYTES)
        if missing := [name for name in names if name not in found]:
            raise InputError(f"it lacks {', '.join(missing)}")
        return [_row(arrays, i) for i in range(len(arrays["frame"]))]
    except InputError as error:
        raise SourceError(f"{str(path)!r} holds no curves of a NpzSink: {error}") from error
    except BROKEN as error:
        raise SourceError(f"cannot read {str(path)!r}: {error}") from error


def _row(arrays: dict[str, npt.NDArray[Any]], i: int) -> NpzRow:
    track_id, detection = int(arrays["track_id"][i]), int(arrays["detection"][i])
    return NpzRow(
        frame=int(arrays["frame"][i]),
        stamp=_number(arrays["stamp"][i]),
        track_id=track_id or None,
        detection=detection if detection >= 0 else None,
        state=str(arrays["state"][i]) or None,
        curve=_curve(arrays, i, ""),
        curve_3d=_curve(arrays, i, "_3d") if arrays["offsets_3d"][i] < arrays["offsets_3d"][i + 1] else None,
        width_px=_number(arrays["width_px"][i]),
        confidence=_number(arrays["confidence"][i]),
    )


def _curve(arrays: dict[str, npt.NDArray[Any]], i: int, suffix: str) -> BSplineCurve:
    first, last = arrays[f"knot_offsets{suffix}"][i : i + 2]
    start, stop = arrays[f"offsets{suffix}"][i : i + 2]
    # A curve in space may have other knots than the one in the image, so its degree follows from its own.
    degree = int((last - first) - (stop - start) - 1)
    knots, control = arrays[f"knots{suffix}"][first:last], arrays[f"control_points{suffix}"][start:stop]
    return BSplineCurve(knots, control, degree, closed=bool(arrays["closed"][i]))


def _number(value: float) -> float | None:
    return None if np.isnan(value) else float(value)
