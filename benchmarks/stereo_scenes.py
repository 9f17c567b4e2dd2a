"""Scenes before two cameras, with the true axes in space: the recorded motion of real cables, and drawn ones."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from dloftbs import PinholeCamera
from dloftbs_lab.synthetic.motion_capture import recordings_in
from dloftbs_lab.synthetic.simulation import EXPERIMENTS, simulate
from dloftbs_lab.synthetic.simulation import RADIUS_M as SIMULATED_RADIUS_M
from dloftbs_lab.synthetic.space_scene import draw_spheres

Points = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

SIZE = (720, 1280)
FOCAL_PX = 900.0
WIDTH_PX = 12.0
FPS = 30.0
_SIMULATED_FRAMES = 120
_SPHERES = 8.0
"""Spheres a radius; see `dloftbs_lab.synthetic.space_scene`."""


@dataclass(frozen=True)
class TwoViews:
    """Two cameras and cables that move before them.

    Parameters
    ----------
    cameras : (PinholeCamera, PinholeCamera)
    second : numpy.ndarray, shape (4, 4)
        Pose of the second camera in the first one's frame: it takes points of the second to the first.
    axes : callable
        From seconds to the axes, each (n, 3) m in the first camera's frame.
    radius_m : float
    """

    cameras: tuple[PinholeCamera, PinholeCamera]
    second: Points
    axes: Callable[[float], list[Points]]
    radius_m: float

    def in_view(self, view: int, axes: list[Points]) -> list[Points]:
        """Return axes in the frame of a camera."""
        if view == 0:
            return axes
        turn, shift = self.second[:3, :3], self.second[:3, 3]
        return [(axis - shift) @ turn for axis in axes]

    def mask(self, view: int, second: float) -> tuple[Mask, npt.NDArray[np.intp]]:
        """Return the mask of a view and the cable in each pixel, -1 where there is none."""
        axes = self.in_view(view, self.axes(second))
        centers = np.concatenate(axes)
        far = np.full(SIZE, np.inf, np.float32)
        radius = np.full(len(centers), self.radius_m)
        seen = draw_spheres(centers, radius, len(centers), self.cameras[view], far)
        return seen.mask, seen.owner(axes)


def pose_beside(baseline_m: float, distance_m: float, toe_in: float) -> Points:
    """Return the pose of a second camera to the right that turns a share of the way towards the middle."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.0, -toe_in * math.atan2(baseline_m, distance_m), 0.0]).as_matrix()
    pose[0, 3] = baseline_m
    return pose


def disturbed(pose: Points, rotation_std_deg: float, rng: np.random.Generator) -> Points:
    """Return a pose that is turned by errors of this standard deviation about each axis."""
    wrong = pose.copy()
    wrong[:3, :3] = pose[:3, :3] @ Rotation.from_rotvec(np.radians(rng.normal(0.0, rotation_std_deg, 3))).as_matrix()
    return wrong


def shifted(camera: PinholeCamera, pixel_std: float, rng: np.random.Generator) -> PinholeCamera:
    """Return a camera whose principal point is wrong by errors of this standard deviation."""
    off = rng.normal(0.0, pixel_std, 2)
    return replace(camera, cx=camera.cx + float(off[0]), cy=camera.cy + float(off[1]))


def real_motion_views(
    folder: Path, seed: int, *, cables: int = 1, baseline_m: float = 0.06, distance_m: float = 0.8, toe_in: float = 0.0
) -> TwoViews:
    """Return cables of recorded motion, seen from any side, the best in view of some draws."""
    recordings = recordings_in(folder)
    rng = np.random.default_rng([seed, cables])
    camera = PinholeCamera(FOCAL_PX, FOCAL_PX, 639.5 + 3.2, 359.5 - 2.1, size=SIZE)
    second = pose_beside(baseline_m, distance_m, toe_in)
    radius_m = 0.5 * WIDTH_PX * distance_m / FOCAL_PX
    chosen = rng.choice(len(recordings), cables, replace=False).tolist()
    best: tuple[float, list[tuple[Points, Points]]] = (-1.0, [])
    for _ in range(30):
        places: list[tuple[Points, Points]] = []
        inside: list[float] = []
        looking = Rotation.from_quat(rng.normal(size=4)).as_matrix()
        for number in chosen:
            markers = recordings[number].markers
            turn = looking @ Rotation.from_rotvec([0.0, 0.0, rng.uniform(0.0, 2.0 * math.pi)]).as_matrix()
            way = rng.normal(size=3)
            shift = rng.uniform(0.0, 0.15) * way / np.linalg.norm(way) if cables > 1 else np.zeros(3)
            shift = shift - turn @ markers.reshape(-1, 3).mean(axis=0) + (0.0, 0.0, distance_m)
            places.append((turn, shift))
            points = markers.reshape(-1, 3) @ turn.T + shift
            for origin in (np.eye(4), second):
                local = (points - origin[:3, 3]) @ origin[:3, :3]
                front = local[:, 2] > 0.3
                at = camera._project(np.where(front[:, None], local, 1.0))
                inside.append(float((front & (at >= 10.0).all(axis=1) & (at <= (1269.0, 709.0)).all(axis=1)).mean()))
        if min(inside) > best[0]:
            best = (min(inside), places)

    def axes(time_s: float) -> list[Points]:
        lines = []
        for number, (turn, shift) in zip(chosen, best[1], strict=True):
            count = math.ceil(_SPHERES * recordings[number].length_m / radius_m) + 1
            lines.append(recordings[number].axis(time_s, count) @ turn.T + shift)
        return lines

    return TwoViews((camera, camera), second, axes, radius_m)


