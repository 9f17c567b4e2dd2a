"""Curves in space as a USD scene with time samples, for simulators and viewers."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.sinks._in_space import SpaceObject
from dloftbs.sinks._scene import SceneSink
from dloftbs.support.safe_files import write_whole
from dloftbs.support.values import check_integer

SUFFIX = ".usda"

_MAX_POINTS = 10_000


class _Moment(NamedTuple):
    """One object in one frame."""

    frame: int
    points: npt.NDArray[np.float32]
    width_m: float


@dataclass
class _Cable:
    """One object through the stream: what its prim holds."""

    name: str
    closed: bool
    order: int
    moments: list[_Moment] = field(default_factory=list)


class UsdSink(SceneSink):
    """Writes the curves in space of a stream as one USD scene in text, which simulators and viewers open.

    Each object is a prim ``/World/cable_ID`` of the type ``BasisCurves``, by the id of its track; without tracks it is
    ``/World/detection_N``, by the number of the detection in its frame. Its points lie on the curve at equal distances
    from end to end, joined by straight lines (``type = "linear"``, ``wrap = "nonperiodic"``): this form is what Newton
    and IsaacLab's `CableObject` simulate, a capsule from point to point. ``widths`` is the median of the object's
    thickness in metres, and so is ``physics:thickness`` of the material that is bound to it. A loop has ``wrap =
    "periodic"``, which today's simulators leave out.

    ``points`` without a time is where the object was seen last; ``points.timeSamples`` has each frame that shows it,
    and ``visibility`` hides it in the others. Time codes are frames by the median rate of the stamps that rise, or the
    frames' indices where there are no stamps or one goes back. Hidden tracks and objects without a curve in space are
    left out, as in a `GeometrySink`.

    Without a pose, coordinates are the camera's: x right, y down, z forward. The scene says ``upAxis = "Z"``, so that
    gravity is right only with a pose in a world whose z points upwards.

    The scene is written as a whole after 1, 2, 4, 8 frames and so on, and when the sink is closed, also where an
    exception ends the block; a killed process leaves half of the frames at least. Points stay in memory until then.

    Parameters
    ----------
    path : str or Path
        Ends in ``.usda``; missing folders are made, an older file is replaced.
    points : int
        Points along each curve, two or more; a loop has one less, and comes back to the first.
    radius_m : float, optional
        Of all cables; where it is left out, what each object's width and distance give.
    pose : array_like, shape (4, 4), or mapping, optional
        Pose of the camera in the world, as `dloftbs.camera.as_pose` takes it.

    Raises
    ------
    InputError
        If the suffix is another or an argument is wrong; in `write`, if neither a radius nor the frame's camera is
        given.
    SinkError
        If the file cannot be written; in `close`, if there were frames, and no object had a curve in space.
    """

    _suffix, _what = SUFFIX, "a USD scene"

    def __init__(
        self,
        path: str | Path,
        *,
        points: int = 100,
        radius_m: float | None = None,
        pose: npt.ArrayLike | Mapping[str, Any] | None = None,
    ) -> None:
        self._points = check_integer("points", points, 2, _MAX_POINTS)  # nothing is claimed for a wrong argument
        super().__init__(path, radius_m=radius_m, pose=pose)
        self._cables: dict[str, _Cable] = {}
        self._indices: list[int] = []
        self._stamps: list[float | None] = []
        self._tried = 0  # frames of the scene that was last written, or would have been

    def _write(self, frame: Frame, result: FrameResult) -> None:
        moments = [(one, self._moment(one, frame)) for one in self._in_space.of(result)]
        self._indices.append(result.index)
        self._stamps.append(result.stamp)
        for one, moment in moments:
            cable = self._cables.setdefault(one.name, _Cable(one.name, one.curve.closed, one.order))
            cable.moments.append(moment)
        if len(self._indices) >= 2 * self._tried:
            self._write_scene()

    def _moment(self, one: SpaceObject, frame: Frame) -> _Moment:
        points = self._placed(one.curve.sample(self._points))
        points = points[:-1] if one.curve.closed else points
        return _Moment(len(self._indices), points.astype(np.float32), 2.0 * self._radius_of(one, frame))

    def _close(self) -> None:
        with self._claim:
            if len(self._indices) > self._tried:
                self._write_scene()
        self._in_space.check()

    def _write_scene(self) -> None:
        if self._cables:
            self._tried = len(self._indices)
            write_whole(self._path, self._scene())

    def _scene(self) -> bytes:
        rate, codes = _time_codes(self._stamps, self._indices)
        header = [
            "#usda 1.0",
            "(",
            f'    doc = "Cables seen by a camera, in metres, in {self._frame_text}"',
            '    defaultPrim = "World"',
            "    metersPerUnit = 1",
            '    upAxis = "Z"',
            f"    timeCodesPerSecond = {rate:.9g}",
            f"    framesPerSecond = {rate:.9g}",
            f"    startTimeCode = {codes[0]:.9g}",
            f"    endTimeCode = {codes[-1]:.9g}",
            ")",
            "",
            'def Xform "World"',
            "{",
        ]
        bodies = [line for cable in self._cables.values() for line in _prim(cable, codes)]
        return "\n".join([*header, *bodies, "}", ""]).encode()


def _time_codes(stamps: Sequence[float | None], indices: Sequence[int]) -> tuple[float, list[float]]:
    """Return the time codes per second, and that of each frame; they rise."""
    seconds = np.array([np.nan if stamp is None else stamp for stamp in stamps])
    steps = np.diff(seconds)
    if (steps >= 0.0).all() and (steps > 0.0).any():
        rate = 1.0 / float(np.median(steps[steps > 0.0]))
        least = _LEAST_STEP * np.arange(len(seconds))
        codes = np.maximum.accumulate(rate * (seconds - seconds[0]) - least) + least
        return rate, codes.round(6).tolist()
    rises = all(before < after for before, after in pairwise(indices))
    return _DEFAULT_RATE, [float(code) for code in (indices if rises else range(len(indices)))]


_LEAST_STEP = 1e-3
"""Time codes from a frame to the next one of the same stamp.

