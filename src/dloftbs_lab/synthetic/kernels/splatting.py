"""Drawing round things into a depth image: spheres into a z-buffer, so that a dense row of them is a tube."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float32, float64, int32

from dloftbs.kernels.compiler import kernel, read, write


@kernel(
    read(float64, 2), read(float64, 1), float64, float64, float64, float64, write(float32, 2, "C"), write(int32, 2, "C")
)
def splat_spheres(
    centers: npt.NDArray[np.float64],
    radius: npt.NDArray[np.float64],
    fx: float,
    fy: float,
    cx: float,
    cy: float,
    depth: npt.NDArray[np.float32],
    sample: npt.NDArray[np.int32],
) -> None:
    """Draw spheres as a pinhole camera sees them, the nearest surface in front.

    A pixel is covered where the ray through its centre meets the sphere. A tube is its axis sampled: with samples
    `d` apart its surface lies at most ``d**2 / (8 radius)`` too deep on a straight piece, where it faces the camera.

    Not checked: every sphere lies in front of the camera (z > radius), and the shapes agree.

    Parameters
    ----------
    centers : (n, 3) float64
        In the camera's frame, metres.
    radius : (n,) float64
        Metres, positive.
    fx, fy, cx, cy : float
        The camera's focal lengths and principal point, px.
    depth : (H, W) float32
        Metres along z; comes with the depth behind, or infinity, and is lowered where a sphere is nearer.
    sample : (H, W) int32
        Is set, where `depth` is lowered, to the number of the sphere.
    """
    rows, columns = depth.shape
    for k in range(len(radius)):
        x, y, z, r = centers[k, 0], centers[k, 1], centers[k, 2], radius[k]
        power = x * x + y * y + z * z - r * r  # squared length of the tangents from the camera
        scale = 1.0 / (z * z - r * r)
        # Where the planes through the camera's axes touch the sphere.
        reach_x = r * math.sqrt(x * x + z * z - r * r)
        reach_y = r * math.sqrt(y * y + z * z - r * r)
        left = max(0, math.ceil(cx + fx * (x * z - reach_x) * scale))
        right = min(columns - 1, math.floor(cx + fx * (x * z + reach_x) * scale))
        top = max(0, math.ceil(cy + fy * (y * z - reach_y) * scale))
        bottom = min(rows - 1, math.floor(cy + fy * (y * z + reach_y) * scale))
        for row in range(top, bottom + 1):
            vy = (row - cy) / fy
            along_y, square_y = vy * y + z, vy * vy + 1.0
            for column in range(left, right + 1):
                vx = (column - cx) / fx
                along = vx * x + along_y
                inside = along * along - (vx * vx + square_y) * power
                if inside >= 0.0:
                    # The nearer root; in this form nothing cancels.
                    near = np.float32(power / (along + math.sqrt(inside)))
                    if near < depth[row, column]:
                        depth[row, column] = near
                        sample[row, column] = k
