"""With depth: the pixels that stand above the plane on which most of the depth lies."""

from __future__ import annotations

import copy
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.config import DepthConfig, PlaneConfig
from dloftbs.data.depth import to_metres
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.segmentation.kernels import plane_heights as kernels
from dloftbs.support.arrays import FloatArray

_SAMPLES = 4000
"""Pixels that a plane is fitted to.

Source: bounds time; the noise of as many averages out to a fiftieth of a millimetre.
"""
_TRIALS = 100
"""Planes through three pixels each that are tried.

Source: derived; where the plane has half of the pixels, all fail once in 600,000 times.
"""
_SEED = 0
"""Number that the trials are drawn from: the same frames give the same masks.

Source: by definition.
"""
_FITS = 3
"""Times that a plane is fitted to its own pixels.

Source: by hand; the second changes a little, the third nothing.
"""
_HELD = 0.5
"""Weight of a new frame in the plane of a stream.

Source: by hand; noise is halved, and the plane of a table that moves by a millimetre a frame is a millimetre behind.
"""
_LOST = 0.7
"""Share of the pixels that a plane had when it was found: below, the camera has moved, and it is looked for anew.

Source: by hand; a hand before the camera takes less.
"""
_NEIGHBOUR = 0.4
"""Height at a border, as a share of the greatest beside it, from which on a pixel belongs to what stands there.

Source: derived; a round cable on the plane has half of its height at its silhouette, less noise, and pixels between it
and the plane, which a depth camera makes up, have less than half, mostly.
"""
_NOISE = 4.0
"""Least height, as a multiple of the noise of the height.

Source: derived; 30 pixels of a million on the plane have more.
"""
_HOLE_PX = 13
"""Widest hole in depth that is closed, where cable is on both sides.

Source: by hand; depth cameras leave holes about as wide as a cable.
"""


_MAX_TOLERANCE = 5.0
"""Widest tolerance of the pixels of a plane, over the height.

Source: by hand; wider, a box on the table counts as table.
"""
_MAD_TO_SIGMA = 1.4826
"""Standard deviation over the median absolute deviation, of a normal distribution.

Source: by definition.
"""
_NOTHING = 1e-12
"""Least length of a plane's vector, one over metres.

Source: numerics; distances from a plane through nothing stay finite.
"""