Source: by definition; too short to be seen, and many times what a code is rounded to.
"""
_DEFAULT_RATE = 24.0
"""Time codes per second of a stream without stamps.

Source: by definition; the value of a USD scene that states none.
"""


def _prim(cable: _Cable, codes: Sequence[float]) -> list[str]:
    from dloftbs.viz import Style

    blue, green, red = (value / 255.0 for value in Style().colour(cable.order))
    width = statistics.median(moment.width_m for moment in cable.moments)
    last = cable.moments[-1]
    seen = {moment.frame for moment in cable.moments}
    shown = [frame in seen for frame in range(len(codes))]
    lines = [
        f'def BasisCurves "{cable.name}" (',
        '    prepend apiSchemas = ["MaterialBindingAPI", "PhysicsCurvesDeformableSimAPI"]',
        ")",
        "{",
        '    uniform token type = "linear"',
        f'    uniform token wrap = "{"periodic" if cable.closed else "nonperiodic"}"',
        f"    int[] curveVertexCounts = [{len(last.points)}]",
        f"    float[] widths = [{width:.6g}] (",
        '        interpolation = "constant"',
        "    )",
        f"    color3f[] primvars:displayColor = [({red:.3f}, {green:.3f}, {blue:.3f})]",
        f"    rel material:binding:physics = </World/{cable.name}/material>",
        f"    point3f[] points = {_listed(last.points)}",
    ]
    if len(codes) > 1:
        lines.append("    point3f[] points.timeSamples = {")
        lines += [f"        {codes[moment.frame]:.9g}: {_listed(moment.points)}," for moment in cable.moments]
        lines.append("    }")
    if not all(shown):
        changes = [frame for frame in range(len(codes)) if frame == 0 or shown[frame] != shown[frame - 1]]
        lines.append(f'    token visibility = "{_VISIBILITY[shown[-1]]}"')
        lines.append("    token visibility.timeSamples = {")
        lines += [f'        {codes[frame]:.9g}: "{_VISIBILITY[shown[frame]]}",' for frame in changes]
        lines.append("    }")
    lines += [
        '    def Material "material" (',
        '        prepend apiSchemas = ["PhysicsCurvesDeformableMaterialAPI"]',
        "    )",
        "    {",
        f"        float physics:thickness = {width:.6g}",
        "    }",
        "}",
    ]
    return [f"    {line}" for line in lines]


_VISIBILITY = {True: "inherited", False: "invisible"}
"""Tokens of USD by whether a frame shows the object.

Source: by definition.
"""


def _listed(points: npt.NDArray[np.float32]) -> str:
    """Return points in the fewest digits from which the same numbers are read."""
    return "[" + ", ".join(f"({x}, {y}, {z})" for x, y, z in points.astype(str)) + "]"
