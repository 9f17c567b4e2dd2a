"""Positions of a robot's joints through time, from a CSV file."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SourceError
from dloftbs.support.arrays import FloatArray
from dloftbs.support.documents import read_text
from dloftbs.support.values import check_path

_FIRST = ("time", "frame")


class JointStates:
    """Positions of joints, each at times or in frames.

    Parameters
    ----------
    keys : numpy.ndarray, shape (n,)
        Times in seconds, on the clock of the frames' stamps, or the frames' indices; they rise.
    positions : dict of str to numpy.ndarray, shape (n,)
        By the joints' names, radians or metres.
    by_frame : bool
        Whether keys are indices.

    Raises
    ------
    InputError
        If there are none, or they do not rise.
    """

    def __init__(self, keys: FloatArray, positions: dict[str, FloatArray], *, by_frame: bool = False) -> None:
        what = "frames" if by_frame else "times"
        if not len(keys) or not np.isfinite(keys).all() or (np.diff(keys) <= 0.0).any():
            raise InputError(f"{what} of joints must be one or more, and rise from row to row")
        self._keys, self._positions, self._by_frame = keys, positions, by_frame
        # What is farther from the next row than this is not known: a row was left out, or the recording had ended.
        self._gap = 1.5 * float(np.median(np.diff(keys))) if len(keys) > 1 else 0.0

    def __repr__(self) -> str:
        return f"JointStates({len(self._keys)} rows, {', '.join(self._positions)})"

    @classmethod
    def from_csv(cls, path: str | Path) -> JointStates:
        """Read joints from a CSV file: a column ``time`` (seconds) or ``frame``, and one of the name of each joint.

        Raises
        ------
        SourceError
            If the file cannot be read or says something else.
        """
        place = check_path("path", path)
        try:
            rows = [row for row in csv.reader(read_text(place).splitlines()) if row]
            header = [name.strip() for name in rows[0]] if rows else []
            if len(header) < 2 or header[0] not in _FIRST or len({*header}) < len(header):
                raise InputError(
                    "joints need a header: time (seconds) or frame, then the name of each joint; "
                    f"got {','.join(header) or 'nothing'}"
                )
            table = np.array([_numbers(row, number, len(header)) for number, row in enumerate(rows[1:], 2)])
            columns = table.reshape(-1, len(header)).T
            return cls(columns[0], dict(zip(header[1:], columns[1:], strict=True)), by_frame=header[0] == "frame")
        except (InputError, csv.Error) as error:
            raise SourceError(f"{place}: {error}") from error

    def at(self, frame: Frame) -> dict[str, float] | None:
        """Return the positions when a frame was taken, between two rows in proportion; None where they are unknown.

        They are unknown before the first row and after the last by more than one and a half steps of the rows, and in
        gaps of more than three. Frames are found by their index alone.

        Raises
        ------
        InputError
            If the rows have times, and the frame has no stamp.
        """
        if self._by_frame:
            found = np.flatnonzero(self._keys == frame.index)
            return None if not len(found) else {name: float(row[found[0]]) for name, row in self._positions.items()}
        if frame.stamp is None:
            raise InputError(
                "joints with times need frames with stamps: give --fps, or a column frame in the place of time"
            )
        if float(np.abs(self._keys - frame.stamp).min()) > self._gap:
            return None
        return {name: float(np.interp(frame.stamp, self._keys, row)) for name, row in self._positions.items()}


def _numbers(row: list[str], number: int, count: int) -> list[float]:
    try:
        values = [float(text) for text in row]
    except ValueError as error:
        raise InputError(f"line {number}: {error}") from error
    if len(values) != count or not np.isfinite(values).all():
        raise InputError(f"line {number} must have {count} finite numbers, got {','.join(row)}")
    return values
