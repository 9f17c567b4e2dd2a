"""Where results go: JSON lines, arrays, tables, geometry, videos and pictures.

Every sink is a context manager, and what it has written stays readable whatever ends the process::

    with sinks.open("cable.jsonl") as sink:
        for frame in frames:
            sink.write(frame, pipeline.process(frame))
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from dloftbs.errors import InputError
from dloftbs.sinks.base import MultiSink, Sink
from dloftbs.sinks.geometry import SUFFIXES as GEOMETRY_SUFFIXES
from dloftbs.sinks.geometry import GeometrySink
from dloftbs.sinks.jsonl import JsonLinesSink, read_json_lines
from dloftbs.sinks.npz import NpzRow, NpzSink, read_npz
from dloftbs.sinks.overlay import VIDEO_SUFFIXES, OverlayImagesSink, OverlayVideoSink
from dloftbs.sinks.points_csv import CsvSink
from dloftbs.sinks.sequence import write_sequence

__all__ = [
    "CsvSink",
    "GeometrySink",
    "JsonLinesSink",
    "MultiSink",
    "NpzRow",
    "NpzSink",
    "OverlayImagesSink",
    "OverlayVideoSink",
    "Sink",
    "open",
    "read_json_lines",
    "read_npz",
    "write_sequence",
]

_KINDS: dict[str, Callable[..., Sink]] = {
    ".jsonl": JsonLinesSink,
    ".ndjson": JsonLinesSink,
    ".npz": NpzSink,
    ".csv": CsvSink,
    **dict.fromkeys(GEOMETRY_SUFFIXES, GeometrySink),
    **dict.fromkeys(VIDEO_SUFFIXES, OverlayVideoSink),
}


def open(path: str | Path, **options: Any) -> Sink:
    """Open the sink that a name asks for.

    Parameters
    ----------
    path : str or Path
        ``.jsonl`` or ``.ndjson``: `JsonLinesSink`. ``.npz``: `NpzSink`. ``.csv``: `CsvSink`. ``.ply`` or ``.obj``:
        `GeometrySink`. ``.mp4`` or ``.mov``: `OverlayVideoSink`. No suffix, a slash at the end, or a folder that
        exists: `OverlayImagesSink`.
    **options
        As the sink's constructor takes them.

    Returns
    -------
    Sink

    Raises
    ------
    InputError
        If the suffix is unknown.
    SinkError
        If the sink cannot be opened.
    """
    suffix = Path(path).suffix.lower()
    if str(path).endswith(("/", "\\")) or not suffix:
        return OverlayImagesSink(path, **options)
    if suffix in _KINDS:
        return _KINDS[suffix](path, **options)
    if Path(path).is_dir():
        return OverlayImagesSink(path, **options)
    raise InputError(f"unknown kind of result {str(path)!r}; known are {', '.join(_KINDS)} and a folder")
