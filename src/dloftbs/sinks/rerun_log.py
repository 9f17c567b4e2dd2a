"""Frames and curves for the viewer of Rerun: a recording, or the viewer itself."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError, SinkError
from dloftbs.sinks.sink import PathSink, Sink
from dloftbs.support.arrays import FloatArray
from dloftbs.support.safe_files import claim_replaceable

SUFFIX = ".rrd"
_APPLICATION = "dloftbs"
_SAMPLES = 100


class RerunSink(PathSink):
    """Writes a recording for Rerun (extra ``rerun``), which ``rerun FILE.rrd`` shows.

    ``world/camera/image`` and ``depth`` are the frame's, a mask where it has no image; ``world/camera/curves`` the
    curves in the image, by their ids; ``world/curves`` those in space, as tubes, with the camera where it is known;
    ``length_px/ID`` and ``length_m/ID`` the lengths. The timelines are ``frame``, and ``stamp`` where frames have one.

    Rerun writes in batches: a killed process leaves a recording that ends some milliseconds early.

    Parameters
    ----------
    path : str or Path
        The file, ``.rrd``; missing folders are made, an older file is replaced, unless no frame came.

    Raises
    ------
    InputError
        If rerun-sdk is not installed.
    SinkError
        If the file cannot be written.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path)
        self._log = _Log()
        self._claim = claim_replaceable(self._path)
        self._saved = False

    def _write(self, frame: Frame, result: FrameResult) -> None:
        self._save()
        self._log.write(frame, result)

    def _close(self) -> None:
        with self._claim:
            if not (self._saved or self._keeps_older):
                self._save()
            self._log.close()

    def _save(self) -> None:
        if not self._saved:  # Rerun opens the file at once, and an older one would be lost before a frame came
            self._saved = True
            self._log.recording.save(str(self._path))


class RerunViewerSink(Sink):
    """Shows frames and curves live in the viewer of Rerun (extra ``rerun``), which it starts unless it runs already.

    The entities are those of a `RerunSink`.

    Raises
    ------
    InputError
        If rerun-sdk is not installed.
    SinkError
        If the viewer cannot be started.
    """

    def __init__(self) -> None:
        self._log = _Log()
        self._closed = False
        try:
            self._log.recording.spawn()
        except RuntimeError as error:
            raise SinkError(f"the viewer of Rerun cannot be started: {error}") from error

    def write(self, frame: Frame, result: FrameResult) -> None:
        """Show a frame.

        Raises
        ------
        SinkError
            If the sink is closed.
        """
        if self._closed:
            raise SinkError("cannot show a frame: the sink is closed")
        self._log.write(frame, result)

    def close(self) -> None:
        """Send what is left; the viewer stays open."""
        if not self._closed:
            self._closed = True
            self._log.close()


class _Log:
    """A stream of entities, wherever it leads."""

    def __init__(self) -> None:
        try:
            self._rerun = import_module("rerun")
        except ImportError as error:
            raise InputError("Rerun's recordings and viewer need it: pip install 'dloftbs[rerun]'") from error
        from dloftbs.viz.items import items_of
        from dloftbs.viz.style import Style

        self._items_of: Callable[[FrameResult], tuple[Any, ...]] = lambda result: items_of(result, Style())
        self.recording = self._rerun.RecordingStream(_APPLICATION)
        self.recording.log("world", self._rerun.ViewCoordinates.RDF, static=True)

    def write(self, frame: Frame, result: FrameResult) -> None:
        """Log a frame and its curves."""
        self.recording.set_time("frame", sequence=result.index)
        if result.stamp is not None:
            self.recording.set_time("stamp", duration=result.stamp)
        self._frame(frame)
        items = self._items_of(result)
        objects = result.tracks or result.detections
        rerun, colours, labels = self._rerun, [item.colour[::-1] for item in items], [item.label for item in items]
        curves = [_sampled(item.curve) for item in items]
        self.recording.log("world/camera/curves", rerun.LineStrips2D(curves, colors=colours, labels=labels))
        solid = [(found, number) for number, found in enumerate(objects) if found.curve_3d is not None]
        tubes = rerun.LineStrips3D(
            [_sampled(found.curve_3d) for found, _ in solid],
            radii=[(found.width_m or 0.0) / 2.0 for found, _ in solid],
            colors=[colours[number] for _, number in solid],
            labels=[labels[number] for _, number in solid],
        )
        self.recording.log("world/curves", tubes)
        for number, found in enumerate(objects):
            name = getattr(found, "id", number)
            self.recording.log(f"length_px/{name}", rerun.Scalars(found.curve.length))
            if found.curve_3d is not None:
                self.recording.log(f"length_m/{name}", rerun.Scalars(found.curve_3d.length))

    def close(self) -> None:
        """Send what is left."""
        self.recording.flush()
        self.recording.disconnect()

    def _frame(self, frame: Frame) -> None:
        rerun, camera = self._rerun, frame.camera
        height, width = frame.size
        if camera is not None:
            matrix = np.array([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])
            pinhole = rerun.Pinhole(image_from_camera=matrix, resolution=(width, height))
            self.recording.log("world/camera", pinhole)
        if frame.image is not None:
            self.recording.log("world/camera/image", rerun.Image(frame.image, color_model="BGR").compress())
        elif (is_cable := frame.is_cable) is not None:
            self.recording.log("world/camera/mask", rerun.SegmentationImage(is_cable.astype(np.uint8)))
        if frame.depth is not None:
            per_metre = 1.0 / frame.depth_unit_m if frame.depth.dtype.kind in "iu" else 1.0
            self.recording.log("world/camera/depth", rerun.DepthImage(frame.depth, meter=per_metre))


def _sampled(curve: Any) -> FloatArray:
    points: FloatArray = curve.sample(_SAMPLES)
    return points
