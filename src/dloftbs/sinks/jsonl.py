"""Results as JSON lines: one object per frame and line, everything that was found."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from dloftbs.data.answers import check_kinds, with_answers
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError, SourceError
from dloftbs.sinks.sink import PathSink
from dloftbs.support.documents import parse_json
from dloftbs.support.json_text import encode_line
from dloftbs.support.safe_files import AppendFile
from dloftbs.support.values import check_path

logger = logging.getLogger("dloftbs.sinks")


class JsonLinesSink(PathSink):
    """Writes `FrameResult.to_dict` of each frame as one line of JSON.

    Each line is on its way to the disk before `write` returns: whenever the process dies, the file holds every frame
    written, and at worst a part of one more line, which `read_json_lines` leaves out.

    Parameters
    ----------
    path : str or Path
        The file; missing folders are made, an older file is replaced with the first frame.
    answers : sequence of str
        Answers that each line has besides: ``"topology"``, ``"shape"``, ``"std"``; see `data.answers.with_answers`.

    Raises
    ------
    InputError
        If there is no such answer.
    SinkError
        If the file cannot be opened.
    """

    def __init__(self, path: str | Path, answers: Sequence[str] = ()) -> None:
        super().__init__(path)
        self._answers = check_kinds(answers)
        self._file = AppendFile(self._path)

    def _write(self, frame: Frame, result: FrameResult) -> None:
        self._file.append(encode_line(with_answers(result, self._answers)))

    def _close(self) -> None:
        self._file.close()


def read_json_lines(path: str | Path) -> Iterator[dict[str, Any]]:
    """Read back what a `JsonLinesSink` wrote, frame by frame.

    A part of a line at the end, which a killed process may leave, ends the records with a warning in the log.

    Parameters
    ----------
    path : str or Path

    Yields
    ------
    dict
        As `FrameResult.to_dict` gave it; `BSplineCurve.from_dict` takes the curves.

    Raises
    ------
    SourceError
        If the file cannot be read, or a whole line is not a JSON object; the message has its number.
    """
    place = check_path("path", path)
    try:
        with place.open("rb") as file:
            for number, line in enumerate(file, start=1):
                try:
                    row = parse_json(line, dict[str, Any])
                except InputError as error:
                    if line.endswith(b"\n"):
                        raise SourceError(f"{str(path)!r}, line {number}: {error}") from error
                    logger.warning("%s: line %d is cut off; what came before it is whole", path, number)
                    return
                yield row
    except SourceError:
        raise
    except OSError as error:
        raise SourceError(f"cannot read {str(path)!r}: {error}") from error
