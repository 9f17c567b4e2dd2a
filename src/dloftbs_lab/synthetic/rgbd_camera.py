"""Cables above a table, seen by a depth camera with its errors: each frame is a scene of its own."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.depth_camera import DEPTH_CAMERAS, depth_camera
from dloftbs_lab.synthetic.generated import GeneratedSequence, check_choice, truth_of
from dloftbs_lab.synthetic.motion import smoothstep
from dloftbs_lab.synthetic.space_axis import axis_curve, image_curve
from dloftbs_lab.synthetic.space_paint import paint_spheres
from dloftbs_lab.synthetic.space_scene import Rendering, draw_spheres, hd_camera
from dloftbs_lab.truth import Truth

_FRAMES = 32
_DIAMETERS_M = (0.003, 0.005, 0.008, 0.012, 0.020)
_DISTANCE_M = (0.4, 1.5)
_NEAREST_M, _FARTHEST_M = 0.35, 1.6
_THINNEST_PX = 3.2
_GAP_M = (0.02, 0.15)
_STEEPEST = math.radians(70.0)
_DENSITY = 8.0
_MARGIN = 0.06
_COLOURS_BGR = ((196.0, 92.0, 12.0), (30.0, 30.0, 34.0), (40.0, 40.0, 200.0), (60.0, 160.0, 60.0), (20.0, 190.0, 220.0))


class _Scene(NamedTuple):
    """Axes in the camera's frame, (n, 3) m, the cables' radius, and the table as ``normal @ x = level``."""

    axes: list[FloatArray]
    radius_m: float
    normal: FloatArray
    level_m: float
    colours: list[tuple[float, float, float]]


class DepthCameraSequence(GeneratedSequence):
    """Round cables of 3 to 20 mm, 0.4 to 1.5 m away, 2 to 15 cm above a table, before a depth camera.

    A frame has a mask, an image, and depth with the errors of one of `DEPTH_CAMERAS`; the scene is the same for all of
    them.

    Parameters
    ----------
    kind : str
        One of `DEPTH_SCENES`.
    errors : str
        One of `DEPTH_CAMERAS`.
    frames : int
    size : (int, int)
        ``(H, W)`` px. The field of view is that of an HD image with 900 px of focal length.
    seed : int
        Not negative.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    def __init__(
        self, kind: str, errors: str = "all", frames: int = _FRAMES, size: tuple[int, int] = (720, 1280), seed: int = 0
    ) -> None:
        check_choice("kind", kind, DEPTH_SCENES)
        super().__init__(f"{kind}, {errors}", frames, size, seed, None)
        if hd_camera(size).fx * max(_DIAMETERS_M) < _THINNEST_PX * _DISTANCE_M[0]:
            raise InputError(f"in an image of {size} every cable is thinner than {_THINNEST_PX:g} px: make it larger")
        self.kind = kind
        self.errors = depth_camera(errors)
        self.camera: PinholeCamera = hd_camera(size)

    def _make_frame(self, index: int) -> Frame:
        """Render one frame."""
        scene, rng = self._scene(index), np.random.default_rng([self.seed, 7, self._number, index])
        seen, _, _ = _render(scene, self.camera, self.size)
        dx, dy = self.errors.displacement(rng).tolist()
        c = self.camera
        displaced = PinholeCamera(c.fx, c.fy, c.cx + dx, c.cy + dy)
        moved, background, which = _render(scene, displaced, self.size)
        colours = np.concatenate([np.tile(c, (len(a), 1)) for a, c in zip(scene.axes, scene.colours, strict=True)])
        depth = self.errors.measure(moved.depth, background, _arc_widths(scene, moved, which), seen.mask, rng)
        return Frame(
            image=paint_spheres(seen, colours, self.camera, [self.seed, self._number, index]),
            mask=seen.mask,
            depth=depth,
            camera=self.camera,
            **self._labels(index),
        )

    def _make_truth(self, index: int) -> Truth:
        scene = self._scene(index)
        _, _, which = _render(scene, self.camera, self.size)
        return truth_of((image_curve(axis, self.camera) for axis in scene.axes), which, map(axis_curve, scene.axes))

    @property
    def _number(self) -> int:
        return list(_SCENES).index(self.kind)

    def _scene(self, index: int) -> _Scene:
        return _make_scene(self.kind, self.camera, self.size, np.random.default_rng([self.seed, self._number, index]))


