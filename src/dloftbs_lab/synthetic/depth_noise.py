"""Errors of an RGB-D camera's depth: noise that grows with distance, steps, flying pixels at edges, holes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray

_CONSTANT_M, _QUADRATIC = 0.625e-3, 1.5e-3
_EDGE_M = 0.003
_HOLE_PX = 12.0


def depth_sigma(depth_m: npt.ArrayLike) -> FloatArray:
    """Return the standard deviation of depth, shape (...), m: 1 mm at 0.5 m and 4 mm at 1.5 m, in between as z^2."""
    return _CONSTANT_M + _QUADRATIC * np.square(np.asarray(depth_m, dtype=np.float64))


@dataclass(frozen=True)
class DepthNoise:
    """Amount of each error of depth.

    Parameters
    ----------
    depth_noise : float
        Multiple of `depth_sigma` that is added to every pixel as Gaussian noise.
    hole_share : float
        Share of the cable's visible pixels without depth, and about the same of all others, in blobs about as wide
        as a cable.
    flying : float
        Share of the pixels at edges of more than 3 mm whose depth is a mixture of the surfaces in front and behind.
    grain_px : float
        Correlation of the noise of neighbours: the sigma of the Gaussian that white noise is blurred with, px;
        its deviation stays the same. 0, white noise, is what a time-of-flight camera has; a stereo camera, which
        matches windows, has some px.
    quantum_m : float
        Steps of depth at 1 m; they grow as z^2, since a stereo camera counts in steps of disparity. 0: none.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    depth_noise: float = 0.0
    hole_share: float = 0.0
    flying: float = 0.0
    grain_px: float = 0.0
    quantum_m: float = 0.0

    def __post_init__(self) -> None:
        shares = ("hole_share", "flying")
        for name in ("depth_noise", *shares, "grain_px", "quantum_m"):
            most = 1.0 if name in shares else math.inf
            value = getattr(self, name)
            if not (0.0 <= value <= most and math.isfinite(value)):
                raise InputError(f"{name} must be a finite number in 0..{most:g}, got {value}")

    def apply(
        self, depth: npt.NDArray[np.float32], mask: npt.NDArray[np.bool_], rng: np.random.Generator
    ) -> npt.NDArray[np.float32]:
        """Return `depth` (H, W) m as the camera measures it, 0 where there is none; `mask` (H, W) is the cable."""
        if self.flying > 0.0:
            depth = with_flying_pixels(depth, self.flying, rng)
        if self.depth_noise > 0.0:
            sigma = np.float32(_CONSTANT_M) + np.float32(_QUADRATIC) * depth * depth
            depth = depth + np.float32(self.depth_noise) * sigma * self._grain(depth.shape, rng)
        if self.quantum_m > 0.0:
            depth = in_steps(depth, self.quantum_m)
        if self.hole_share > 0.0 and mask.any():
            depth = np.where(holes(mask, self.hole_share, rng), np.float32(0.0), depth)
        return depth

    def _grain(self, shape: tuple[int, ...], rng: np.random.Generator) -> npt.NDArray[np.float32]:
        """Return noise (H, W) of unit variance."""
        white = rng.standard_normal(shape, dtype=np.float32)
        if self.grain_px == 0.0:
            return white
        reach = math.ceil(4.0 * self.grain_px)
        weights = cv2.getGaussianKernel(2 * reach + 1, self.grain_px, cv2.CV_32F)
        # A weighted sum of white noise has the sum of the squared weights as its variance.
        weights /= np.sqrt(np.square(weights).sum())
        return cv2.sepFilter2D(white, -1, weights, weights, borderType=cv2.BORDER_REFLECT_101)


PERFECT_DEPTH = DepthNoise()
TYPICAL_NOISE = DepthNoise(depth_noise=1.0, hole_share=0.05, flying=0.5)
"""Of a depth camera on cables: sigma as `depth_sigma`, holes over 5 % of the cable, flying pixels."""


def in_steps(depth: npt.NDArray[np.float32], quantum_m: float) -> npt.NDArray[np.float32]:
    """Return depth whose inverse is a whole number of steps; a step of the inverse is one of depth at 1 m."""
    counts = np.rint(1.0 / (quantum_m * depth.astype(np.float64)))
    return (1.0 / (quantum_m * np.maximum(counts, 1.0))).astype(np.float32)


def with_flying_pixels(
    depth: npt.NDArray[np.float32], share: float, rng: np.random.Generator
) -> npt.NDArray[np.float32]:
    """Return depth in which a share of the pixels at edges of more than 3 mm lie between the two surfaces."""
    kernel = np.ones((3, 3), np.uint8)
    near, far = cv2.erode(depth, kernel), cv2.dilate(depth, kernel)
    edge = np.flatnonzero(far - near > _EDGE_M)
    edge = edge[rng.random(len(edge)) < share]
    near, far = near.ravel()[edge], far.ravel()[edge]
    result = depth.copy()
    result.ravel()[edge] = near + rng.random(len(edge), dtype=np.float32) * (far - near)
    return result


def holes(mask: npt.NDArray[np.bool_], share: float, rng: np.random.Generator) -> npt.NDArray[np.bool_]:
    """Return where a smooth random field is high, the level being such that `share` of the mask is."""
    cell = max(3.0, _HOLE_PX * mask.shape[0] / 720.0)
    coarse = tuple(math.ceil(side / cell) + 1 for side in mask.shape)
    field = cv2.resize(rng.standard_normal(coarse, dtype=np.float32), mask.shape[::-1], interpolation=cv2.INTER_CUBIC)
    return field > np.quantile(field[mask], 1.0 - share)
