"""Curves in space before two cameras: the masks that they make, for tests of rigs."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from dloftbs import BSplineCurve, CameraRig, PinholeCamera
from dloftbs_lab.synthetic.space_scene import draw_spheres

SIZE = (240, 320)
CAMERA = PinholeCamera(300.0, 300.0, 159.5, 119.5, size=SIZE)
RADIUS_M = 0.006


def beside(baseline_m: float, turn: float = 0.0) -> npt.NDArray[np.float64]:
    """Return the pose of a second camera to the right, turned to the left by radians."""
    pose = np.eye(4)
    pose[0, 0] = pose[2, 2] = math.cos(turn)
    pose[0, 2], pose[2, 0] = -math.sin(turn), math.sin(turn)
    pose[0, 3] = baseline_m
    return pose


def rig(baseline_m: float = 0.1, turn: float = 0.0, camera: PinholeCamera = CAMERA) -> CameraRig:
    """Return a rig of two equal cameras."""
    return CameraRig([camera, camera], [np.eye(4), beside(baseline_m, turn)])


def axis_through(points: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return a smooth line through points in space, densely."""
    points = np.asarray(points, float)
    return CubicSpline(np.linspace(0.0, 1.0, len(points)), points)(np.linspace(0.0, 1.0, 1500))


BENT = axis_through([(-0.12, -0.15, 0.62), (0.0, -0.08, 0.6), (0.08, 0.0, 0.64), (0.02, 0.1, 0.7), (0.08, 0.17, 0.72)])
OTHER = axis_through([(-0.2, 0.02, 0.75), (-0.14, 0.1, 0.72), (-0.1, 0.0, 0.7), (-0.16, -0.1, 0.68)])


def masks(cameras: CameraRig, *axes: npt.NDArray[np.float64]) -> list[npt.NDArray[np.bool_]]:
    """Return the mask of tubes around axes in the first camera's frame in each view, without its lens."""
    drawn = []
    for camera, pose in zip(cameras.cameras, cameras.poses, strict=True):
        centers = np.concatenate([(axis - pose[:3, 3]) @ pose[:3, :3] for axis in axes])
        far = np.full(SIZE, np.inf, np.float32)
        drawn.append(draw_spheres(centers, np.full(len(centers), RADIUS_M), len(centers), camera, far).mask)
    return drawn


def angular_mask(
    camera: PinholeCamera, size: tuple[int, int], centers: npt.NDArray[np.float64], radius_m: float
) -> npt.NDArray[np.bool_]:
    """Return the mask of a tube around an axis in a camera's frame, by the angles of pixels' rays, with the lens."""
    seen = camera.project(centers)
    margin = 4.0 * camera.fx * radius_m / centers[:, 2].min()
    low = np.clip(seen.min(axis=0) - margin, 0, size[::-1]).astype(int)
    high = np.clip(seen.max(axis=0) + margin, 0, size[::-1]).astype(int)
    pixels = np.stack(np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1])), axis=-1)
    rays = camera.lens.undistorted((pixels - (camera.cx, camera.cy)) / (camera.fx, camera.fy))
    looks = np.concatenate((rays, np.ones((*rays.shape[:2], 1))), axis=2)
    far = np.linalg.norm(centers, axis=1)
    chord, nearest = cKDTree(centers / far[:, None]).query(looks / np.linalg.norm(looks, axis=2)[..., None])
    mask = np.zeros(size, bool)
    mask[low[1] : high[1], low[0] : high[0]] = 2.0 * np.arcsin(0.5 * chord) < np.arcsin(radius_m / far[nearest])
    return mask


def depths_m(cameras: CameraRig, axis: npt.NDArray[np.float64], view: int) -> npt.NDArray[np.float32]:
    """Return the depth image of one view, with the ground at 1.5 m."""
    pose = cameras.poses[view]
    centers = (axis - pose[:3, 3]) @ pose[:3, :3]
    ground = np.full(SIZE, 1.5, np.float32)
    return draw_spheres(centers, np.full(len(axis), RADIUS_M), len(axis), cameras.cameras[view], ground).depth


def distances_m(curve: BSplineCurve, axis: npt.NDArray[np.float64], count: int = 101) -> npt.NDArray[np.float64]:
    """Return how far even points of a curve lie from an axis, leaving out the ends."""
    points = curve(np.linspace(0.03, 0.97, count))
    return np.sqrt(((points[:, None] - axis[None]) ** 2).sum(axis=2)).min(axis=1)
