"""Sequences of cables that MuJoCo moves, seen by a pinhole camera: motion, perspective and bends that nobody drew."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.free_ends import FreeEnd, draw_cable_mask
from dloftbs_lab.synthetic.generated import NumberedSequence, check_choice, numbers_at
from dloftbs_lab.synthetic.simulation import EXPERIMENTS, simulate
from dloftbs_lab.synthetic.space_axis import curve_through_samples
from dloftbs_lab.truth import Truth

SIMULATED_KINDS = tuple(EXPERIMENTS)
"""Experiments with the cable."""

_FRAMES = 40
_FPS = 30.0
_VGA = (480, 640)
_FOCAL_PX = 600.0  # VGA, as all that follows
_WIDTHS_PX = (4.0, 20.0)
_TOLERANCE_PX = 10.0  # 15 px in HD
_MARGIN_PX = 24.0
_NEAREST_M = 0.4
_FARTHER = 1.04
_SAMPLES_PER_NODE = 48


class SimulatedSequence(NumberedSequence):
    """Perfect masks of one simulated cable, with the projected centre line. It needs MuJoCo.

    Parameters
    ----------
    kind : str
        One of `SIMULATED_KINDS`.
    number : int
        Number within the kind.
    frames : int
        Number of frames that the experiment takes, at 30 a second.
    size, seed
        As `GeneratedSequence` has them; another seed gives another cable and another camera.

    Attributes
    ----------
    family : str
        The kind.
    cables : int

    Raises
    ------
    InputError
        If a value is out of range; and from `frame` and `truth`, if MuJoCo is not installed.
    """

    cables = 1

    def __init__(
        self, kind: str, number: int = 0, frames: int = _FRAMES, size: tuple[int, int] = _VGA, seed: int = 0
    ) -> None:
        check_choice("kind", kind, SIMULATED_KINDS)
        name, key = f"simulated {kind}", (SIMULATED_KINDS.index(kind),)
        super().__init__(name, name, key, number, frames, size, seed, _FPS)
        self._kind = kind
        self._scale = min(size[0] / _VGA[0], size[1] / _VGA[1])
        self.tolerance_px = _TOLERANCE_PX * self._scale
        self.width_px = max(1.0, float(self._rng(0).uniform(*_WIDTHS_PX)) * self._scale)

    def _make_frame(self, index: int) -> Frame:
        return replace(super()._make_frame(index), camera=self._camera)

    def _make_truth(self, index: int) -> Truth:
        nodes = self._nodes[index]
        steps = np.arange(len(nodes), dtype=np.float64)
        dense = CubicSpline(steps, nodes)(np.linspace(0.0, steps[-1], _SAMPLES_PER_NODE * len(nodes)))
        points = self._camera.project(dense)
        widths = self.width_px * self._middle_m / dense[:, 2]
        return Truth((curve_through_samples(points),), (draw_cable_mask(points, widths, self.size, self._ends),), (0,))

    @property
    def _camera(self) -> PinholeCamera:
        focal = _FOCAL_PX * self._scale
        return PinholeCamera(focal, focal, (self.size[1] - 1) / 2.0, (self.size[0] - 1) / 2.0)

    @cached_property
    def _nodes(self) -> FloatArray:
        """Nodes of all frames as the camera sees them, shape (frames, n, 3) m."""
        experiment = EXPERIMENTS[self._kind](self._rng(1))
        turned = simulate(experiment, self._rng(2), self._frames) @ _looking(self._rng(3), experiment.elevation).T
        room = np.array(self.size[::-1]) - 2.0 * (_MARGIN_PX * self._scale + self.width_px)
        distance = _NEAREST_M
        while True:
            placed = self._centred(turned, distance)
            seen = self._camera.project(placed.reshape(-1, 3))
            if (np.ptp(seen, axis=0) <= room).all():
                return placed
            distance *= _FARTHER

    def _centred(self, turned: FloatArray, distance_m: float) -> FloatArray:
        """Put nodes (frames, n, 3) before the camera, the nearest as far as said, in the middle of the image."""
        camera = self._camera
        placed = turned - turned.reshape(-1, 3).mean(axis=0)
        placed[..., 2] += distance_m - placed[..., 2].min()
        middle = np.array([camera.cx, camera.cy])
        for _ in range(8):
            seen = camera.project(placed.reshape(-1, 3))
            off = middle - (seen.min(axis=0) + seen.max(axis=0)) / 2.0
            placed[..., :2] += off * distance_m / camera.fx
        return placed

    @cached_property
    def _middle_m(self) -> float:
        """Depth at which the cable is as wide as `width_px`."""
        return float(np.median(self._nodes[..., 2]))

    @cached_property
    def _ends(self) -> tuple[FreeEnd, FreeEnd]:
        rng = self._rng(4)
        return FreeEnd.draw(rng), FreeEnd.draw(rng)


def _looking(rng: np.random.Generator, elevations: tuple[float, float]) -> FloatArray:
    """Draw where the camera looks from; return its axes x, y and z in the world, shape (3, 3), one a row."""
    azimuth, elevation = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(*elevations)
    level = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    forward = math.cos(elevation) * level - np.array([0.0, 0.0, math.sin(elevation)])
    right = np.array([level[1], -level[0], 0.0])
    return np.stack((right, np.cross(forward, right), forward))


def simulated(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = _VGA) -> list[SimulatedSequence]:
    """Return 20 sequences of each of the `SIMULATED_KINDS`, by the scale, 40 frames each."""
    return [
        SimulatedSequence(kind, number, _FRAMES, size, seed) for kind in SIMULATED_KINDS for number in numbers_at(scale)
    ]
