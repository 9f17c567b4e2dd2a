"""Round tubes in space as a camera sees them: mask and depth drawn from an axis of which everything is known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs_lab.synthetic.kernels.splatting import splat_spheres

SIZE = (240, 320)
CAMERA = PinholeCamera(fx=300.0, fy=300.0, cx=160.0, cy=120.0)
RADIUS_M = 0.008
_BEHIND_M = 3.0


def draw_tubes(
    axes: Sequence[np.ndarray],
    radius_m: float = RADIUS_M,
    camera: PinholeCamera = CAMERA,
    size: tuple[int, int] = SIZE,
    behind_m: float = _BEHIND_M,
) -> tuple[np.ndarray, np.ndarray]:
    """Return mask (H, W) bool and depth (H, W) float64, m, of tubes around axes (n, 3), drawn in front of a wall."""
    depth = np.full(size, behind_m, np.float32)
    sample = np.full(size, -1, np.int32)
    for axis in axes:
        points = even(np.asarray(axis, float), radius_m / 10.0)
        radii = np.full(len(points), radius_m)
        splat_spheres(points, radii, camera.fx, camera.fy, camera.cx, camera.cy, depth, sample)
    return sample >= 0, depth.astype(np.float64)


def even(points: np.ndarray, step: float) -> np.ndarray:
    """Return points at even distances along a polyline."""
    arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    at = np.linspace(0.0, arc[-1], int(arc[-1] / step) + 2)
    return np.stack([np.interp(at, arc, column) for column in points.T], axis=1)


def straight(start: tuple[float, float, float], end: tuple[float, float, float]) -> np.ndarray:
    """Return the axis from one point to another."""
    return np.linspace(start, end, 200)


def coil() -> np.ndarray:
    """Return an axis that swings in all three directions."""
    t = np.linspace(0.0, 1.0, 400)
    return np.stack((0.6 * t - 0.3, 0.08 * np.sin(7.0 * t), 0.9 + 0.06 * np.cos(9.0 * t) + 0.1 * t), axis=1)


def ring() -> np.ndarray:
    """Return a closed axis, tilted against the image."""
    angle = np.linspace(0.0, 2.0 * np.pi, 400)
    return np.stack((0.16 * np.cos(angle), 0.13 * np.sin(angle), 0.9 + 0.06 * np.cos(angle - 0.7)), axis=1)


def away(points: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the distance of points (n, 3) from an axis (m, 3), m."""
    dense = even(np.asarray(axis, float), 1e-4)
    return np.sqrt(((points[:, None] - dense[None]) ** 2).sum(axis=2).min(axis=1))
