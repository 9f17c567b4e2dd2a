"""Curves in space as geometry: tubes or lines in PLY and OBJ files."""

from __future__ import annotations

import os
from collections import deque
from pathlib import Path

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.spans import inside
from dloftbs.errors import InputError
from dloftbs.sinks import _mesh
from dloftbs.sinks._earlier_files import EarlierFiles
from dloftbs.sinks._in_space import SpaceObject, SpaceObjects, check_radius
from dloftbs.sinks.sink import PathSink
from dloftbs.support.safe_files import UnusedNames, claim_replaceable, sink_errors, write_whole

_FORMATS = {".ply": _mesh.ply, ".obj": _mesh.obj}
SUFFIXES = tuple(_FORMATS)
FORMS = ("tube", "line")
_LINE_POINTS = 200
_BALL = 1.5
"""Radius of the ball at a branch point, over that of the tube."""
_WHITE = (255, 255, 255)


class GeometrySink(PathSink):
    """Writes the curves in space of each frame as a file that viewers of meshes open.

    A single frame goes into the file of that name. When a second one comes, the folder of that name without the suffix
    takes its place, with a file per frame, named by the frame's index in six digits: ``curves/000000.ply``. What comes
    a second time under the same index gets ``_1`` and so on; files of an earlier run are replaced, and closing warns in
    the log of those that stay. Each file appears as a whole or not at all, whenever the process dies. Nothing is
    written, and no file replaced, before the first frame that shows an object with a curve in space; where none ever
    does, closing is an error that says why.

    Coordinates are the camera's, metres: x right, y down, z forward. A result's objects are its tracks, or its
    detections where it has none; hidden tracks are left out, since nothing of them is seen. Objects without a
    curve in space are left out, too: the first one is named in a warning in the log, and closing counts all of them.

    PLY files are binary; their points have ``nx, ny, nz``, the colour of the object in overlays as ``red, green,
    blue``, its id or number as ``object``, and ``inferred``, 1 where the frame's depth does not show it. In OBJ
    files each object is an ``o object_ID``, and colours stand behind the coordinates. Branch points are white balls, or
    points beside lines; their ``object`` is negative: minus their id, or their number from 1 in a frame by itself.

    Parameters
    ----------
    path : str or Path
        Ends in ``.ply`` or ``.obj``; missing folders are made, an older file is replaced.
    form : str
        ``"tube"``: triangles around the curve. ``"line"``: points along it, joined by edges.
    radius_m : float, optional
        Of tubes; where it is left out, what each object's width and distance give.
    caps : bool
        Whether half spheres close the tubes, which are then watertight.

    Raises
    ------
    InputError
        If the suffix or the form is another, or the radius is not positive; in `write`, if a radius is wanted and
        neither it nor the frame's camera is given.
    SinkError
        If the file cannot be written; in `close`, if there were frames, and no object had a curve in space.
    """

    def __init__(
        self, path: str | Path, *, form: str = "tube", radius_m: float | None = None, caps: bool = True
    ) -> None:
        super().__init__(path)
        self._suffix = self._path.suffix.lower()
        if self._suffix not in SUFFIXES:
            raise InputError(f"a geometry's name must end in {', '.join(SUFFIXES)}, got {str(path)!r}")
        if form not in FORMS:
            raise InputError(f"form must be one of {', '.join(FORMS)}, got {form!r}")
        self._form, self._radius_m, self._caps = form, check_radius(radius_m), caps
        self._name = UnusedNames()
        self._only: Path | None = None
        self._waiting = deque[Path]()  # files of the frames before the first object in space
        self._in_space = SpaceObjects(self._path)
        self._written = 0
        self._earlier = EarlierFiles(self._path.with_suffix(""), self._suffix)
        self._claim = claim_replaceable(self._path)

    def _write(self, frame: Frame, result: FrameResult) -> None:
        objects = list(self._in_space.of(result))
        items = [self._item(one, frame.camera) for one in objects]
        if result.branch_points:
            items += self._branch_points(result, objects, frame.camera)
        folder = self._path.with_suffix("")
        target = folder / f"{self._name(f'{result.index:06d}')}{self._suffix}"
        if self._written == 0 and not items:
            self._waiting.append(target)
            return
        while self._waiting:
            self._put(self._waiting[0], [])
            self._waiting.popleft()
        self._put(target, items)

    def _put(self, target: Path, items: list[_mesh.Item]) -> None:
        """Write the next frame: the first one into the file itself, which moves into the folder for the second."""
        if self._written == 0:
            self._only, target = target, self._path
        elif self._only is not None:
            with sink_errors(self._only.parent):
                self._only.parent.mkdir(exist_ok=True)
                os.replace(os.path.realpath(self._path), self._only)
            self._earlier.replaced_by(self._only.name)
            self._only = None
        self._earlier.replaced_by(target.name)
        write_whole(target, _FORMATS[self._suffix](items))
        self._written += 1

    def _item(self, one: SpaceObject, camera: PinholeCamera | None) -> _mesh.Item:
        from dloftbs.viz import Style

        curve = one.curve
        if self._form == "line":
            shape = _mesh.line(curve, curve.length / _LINE_POINTS)
        else:
            shape = _mesh.tube(curve, self._radius_m or one.radius_m(camera), caps=self._caps)
        blue, green, red = Style().colour(one.order)
        seen_not = inside(shape.u, one.row.source.inferred_3d)
        return _mesh.Item(one.row.name, shape, (red, green, blue), seen_not)

    def _branch_points(
        self, result: FrameResult, objects: list[SpaceObject], camera: PinholeCamera | None
    ) -> list[_mesh.Item]:
        by_number = {one.row.number: one for one in objects}
        items = []
        for number, point in enumerate(result.branch_points, start=1):
            met = [by_number[branch] for branch, _ in point.members if branch in by_number]
            if point.position_3d is None or not met:
                continue
            centre = np.array(point.position_3d)
            if self._form == "line":
                shape = _mesh.dot(centre)
            else:
                shape = _mesh.ball(centre, _BALL * (self._radius_m or max([one.radius_m(camera) for one in met])))
            seen = np.zeros(len(shape.points), np.bool_)
            items.append(_mesh.Item(-number if point.id is None else -point.id, shape, _WHITE, seen))
        return items

    def _close(self) -> None:
        self._claim.release()
        self._earlier.warn()
        self._in_space.check()