def simulated_views(seed: int, *, baseline_m: float = 0.06, distance_m: float = 0.8) -> TwoViews:
    """Return a cable that MuJoCo moves; the seed says which experiment it is, and from where it is seen."""
    rng = np.random.default_rng([8, seed])
    kinds = list(EXPERIMENTS)
    experiment = EXPERIMENTS[kinds[seed % len(kinds)]](rng)
    azimuth, elevation = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(*experiment.elevation)
    level = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    forward = math.cos(elevation) * level - np.array([0.0, 0.0, math.sin(elevation)])
    right = np.array([level[1], -level[0], 0.0])
    looking = np.stack((right, np.cross(forward, right), forward))
    nodes = simulate(experiment, rng, _SIMULATED_FRAMES) @ looking.T
    nodes += (0.5 * baseline_m, 0.0, distance_m) - nodes.reshape(-1, 3).mean(axis=0)
    moving = CubicSpline(np.arange(len(nodes)) / FPS, nodes)
    camera = PinholeCamera(FOCAL_PX, FOCAL_PX, 639.5 + 3.2, 359.5 - 2.1, size=SIZE)
    length_m = float(np.linalg.norm(np.diff(nodes[0], axis=0), axis=1).sum())
    count = math.ceil(_SPHERES * length_m / SIMULATED_RADIUS_M) + 1

    def axes(time_s: float) -> list[Points]:
        along = np.arange(nodes.shape[1])
        return [CubicSpline(along, moving(time_s))(np.linspace(0.0, along[-1], count))]

    return TwoViews((camera, camera), pose_beside(baseline_m, distance_m, 0.0), axes, SIMULATED_RADIUS_M)


def drawn_views(seed: int, *, cables: int = 1, baseline_m: float = 0.06, distance_m: float = 0.8) -> TwoViews:
    """Return smooth random cables that sway, by splines through points of their own."""
    rng = np.random.default_rng([7, seed, cables])
    camera = PinholeCamera(FOCAL_PX, FOCAL_PX, 639.5, 359.5, size=SIZE)
    radius_m = 0.5 * WIDTH_PX * distance_m / FOCAL_PX
    lines = []
    for _ in range(cables):
        along = np.linspace(-0.35, 0.35, 6) * distance_m
        across = rng.normal(0.0, 0.07 * distance_m, (6, 2))
        turn = Rotation.from_rotvec([0.0, 0.0, rng.uniform(0.0, 2.0 * math.pi)]).as_matrix()
        points = np.column_stack((along, across)) * (1.0, 0.6, 1.0)
        lines.append((points @ turn.T + (0.0, 0.0, distance_m), rng.normal(0.0, 0.02, (6, 3))))

    def axes(time_s: float) -> list[Points]:
        found = []
        for points, sway in lines:
            spline = CubicSpline(np.linspace(0.0, 1.0, 6), points + sway * math.sin(2.0 * time_s))
            fine = spline(np.linspace(0.0, 1.0, 4000))
            arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))))
            even = np.linspace(0.0, arc[-1], math.ceil(_SPHERES * arc[-1] / radius_m) + 1)
            found.append(np.stack([np.interp(even, arc, values) for values in fine.T], axis=1))
        return found

    return TwoViews((camera, camera), pose_beside(baseline_m, distance_m, 0.0), axes, radius_m)
