"""Curves in space as cables of a MuJoCo model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.sinks._scene import SceneSink
from dloftbs.support.arrays import FloatArray
from dloftbs.support.safe_files import write_whole

SUFFIX = ".xml"

_DEVIATION_M = 0.5e-3
"""Largest distance of a curve from the chain of capsules that stands for it, metres.

Source: by definition; half of what a depth camera resolves at its nearest.
"""

_SEGMENT_COUNTS = (8, 16, 24, 32, 48, 64, 96, 128, 192, 256)
"""Numbers of capsules that a cable may have.

Source: by definition; from what any cable needs to bend, to what MuJoCo steps in real time.
"""

_PLACES_A_SEGMENT = 8


class MujocoSink(SceneSink):
    """Writes the curves in space of the newest frame as a MuJoCo model in which each object is a cable.

    Each object is a ``composite`` of the type ``cable``, a chain of capsules along the curve with ball joints between
    them: ``mujoco.MjModel.from_xml_path("scene.xml")`` loads it, without plugins. Its bodies are ``cable_ID_B_first``,
    ``cable_ID_B_1`` and so on to ``cable_ID_B_last``, by the id of the track; without tracks, ``detection_N_B_first``
    and so on, by the number of the detection. The chain stays within half a millimetre of the curve, with up to 256
    capsules, all equally long; only bends of a radius below a millimetre or two need more, and are cut. The capsules'
    radius is half of the object's thickness. Capsules that are nearer along the cable than it is thick do not collide
    with each other. The ends of a loop, ``cable_ID_loop``, are connected.

    The camera does not see what a cable is made of: density, damping and friction are placeholders, there is no
    stiffness, and at rest each joint is as the camera saw it.

    Without a pose, coordinates are the camera's, x right, y down, z forward, and there is no gravity, whose direction
    is unknown then. With a pose, they are the world's, and gravity points against its z.

    The file is replaced as a whole with each frame in which an object has a curve in space, so that it always holds the
    newest one, also when the process is killed. Hidden tracks and objects without a curve in space are left out, as in
    a `GeometrySink`.

    Parameters
    ----------
    path : str or Path
        Ends in ``.xml``; missing folders are made, an older file is replaced.
    radius_m, pose
        As `UsdSink` has them.

    Raises
    ------
    InputError, SinkError
        As `UsdSink`.
    """

    _suffix, _what = SUFFIX, "a MuJoCo model"

    def _write(self, frame: Frame, result: FrameResult) -> None:
        found = self._in_space.of(result)
        if not found:
            return
        cables, exclusions, connections = [], [], []
        for one in found:
            vertices = self._placed(_vertices(one.curve))
            radius = self._radius_of(one, frame)
            cables.append(_cable(one.name, vertices, radius))
            exclusions += _exclusions(one.name, vertices, radius, one.curve.closed)
            if one.curve.closed:
                connections.append(_connection(one.name, vertices))
        text = _MODEL.format(
            frame=self._frame_text,
            gravity="0 0 0" if self._pose is None else "0 0 -9.81",
            cables="".join(cables),
            contact=_section("contact", exclusions),
            equality=_section("equality", connections),
        )
        write_whole(self._path, text.encode())

    def _close(self) -> None:
        self._claim.release()
        self._in_space.check()


_MODEL = """<mujoco model="cables">
  <!-- Metres, in {frame}. Shape and radius are what the camera saw; density, damping and friction are placeholders. -->
  <option timestep="0.001" integrator="implicitfast" gravity="{gravity}"/>
  <worldbody>
{cables}  </worldbody>
{contact}{equality}</mujoco>
"""


def _cable(name: str, vertices: FloatArray, radius_m: float) -> str:
    listed = "  ".join(f"{x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices)
    return f"""    <composite type="cable" prefix="{name}_" initial="free" vertex="{listed}">
      <joint kind="main" damping="0.0003" armature="1e-6"/>
      <geom type="capsule" size="{radius_m:.6f}" density="1000"/>
    </composite>
"""


def _section(tag: str, lines: Sequence[str]) -> str:
    return f"  <{tag}>\n{''.join(f'    {line}' for line in lines)}  </{tag}>\n" if lines else ""


def _vertices(curve: BSplineCurve) -> FloatArray:
    """Return points (n, 3) at equal distances along a curve, as few as keep the lines between them near it."""
    for segments in _SEGMENT_COUNTS:
        dense = curve.sample(segments * _PLACES_A_SEGMENT + 1)
        vertices = dense[::_PLACES_A_SEGMENT]
        share = (np.arange(_PLACES_A_SEGMENT) / _PLACES_A_SEGMENT)[None, :, None]
        lines = (1.0 - share) * vertices[:-1, None] + share * vertices[1:, None]
        off = np.linalg.norm(dense[:-1].reshape(lines.shape) - lines, axis=-1).max()
        if off <= _DEVIATION_M:
            break
    return vertices


def _bodies(name: str, segments: int) -> list[str]:
    """Return the names that MuJoCo gives the bodies of a cable."""
    return [f"{name}_B_{at}" for at in ("first", *range(1, segments - 1), "last")]


def _exclusions(name: str, vertices: FloatArray, radius_m: float, closed: bool) -> list[str]:
    """Return which capsules do not collide: all but neighbours, which MuJoCo leaves out itself."""
    bodies = _bodies(name, len(vertices) - 1)
    length = float(np.linalg.norm(vertices[1] - vertices[0]))
    count, reach = len(bodies), int(2.0 * radius_m / length) + 1
    steps = range(1 if closed else 2, min(reach, count - 1) + 1)
    firsts = [(first, first + step) for step in steps for first in range(count if closed else count - step)]
    pairs = {(min(first, second % count), max(first, second % count)) for first, second in firsts}
    apart = sorted((first, second) for first, second in pairs if second - first > 1)
    return [f'<exclude body1="{bodies[first]}" body2="{bodies[second]}"/>\n' for first, second in apart]


def _connection(name: str, vertices: FloatArray) -> str:
    """Return what connects the last end of a loop, at which its last capsule ends, to its first."""
    bodies = _bodies(name, len(vertices) - 1)
    length = float(np.linalg.norm(vertices[-1] - vertices[-2]))
    return f'<connect body1="{bodies[-1]}" body2="{bodies[0]}" anchor="{length:.6f} 0 0"/>\n'