def _make_scene(kind: str, camera: PinholeCamera, size: tuple[int, int], rng: np.random.Generator) -> _Scene:
    """Draw scenes until the cables lie inside of the image."""
    while True:
        diameter = float(rng.choice(_DIAMETERS_M))
        farthest = min(_DISTANCE_M[1], camera.fx * diameter / _THINNEST_PX)
        if farthest < _DISTANCE_M[0]:  # too thin for this image wherever it is
            continue
        distance = rng.uniform(_DISTANCE_M[0], farthest)
        length = rng.uniform(0.35, 0.8) * distance * size[1] / camera.fx
        n = math.ceil(_DENSITY * length / (0.5 * diameter)) + 1
        axes = _SCENES[kind](rng, length, diameter, n)
        tilt = rng.uniform(-0.35, 0.35, 2)
        turn = _turned(*tilt.tolist())
        axes = [axis @ turn.T for axis in axes]
        middle = np.concatenate(axes).mean(axis=0)
        place = np.array([rng.uniform(-0.1, 0.1) * distance, rng.uniform(-0.06, 0.06) * distance, distance])
        axes = [axis - middle + place for axis in axes]
        points = np.concatenate(axes)
        if not _NEAREST_M < points[:, 2].min() <= points[:, 2].max() < _FARTHEST_M:
            continue
        if any(_steepest(axis) > _STEEPEST for axis in axes):
            continue
        at = camera.project(points)
        room = _MARGIN * np.array([size[1], size[0]])
        if (at < room).any() or (at > np.array([size[1], size[0]]) - room).any():
            continue
        normal = turn @ np.array([0.0, 0.0, 1.0])
        level = float((points @ normal).max()) + 0.5 * diameter + rng.uniform(*_GAP_M)
        colours = [_COLOURS_BGR[i] for i in rng.choice(len(_COLOURS_BGR), 2)]
        return _Scene(axes, 0.5 * diameter, normal, level, colours[: len(axes)])


def _steepest(axis: FloatArray) -> float:
    """Return the largest angle between an axis (n, 3) and the plane across the line of sight, rad."""
    ways, sights = np.diff(axis, axis=0), 0.5 * (axis[1:] + axis[:-1])
    along = np.abs((ways * sights).sum(axis=1))
    return float(np.arcsin(np.max(along / np.linalg.norm(ways, axis=1) / np.linalg.norm(sights, axis=1))))


def _turned(about_x: float, about_y: float) -> FloatArray:
    cx, sx, cy, sy = math.cos(about_x), math.sin(about_x), math.cos(about_y), math.sin(about_y)
    return np.array([[1.0, 0, 0], [0, cx, -sx], [0, sx, cx]]) @ np.array([[cy, 0, sy], [0, 1.0, 0], [-sy, 0, cy]])


def _path(rng: np.random.Generator, n: int, wildness: float = 1.0) -> FloatArray:
    """Return the heading (n,) of a cable that bends gently."""
    s = np.linspace(0.0, 1.0, n)
    heading = np.full(n, rng.uniform(0.0, 2.0 * math.pi))
    for count in (1, 2):
        gain, phase = rng.uniform(0.0, 0.8 / count), rng.uniform(0.0, 2.0 * math.pi)
        heading += wildness * gain * np.cos(math.pi * count * s + phase)
    return heading


def _integrated(heading: FloatArray, pitch: FloatArray, length: float) -> FloatArray:
    """Return the points (n, 3) m of a path; a pitch above 0 goes away from the camera."""
    steps = np.stack((np.cos(pitch) * np.cos(heading), np.cos(pitch) * np.sin(heading), np.sin(pitch)), axis=1)
    middle = 0.5 * (steps[1:] + steps[:-1]) * (length / (len(heading) - 1))
    return np.concatenate((np.zeros((1, 3)), np.cumsum(middle, axis=0)))


def _flat(rng: np.random.Generator, length: float, diameter: float, n: int) -> list[FloatArray]:
    """Keep a cable level with the table."""
    return [_integrated(_path(rng, n), np.zeros(n), length)]


def _lifted(rng: np.random.Generator, length: float, diameter: float, n: int) -> list[FloatArray]:
    """Lift the middle of a cable whose ends lie, by up to a third of its length and 15 cm."""
    s = np.linspace(0.0, 1.0, n)
    height = rng.uniform(0.3, 1.0) * min(0.33 * length, 0.15)
    pitch = -np.arctan(math.pi * height / length * np.sin(2.0 * math.pi * s))
    return [_integrated(_path(rng, n), pitch, length)]


