"""Depth of drawn gaps: cables on a table or above it, and what covers them, as a depth camera measures it."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs import PinholeCamera
from dloftbs_lab.synthetic.depth_camera import DEPTH_CAMERAS

FOCAL_PX = 900.0
_DISTANCE_M = (0.35, 1.3)
_SLOPE = 0.3
"""Largest slope of the table along rows and columns."""
_LIFT_M = (0.005, 0.15)
"""Greatest height of a cable over the table; half of them lie on it."""
_LIFT_PX = (200.0, 600.0)
"""Length of a wave of that height."""
_OVER_M = (0.004, 0.12)
"""Height of a strip over the highest place that it covers."""

_Floats = npt.NDArray[np.float64]


class Relief:
    """Heights over a table, m, seen from above.

    Parameters
    ----------
    size : (int, int)
        ``(H, W)`` px.
    rng : numpy.random.Generator
    """

    def __init__(self, size: tuple[int, int], rng: np.random.Generator) -> None:
        self._rng = rng
        height, width = size
        row, column = np.mgrid[:height, :width]
        across, down = rng.uniform(-_SLOPE, _SLOPE, 2)
        away = 1.0 - (across * (column - 0.5 * width) + down * (row - 0.5 * height)) / FOCAL_PX
        self._table: _Floats = rng.uniform(*_DISTANCE_M) / away
        lift = rng.uniform(*_LIFT_M) if rng.random() < 0.5 else 0.0
        phase = 2.0 * np.pi * column / rng.uniform(*_LIFT_PX) + rng.uniform(0.0, 2.0 * np.pi)
        self._lift: _Floats = 0.5 * lift * (1.0 + np.sin(phase))
        self._heights: _Floats = np.zeros(size)
        self._along: npt.NDArray[np.float32] = np.full(size, np.nan, np.float32)
        self._columns = column

    def add_cable(self, drawn: npt.NDArray[np.bool_], width: float) -> None:
        """Add a round cable, or a part of one, that covers some pixels; its width in px."""
        inside = cv2.distanceTransform(drawn.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        radius = 0.5 * width
        beside = np.clip(radius - inside, 0.0, radius)
        top = (radius + np.sqrt(radius**2 - beside**2)) * self._table / FOCAL_PX + self._lift
        self._heights[drawn] = np.maximum(self._heights, top)[drawn]
        self._along[drawn] = (self._columns / width)[drawn]

    def add_cover(self, pixels: npt.NDArray[np.bool_]) -> None:
        """Add something parallel to the table over all that it covers."""
        if pixels.any():
            self._heights[pixels] = self._heights[pixels].max() + self._rng.uniform(*_OVER_M)
            self._along[pixels] = np.nan

    def measure(self, mask: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.float32], PinholeCamera]:
        """Return depth (H, W), m, with the errors of a depth camera that is drawn, and the camera.

        Stereo cameras with all errors are as frequent as all others together.
        """
        names = list(DEPTH_CAMERAS)
        name = "all" if self._rng.random() < 0.5 else names[int(self._rng.integers(len(names)))]
        errors = DEPTH_CAMERAS[name]
        height, width = mask.shape
        moved = np.column_stack((np.eye(2), errors.displacement(self._rng)))

        def displaced(image: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
            given = image.astype(np.float32)
            nearest, edge = cv2.INTER_NEAREST, cv2.BORDER_REPLICATE
            return np.asarray(cv2.warpAffine(given, moved, (width, height), flags=nearest, borderMode=edge), np.float32)

        surfaces = [displaced(one) for one in (self._table - self._heights, self._table, self._along)]
        depth = errors.measure(surfaces[0], surfaces[1], surfaces[2], mask, self._rng)
        return depth.astype(np.float32), PinholeCamera(FOCAL_PX, FOCAL_PX, 0.5 * width, 0.5 * height)