class PlaneSegmenter:
    """A callable ``frame -> mask`` that keeps the plane from frame to frame.

    Parameters
    ----------
    config : PlaneConfig
    """

    def __init__(self, config: PlaneConfig) -> None:
        self._config = config
        self._rays: npt.NDArray[np.float32] | None = None
        self._seen_by: PinholeCamera | None = None
        self.reset()

    def reset(self) -> None:
        """Forget the plane."""
        self._plane: FloatArray | None = None
        self._share = 0.0

    def alone(self) -> PlaneSegmenter:
        """Return one that knows no plane; this one keeps its own."""
        other = copy.copy(self)
        other.reset()
        return other

    def __call__(self, frame: Frame) -> npt.NDArray[np.uint8]:
        """Return 1 for the pixels above the plane by more than the height, shape (H, W); none where there is no plane.

        Raises
        ------
        InputError
            If the frame has no depth or no camera.
        """
        if frame.depth is None or frame.camera is None:
            lacking = "depth" if frame.depth is None else "camera"
            raise InputError(f"segmentation.plane needs frames with depth and a camera; {frame!r} has no {lacking}")
        if self._rays is None or self._seen_by != frame.camera or self._rays.shape[1:] != frame.size:
            self.reset()
            self._rays, self._seen_by = _rays(frame.camera, frame.size), frame.camera
        depth_m = to_metres(frame.depth, frame.depth_unit_m, DepthConfig()).astype(np.float32)
        depth_m[np.isnan(self._rays[0])] = np.nan  # beyond the field of the lens
        self._follow(depth_m, self._rays)
        if self._plane is None or not self._plane.any():
            return np.zeros(frame.size, np.uint8)
        heights = np.empty(frame.size, np.uint16)
        kernels.measure_heights(depth_m.ravel(), self._rays.reshape(3, -1), self._plane, heights.ravel())
        return above(heights, self._config.height_m)

    def _follow(self, depth_m: npt.NDArray[np.float32], rays: npt.NDArray[np.float32]) -> None:
        step = max(1, int(np.sqrt(depth_m.size / _SAMPLES)))
        some = depth_m[step // 2 :: step, step // 2 :: step].ravel()
        seen = np.isfinite(some)
        inverse = 1.0 / some[seen].astype(np.float64)
        directions = rays[:, step // 2 :: step, step // 2 :: step].reshape(3, -1)[:, seen].astype(np.float64)
        if len(inverse) < 3:
            return
        tolerance = self._config.height_m
        if self._plane is not None:
            plane = _refined(directions, inverse, self._plane, tolerance)
            if np.mean(_near(directions, inverse, plane, tolerance)) > _LOST * self._share:
                self._plane = (1.0 - _HELD) * self._plane + _HELD * plane
                return
        plane = _found(directions, inverse, tolerance)
        self._plane, self._share = plane, float(np.mean(_near(directions, inverse, plane, tolerance)))


def above(heights: npt.NDArray[np.uint16], least_m: float) -> npt.NDArray[np.uint8]:
    """Return 1 where a height (H, W) is more than the least, and more than noise, with holes in depth closed, else 0.

    The height is smoothed by a median of 3 px, or of 5 where its noise asks for it; borders of holes are as high as the
    highest beside them.

    Parameters
    ----------
    heights : numpy.ndarray, shape (H, W)
        As `kernels.plane_heights` has them.
    least_m : float
    """
    missing = heights == kernels.MISSING
    filled = cv2.dilate(heights, np.ones((3, 3), np.uint8))
    np.copyto(filled, heights, where=~missing)
    filled[filled == kernels.MISSING] = kernels.ON_PLANE
    for side in (3, 5):
        smooth = cv2.medianBlur(filled, side)
        least = max(least_m / kernels.QUANTUM_M, _NOISE * _noise(smooth, missing))
        if least <= least_m / kernels.QUANTUM_M:
            break
    beside = cv2.dilate(smooth, np.ones((5, 5), np.uint8))
    mask = np.empty(heights.shape, np.uint8)
    limit = np.uint16(min(kernels.ON_PLANE + least, np.iinfo(np.uint16).max))
    kernels.mark_standing(smooth.ravel(), beside.ravel(), limit, _NEIGHBOUR, mask.ravel())
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (_HOLE_PX, _HOLE_PX))
    return np.asarray(mask | (cv2.morphologyEx(mask, cv2.MORPH_CLOSE, disc) & missing))


def _noise(heights: npt.NDArray[np.uint16], missing: npt.NDArray[np.bool_]) -> float:
    """Return the standard deviation of the height of the plane, which most pixels lie on, as the heights count it."""
    some = heights[::8, ::8][~missing[::8, ::8]].astype(np.float64)
    return _MAD_TO_SIGMA * float(np.median(np.abs(some - np.median(some)))) if some.size else 0.0


@lru_cache(maxsize=2)
def _rays(camera: PinholeCamera, size: tuple[int, int]) -> npt.NDArray[np.float32]:
    rows, columns = np.mgrid[: size[0], : size[1]]
    pixels = np.column_stack((columns.ravel(), rows.ravel())).astype(np.float64)
    rays = camera.deproject(pixels, np.ones(len(pixels))).T
    return np.ascontiguousarray(rays, dtype=np.float32).reshape(3, *size)


def _found(directions: FloatArray, inverse: FloatArray, tolerance_m: float) -> FloatArray:
    """Return the plane on which most pixels lie, given their rays (3, n) and inverse depths (n,)."""
    rng = np.random.default_rng(_SEED)
    best, most = np.zeros(3), -1
    for _ in range(_TRIALS):
        three = rng.integers(0, len(inverse), 3)
        plane, *_ = np.linalg.lstsq(directions[:, three].T, inverse[three], rcond=None)
        near = int(np.count_nonzero(_near(directions, inverse, plane, tolerance_m)))
        if near > most:
            best, most = plane, near
    return _refined(directions, inverse, best, tolerance_m)


def _refined(directions: FloatArray, inverse: FloatArray, plane: FloatArray, tolerance_m: float) -> FloatArray:
    """Return the plane that fits best to the pixels near to it; those that noise takes farther are near, too."""
    for _ in range(_FITS):
        distance = _distance(directions, inverse, plane)
        noise = _MAD_TO_SIGMA * float(np.median(distance))
        near = distance < np.clip(2.0 * noise, tolerance_m, _MAX_TOLERANCE * tolerance_m)
        if np.count_nonzero(near) < 3:
            return plane
        plane, *_ = np.linalg.lstsq(directions[:, near].T, inverse[near], rcond=None)
    return plane


def _near(directions: FloatArray, inverse: FloatArray, plane: FloatArray, tolerance_m: float) -> npt.NDArray[np.bool_]:
    return np.asarray(_distance(directions, inverse, plane) < tolerance_m)


def _distance(directions: FloatArray, inverse: FloatArray, plane: FloatArray) -> FloatArray:
    """Return the distance of pixels from a plane, in metres."""
    length = max(float(np.linalg.norm(plane)), _NOTHING)
    return np.asarray(np.abs(1.0 - plane @ directions / inverse) / length)
