"""Positions of a robot's joints through time, from a CSV file."""

from __future__ import annotations

import array
import csv
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, source_errors
from dloftbs.robot.robot_model import RobotModel
from dloftbs.support.arrays import FloatArray
from dloftbs.support.documents import read_lines
from dloftbs.support.values import check_path

_FIRST = ("time", "frame")


class JointStates:
    """Positions of joints, each at times or in frames of its own.

    Parameters
    ----------
    rows : mapping of str to (numpy.ndarray, numpy.ndarray), each of shape (n,)
        By the joints' names: times in seconds, on the clock of the frames' stamps, or the frames' indices, which rise;
        and the positions there, radians or metres.
    by_frame : bool
        Whether positions belong to indices.

    Raises
    ------
    InputError
        If a joint has no position, or its times do not rise.
    """

    def __init__(self, rows: Mapping[str, tuple[FloatArray, FloatArray]], *, by_frame: bool = False) -> None:
        what = "frames" if by_frame else "times"
        for keys, _ in rows.values():
            if not len(keys) or not np.isfinite(keys).all() or (np.diff(keys) <= 0.0).any():
                raise InputError(f"{what} of joints must be one or more, and rise from row to row")
        self._rows, self._by_frame = dict(rows), by_frame
        # What is farther from the next row than this is not known: a row was left out, or the recording had ended.
        self._gaps = {
            name: 0.0 if by_frame else 1.5 * float(np.median(np.diff(keys))) if len(keys) > 1 else math.inf
            for name, (keys, _) in rows.items()
        }

    def __repr__(self) -> str:
        return f"JointStates({', '.join(f'{name}: {len(keys)} rows' for name, (keys, _) in self._rows.items())})"

    @classmethod
    def from_csv(cls, path: str | Path) -> JointStates:
        """Read joints from a CSV file: a column ``time`` (seconds) or ``frame``, and one of the name of each joint.

        Raises
        ------
        SourceError
            If the file cannot be read or says something else.
        """
        place = check_path("path", path)
        with source_errors(place, (InputError, csv.Error)):
            reader = csv.reader(read_lines(place))
            rows = (row for row in reader if row)
            header = [name.strip() for name in next(rows, [])]
            if len(header) < 2 or header[0] not in _FIRST or len({*header}) < len(header):
                raise InputError(
                    "joints need a header: time (seconds) or frame, then the name of each joint; "
                    f"got {','.join(header) or 'nothing'}"
                )
            table = array.array("d")
            for row in rows:
                table.extend(_numbers(row, reader.line_num, len(header)))
            columns = np.array(table).reshape(-1, len(header)).T.copy()
            positions = {name: (columns[0], column) for name, column in zip(header[1:], columns[1:], strict=True)}
            return cls(positions, by_frame=header[0] == "frame")

    def at(self, frame: Frame, robot: RobotModel) -> dict[str, float] | None:
        """Return the positions when a frame was taken, between two rows in proportion.

        A continuous joint turns the short way from row to row.
        A joint's position is unknown before its first row and after its last by more than one and a half steps of its
        rows, and in gaps of more than three. With a single row, it stays where that says. Frames are found by their
        index alone.

        Returns
        -------
        dict of str to float, or None
            Of all joints whose positions are known; None where that of one which the robot needs is unknown.

        Raises
        ------
        InputError
            If the rows have times, and the frame has no stamp.
        """
        key = frame.index if self._by_frame else frame.stamp
        if key is None:
            raise InputError(
                "joints with times need frames with stamps: give --fps, or a column frame in the place of time"
            )
        positions = {}
        for name, (keys, row) in self._rows.items():
            after = int(np.searchsorted(keys, key))
            ends = [max(after - 1, 0), min(after, len(keys) - 1)]
            distances, pair = np.abs(keys[ends] - key), row[ends]
            if distances.min() <= self._gaps[name]:
                if name in robot.continuous_joints:
                    pair = pair - math.tau * np.round((pair - pair[distances.argmin()]) / math.tau)
                positions[name] = float(np.interp(key, keys[ends], pair))
            elif name in robot.joint_names:
                return None
        return positions


def _numbers(row: list[str], number: int, count: int) -> list[float]:
    try:
        values = [float(text) for text in row]
    except ValueError as error:
        raise InputError(f"line {number}: {error}") from error
    if len(values) != count or not np.isfinite(values).all():
        raise InputError(f"line {number} must have {count} finite numbers, got {','.join(row)}")
    return values
