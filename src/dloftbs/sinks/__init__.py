"""Outputs: JSON lines, arrays, tables, geometry, scenes, labels, videos, pictures and recordings of ROS.

Every sink is a context manager; what it has written stays readable whatever ends the process, but for arrays, COCO's
labels and scenes of USD, which a `NpzSink`, a `CocoSink` and a `UsdSink` complete when they are closed::

    with sinks.open("cable.jsonl") as sink:
        for frame in frames:
            sink.write(frame, pipeline.process(frame))
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from dloftbs.errors import InputError
from dloftbs.sinks.coco import CocoSink
from dloftbs.sinks.geometry import SUFFIXES as GEOMETRY_SUFFIXES
from dloftbs.sinks.geometry import GeometrySink
from dloftbs.sinks.jsonl import JsonLinesSink, read_json_lines
from dloftbs.sinks.labelme import LabelmeSink
from dloftbs.sinks.mujoco_cables import SUFFIX as MUJOCO_SUFFIX
from dloftbs.sinks.mujoco_cables import MujocoSink
from dloftbs.sinks.npz_curves import NpzRow, NpzSink, read_npz
from dloftbs.sinks.overlay_pictures import (
    IMAGE_SUFFIXES,
    VIDEO_SUFFIXES,
    OverlayImagesSink,
    OverlayPictureSink,
    OverlayVideoSink,
)
from dloftbs.sinks.points_csv import CsvSink
from dloftbs.sinks.rerun_log import SUFFIX as RERUN_SUFFIX
from dloftbs.sinks.rerun_log import RerunSink, RerunViewerSink
from dloftbs.sinks.sink import MultiSink, PathSink, Sink
from dloftbs.sinks.usd_curves import SUFFIX as USD_SUFFIX
from dloftbs.sinks.usd_curves import UsdSink
from dloftbs.support.values import check_path

__all__ = [
    "CocoSink",
    "CsvSink",
    "GeometrySink",
    "JsonLinesSink",
    "LabelmeSink",
    "MujocoSink",
    "MultiSink",
    "NpzRow",
    "NpzSink",
    "OverlayImagesSink",
    "OverlayPictureSink",
    "OverlayVideoSink",
    "PathSink",
    "RerunSink",
    "RerunViewerSink",
    "Sink",
    "UsdSink",
    "kind_of",
    "open",
    "read_json_lines",
    "read_npz",
]

BAG_SUFFIX = ".mcap"
LABELME_SUFFIX = ".labelme"

_KINDS: dict[str, type[PathSink]] = {
    ".jsonl": JsonLinesSink,
    ".ndjson": JsonLinesSink,
    ".npz": NpzSink,
    ".csv": CsvSink,
    ".json": CocoSink,
    LABELME_SUFFIX: LabelmeSink,
    **dict.fromkeys(GEOMETRY_SUFFIXES, GeometrySink),
    USD_SUFFIX: UsdSink,
    MUJOCO_SUFFIX: MujocoSink,
    RERUN_SUFFIX: RerunSink,
    **dict.fromkeys(VIDEO_SUFFIXES, OverlayVideoSink),
    **dict.fromkeys(IMAGE_SUFFIXES, OverlayPictureSink),
}


def open(path: str | Path, **options: Any) -> Sink:
    """Open the sink that a name asks for.

    A sink replaces an existing file, and cannot know the frames' inputs: give results names that no input has.

    Parameters
    ----------
    path : str or Path
        As `kind_of` has it.
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
    return kind_of(path)(path, **options)


def kind_of(path: str | Path) -> type[PathSink]:
    """Return the sink that a name asks for.

    Parameters
    ----------
    path : str or Path
        ``.mcap``: `dloftbs.ros.BagSink` (extra ``ros``). ``.jsonl`` or ``.ndjson``: `JsonLinesSink`. ``.npz``:
        `NpzSink`. ``.csv``: `CsvSink`. ``.ply`` or ``.obj``: `GeometrySink`. ``.usda``: `UsdSink`. ``.xml``:
        `MujocoSink`. ``.rrd``: `RerunSink` (extra ``rerun``). ``.json``: `CocoSink`. ``.labelme``, with or without a
        slash behind it: `LabelmeSink`. ``.mp4`` or ``.mov``: `OverlayVideoSink`. ``.png``, ``.jpg`` and so on, unless
        it is a folder: `OverlayPictureSink`. No suffix, a slash at the end, or a folder that exists:
        `OverlayImagesSink`.

    Raises
    ------
    InputError
        If the suffix is unknown.
    """
    check_path("path", path)
    suffix = Path(path).suffix.lower()
    if suffix == BAG_SUFFIX:
        from dloftbs.ros import BagSink

        return BagSink
    if suffix != LABELME_SUFFIX and (str(path).endswith(("/", "\\")) or not suffix):
        return OverlayImagesSink
    kind = _KINDS.get(suffix)
    if kind in (None, OverlayPictureSink) and os.path.isdir(path):
        return OverlayImagesSink
    if kind is None:
        known = ", ".join((*_KINDS, BAG_SUFFIX))
        raise InputError(f"unknown kind of result {str(path)!r}; known are {known} and a folder, with a / at its end")
    return kind


def __dir__() -> list[str]:
    return sorted(__all__)
