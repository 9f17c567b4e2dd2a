"""Curves as plain arrays for `numpy.load`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.data.branch_point import BranchPoint
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError, SourceError
from dloftbs.sinks._rows import ObjectRow, object_rows
from dloftbs.sinks.sink import PathSink
from dloftbs.support.npy import BROKEN, read_members
from dloftbs.support.safe_files import claim_replaceable, replacing, sink_errors
from dloftbs.support.values import check_path

_MAX_BYTES = 1 << 30
"""Of a column that is read back: the control points of ten objects in each frame of an hour take half of it."""

_SPANS = {
    "knots": ("knot_offsets", ()),
    "control_points": ("offsets", (2,)),
    "knots_3d": ("knot_offsets_3d", ()),
    "control_points_3d": ("offsets_3d", (3,)),
}
"""Arrays of which each row has a span, with the array of where the spans begin and the shape of an element."""
_VALUES = {
    "n_control": "<i8",
    "degree": "<i8",
    "closed": "|b1",
    "width_px": "<f8",
    "confidence": "<f8",
    "state": "<U12",
    "stamp": "<f8",
    "detection": "<i8",
    "track_id": "<i8",
    "frame": "<i8",
}
"""Arrays with a value of each row, with their types."""
_NO_KNOTS, _NO_POINTS = np.empty(0), np.empty((0, 3))


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

    Where objects branch, there are K branch points, too, and the harness of each row:

    ======================= =========== ====================================================================
    harness                 (M,) int    id of its harness in a stream, else its number from 0; -1 without one
    branch_point_frame      (K,) int    the frame's index
    branch_point_id         (K,) int    from 1; 0 in a frame by itself
    branch_point            (K, 2) px   its position
    branch_point_3d         (K, 3) m    likewise, NaN without depth
    branch_point_confidence (K,)
    branch_point_members    (sum, 2)    numbers of the detections that meet there, and the ends by which, 0 or 1
    branch_point_offsets    (K + 1,)    point ``i`` has members ``branch_point_offsets[i]`` to the next
    ======================= =========== ====================================================================

    All rows stay in memory until `close` writes the file, as a whole or not at all, also where an exception ends the
    block. A process that is killed before leaves no file, or the older one as it was: for streams of many hours, and
    where every frame must survive, take JSON lines.

    Parameters
    ----------
    path : str or Path
        The file; missing folders are made, an older file is replaced, unless no frame came.

    Raises
    ------
    SinkError
        If the file cannot be written.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path)
        self._rows: list[dict[str, Any]] = []
        self._harness_of: list[int] = []
        self._branch_points: list[tuple[int, BranchPoint]] = []
        self._is_branched = False
        self._claim = claim_replaceable(self._path)

    def _write(self, frame: Frame, result: FrameResult) -> None:
        rows = [_row_of(row, result) for row in object_rows(result)]
        harness_of = {
            number: at if one.id is None else one.id
            for at, one in enumerate(result.harnesses)
            for number in one.branches
        }
        self._rows += rows  # the whole frame, or nothing after Ctrl-C
        self._harness_of += [harness_of.get(row["detection"], -1) for row in rows]
        self._branch_points += [(result.index, point) for point in result.branch_points]
        self._is_branched |= bool(result.harnesses)

    def _close(self) -> None:
        with self._claim, sink_errors(self._path):
            if not self._keeps_older:
                self._write_all()

    def _write_all(self) -> None:
        with replacing(self._path) as temporary, temporary.open("wb") as file:
            more = _branch_arrays(self._harness_of, self._branch_points) if self._is_branched else {}
            np.savez(file, **_arrays(self._rows), **more)


def _row_of(row: ObjectRow, result: FrameResult) -> dict[str, Any]:
    """Return an object in a frame, in the terms of the arrays."""
    curve, in_space, detection = row.curve, row.curve_3d, row.detection
    return {
        "knots": curve.knots,
        "control_points": curve.control_points,
        "knots_3d": _NO_KNOTS if in_space is None else in_space.knots,
        "control_points_3d": _NO_POINTS if in_space is None else in_space.control_points,
        "n_control": len(curve.control_points),
        "degree": curve.degree,
        "closed": curve.closed,
        "width_px": np.nan if detection is None else detection.width_px,
        "confidence": np.nan if detection is None else detection.confidence,
        "state": row.state,
        "stamp": np.nan if result.stamp is None else result.stamp,
        "detection": row.number,
        "track_id": row.track_id,
        "frame": result.index,
    }


def _arrays(rows: list[dict[str, Any]]) -> dict[str, Any]:
    arrays: dict[str, Any] = {}
    for name, (offsets, shape) in _SPANS.items():
        parts = [row[name] for row in rows]
        arrays[name] = np.concatenate([np.empty((0, *shape)), *parts])
        arrays[offsets] = np.cumsum([0, *map(len, parts)], dtype="<i8")
    for name, kind in _VALUES.items():
        arrays[name] = np.array([row[name] for row in rows], kind)
    return arrays


def _branch_arrays(harness_of: list[int], points: list[tuple[int, BranchPoint]]) -> dict[str, Any]:
    """Return the arrays of objects that branch."""
    nowhere = (np.nan,) * 3
    return {
        "harness": np.array(harness_of, "<i8"),
        "branch_point_frame": np.array([frame for frame, _ in points], "<i8"),
        "branch_point_id": np.array([one.id or 0 for _, one in points], "<i8"),
        "branch_point": np.array([one.position for _, one in points], "<f8").reshape(-1, 2),
        "branch_point_3d": np.array([one.position_3d or nowhere for _, one in points], "<f8").reshape(-1, 3),
        "branch_point_confidence": np.array([one.confidence for _, one in points], "<f8"),
        "branch_point_members": np.array([end for _, one in points for end in one.members], "<i8").reshape(-1, 2),
        "branch_point_offsets": np.cumsum([0, *[len(one.members) for _, one in points]], dtype="<i8"),
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
        names = [*_SPANS, *(offsets for offsets, _ in _SPANS.values()), *_VALUES]
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
