"""What an RGB-D camera does to depth: noise that grows with distance, flying pixels at edges, holes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.errors import InputError

_CONSTANT_M, _QUADRATIC = 0.625e-3, 1.5e-3
_EDGE_M = 0.003
_HOLE_PX = 12.0


def depth_sigma(depth_m: npt.ArrayLike) -> FloatArray:
    """Return the standard deviation of depth, shape (...), m: 1 mm at 0.5 m and 4 mm at 1.5 m, in between as z^2."""
    return _CONSTANT_M + _QUADRATIC * np.square(np.asarray(depth_m, dtype=np.float64))


@dataclass(frozen=True)
class DepthNoise:
    """How imperfect depth is.

    Parameters
    ----------
    depth_noise : float
        Multiple of `depth_sigma` that is added to every pixel as Gaussian noise.
    hole_share : float
        Share of the cable's visible pixels without depth, and about the same of all others, in blobs about as wide
        as a cable.
    flying : float
        Share of the pixels at edges of more than 3 mm whose depth is a mixture of what is in front and what is behind.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    depth_noise: float = 0.0
    hole_share: float = 0.0
    flying: float = 0.0

    def __post_init__(self) -> None:
        ranges = (("depth_noise", math.inf), ("hole_share", 1.0), ("flying", 1.0))
        for name, most in ranges:
            value = getattr(self, name)
            if not (0.0 <= value <= most and math.isfinite(value)):
                raise InputError(f"{name} must be a finite number in 0..{most:g}, got {value}")

    def apply(
        self, depth: npt.NDArray[np.float32], mask: npt.NDArray[np.bool_], rng: np.random.Generator
    ) -> npt.NDArray[np.float32]:
        """Return `depth` (H, W) m as the camera measures it, 0 where there is none; `mask` (H, W) is the cable."""
        if self.flying > 0.0:
            depth = _with_flying_pixels(depth, self.flying, rng)
        if self.depth_noise > 0.0:
            sigma = np.float32(_CONSTANT_M) + np.float32(_QUADRATIC) * depth * depth
            grain = rng.standard_normal(depth.shape, dtype=np.float32)
            depth = depth + np.float32(self.depth_noise) * sigma * grain
        if self.hole_share > 0.0 and mask.any():
            depth = np.where(_holes(mask, self.hole_share, rng), np.float32(0.0), depth)
        return depth


def _with_flying_pixels(
    depth: npt.NDArray[np.float32], share: float, rng: np.random.Generator
) -> npt.NDArray[np.float32]:
    kernel = np.ones((3, 3), np.uint8)
    near, far = cv2.erode(depth, kernel), cv2.dilate(depth, kernel)
    edge = np.flatnonzero(far - near > _EDGE_M)
    edge = edge[rng.random(len(edge)) < share]
    near, far = near.ravel()[edge], far.ravel()[edge]
    result = depth.copy()
    result.ravel()[edge] = near + rng.random(len(edge), dtype=np.float32) * (far - near)
    return result


def _holes(mask: npt.NDArray[np.bool_], share: float, rng: np.random.Generator) -> npt.NDArray[np.bool_]:
    """Return where a smooth random field is high, the level being such that `share` of the mask is."""
    cell = max(3.0, _HOLE_PX * mask.shape[0] / 720.0)
    coarse = tuple(math.ceil(side / cell) + 1 for side in mask.shape)
    field = cv2.resize(rng.standard_normal(coarse, dtype=np.float32), mask.shape[::-1], interpolation=cv2.INTER_CUBIC)
    result: npt.NDArray[np.bool_] = field > np.quantile(field[mask], 1.0 - share)
    return result