def _tilted(rng: np.random.Generator, length: float, diameter: float, n: int) -> list[FloatArray]:
    """Let a cable head towards the camera, evenly or more and more, at up to 70 degrees."""
    s = np.linspace(0.0, 1.0, n)
    low, high = np.sort(rng.uniform(0.2 * _STEEPEST, _STEEPEST, 2))
    return [_integrated(_path(rng, n, 0.5), -(low + (high - low) * s), length)]


def _bent(rng: np.random.Generator, length: float, diameter: float, n: int) -> list[FloatArray]:
    """Bend a level cable towards the camera or away from it, by 40 to 70 degrees, once or twice."""
    s = np.linspace(0.0, 1.0, n)
    pitch = np.zeros(n)
    ease = 4.0 * diameter / length
    for at in rng.uniform(0.25, 0.75, int(rng.integers(1, 3))):
        turn = rng.choice((-1.0, 1.0)) * rng.uniform(math.radians(40.0), _STEEPEST)
        pitch += turn * smoothstep((s - at) / ease)
    return [_integrated(_path(rng, n, 0.5), np.clip(pitch, -_STEEPEST, _STEEPEST), length)]


def _crossing(rng: np.random.Generator, length: float, diameter: float, n: int) -> list[FloatArray]:
    """Lay a cable on another one, so that they touch where they cross."""
    below = _integrated(_path(rng, n, 0.4), np.zeros(n), length)
    angle = rng.uniform(math.radians(30.0), math.radians(90.0))
    at, other = rng.uniform(0.3, 0.7, 2)
    i, k = int(at * n), int(other * n)
    heading = _path(rng, n, 0.4)
    ahead = below[min(i + 1, n - 1)] - below[i - 1]
    heading += math.atan2(ahead[1], ahead[0]) + angle - heading[k]
    above = _integrated(heading, np.zeros(n), length)
    above += below[i] - above[k]
    reach = 2.0 * diameter / math.sin(angle)
    apart = np.linalg.norm(above[:, :2] - below[i, :2], axis=1)
    above[:, 2] -= 1.02 * diameter * np.exp(-((apart / reach) ** 4))
    arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(above, axis=0), axis=1))))
    even = np.linspace(0.0, arc[-1], n)
    return [below, np.stack([np.interp(even, arc, column) for column in above.T], axis=1)]


_SCENES: dict[str, Callable[[np.random.Generator, float, float, int], list[FloatArray]]] = {
    "flat": _flat,
    "lifted": _lifted,
    "tilted": _tilted,
    "bent": _bent,
    "crossing": _crossing,
}
DEPTH_SCENES = tuple(_SCENES)
"""The kinds of scenes."""


def _render(
    scene: _Scene, camera: PinholeCamera, size: tuple[int, int]
) -> tuple[Rendering, npt.NDArray[np.float32], npt.NDArray[np.intp]]:
    """Return what the camera sees, the depth of the table (H, W), and the number of the cable, -1 for the table."""
    rows, columns = np.mgrid[: size[0], : size[1]]
    rays = np.stack(((columns - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy, np.ones(size)), axis=2)
    background = (scene.level_m / (rays @ scene.normal)).astype(np.float32)
    centers = np.concatenate(scene.axes)
    seen = draw_spheres(centers, np.full(len(centers), scene.radius_m), len(centers), camera, background)
    return seen, background, seen.owner(scene.axes)


def _arc_widths(scene: _Scene, seen: Rendering, which: npt.NDArray[np.intp]) -> npt.NDArray[np.float32]:
    """Return the arc length of the cable that each pixel (H, W) shows, widths, counted on from cable to cable."""
    steps = np.linalg.norm(np.diff(seen.centers, axis=0, prepend=seen.centers[:1]), axis=1)
    steps[np.cumsum([len(axis) for axis in scene.axes])[:-1]] = 0.0
    arc = np.cumsum(steps) / (2.0 * scene.radius_m)
    return np.where(which >= 0, arc[seen.sample], np.nan).astype(np.float32)


def rgbd_camera(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)) -> list[DepthCameraSequence]:
    """Return each kind of scene before cameras with each error by itself, with all and with none: 1600 frames."""
    if not 0.0 < scale <= 100.0 or seed < 0:
        raise InputError(f"expected 0 < scale <= 100 and seed >= 0, got {scale} and {seed}")
    frames = max(1, round(scale * _FRAMES))
    return [DepthCameraSequence(kind, errors, frames, size, seed) for errors in DEPTH_CAMERAS for kind in DEPTH_SCENES]
