"""A single result as a picture, a table, or a file of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dloftbs import sinks, viz
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.presentation import Outputs
from dloftbs.errors import InputError
from dloftbs.sinks.overlay_pictures import picture_name
from dloftbs.sinks.points_csv import points_table
from dloftbs.sinks.supervision_detections import supervision_detections
from dloftbs.support.values import check_path, check_type
from dloftbs.viz.axes_plot import plot


def save(result: FrameResult, path: str | Path, frame: Frame | None = None) -> None:
    """Write one result as `FrameResult.save` says."""
    place = check_path("path", path)
    if frame is not None:
        check_type("frame", frame, Frame)
    shown = frame or result.frame or _nothing_of(result)
    kind = sinks.kind_of(path)
    target = place / f"{picture_name(shown)}.png" if kind in (sinks.OverlayImagesSink, sinks.LabelmeSink) else place
    origins = {Path(name).name for name in (result.name, shown.name) if name}
    if target.name in origins and target.exists():  # a frame knows the name of its file, and not the folder
        raise InputError(f"{str(target)!r} has the name of the frame and would replace it; choose another name")
    with kind(path) as sink:
        sink.write(shown, result)


def _nothing_of(result: FrameResult) -> Frame:
    """Return an empty frame in the place of that of a result, with its camera."""
    cameras = [found.camera for found in result.detections] + [found.camera for found in result.tracks]
    camera = next((camera for camera in cameras if camera is not None), None)
    empty = np.zeros(result.size, np.bool_)
    return Frame(mask=empty, camera=camera, index=result.index, stamp=result.stamp, name=result.name)


OUTPUTS = Outputs(
    lambda one: viz.as_png(viz.draw(np.zeros(one.size, np.bool_) if one.frame is None else one.frame, one)),
    lambda trace: viz.as_png(viz.draw_stages(trace)),
    save,
    points_table,
    supervision_detections,
    plot,
)
