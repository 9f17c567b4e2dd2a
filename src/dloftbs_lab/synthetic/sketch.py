"""Sprites: small drawings with soft edges and a shadow, made from distance functions and pasted at any angle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.support.arrays import FloatArray

Image = npt.NDArray[np.uint8]
Point = tuple[float, float]

LIGHT = np.array([-0.42, -0.58, 0.70])
"""Direction towards the lamp: x to the right, y down, z to the camera."""
SHADOW_SIDE = np.array([0.59, 0.81])
"""Direction in which shadows fall, in the image."""


def halfway(light: FloatArray) -> FloatArray:
    """Return the unit vector (3,) between the lamp and the camera: a surface that faces it shines."""
    middle = np.add(light, (0.0, 0.0, 1.0))
    return middle / np.linalg.norm(middle)


def smooth_noise(rng: np.random.Generator, shape: tuple[int, int], cell: tuple[float, float]) -> FloatArray:
    """Return noise in -1..1, shape `shape`, that varies over `cell` pixels (rows, columns)."""
    grid = [max(4, math.ceil(n / c) + 3) for n, c in zip(shape, cell, strict=True)]
    coarse = rng.uniform(-1.0, 1.0, grid).astype(np.float32)
    size = (math.ceil(grid[1] * cell[1]), math.ceil(grid[0] * cell[0]))
    fine = cv2.resize(coarse, (max(size[0], shape[1]), max(size[1], shape[0])), interpolation=cv2.INTER_CUBIC)
    return np.asarray(fine[: shape[0], : shape[1]], dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Sprite:
    """A drawing ready to be pasted.

    Parameters
    ----------
    colour : numpy.ndarray, shape (h, w, 3), uint8
        BGR, multiplied by the coverage.
    alpha : numpy.ndarray, shape (h, w), uint8
        Coverage.
    shadow : numpy.ndarray, shape (h, w), uint8
        Share of light that the drawing takes from the ground under it.
    origin : (float, float)
        The point of the drawing, px, that lands on the position given when pasting.
    drop_px : float
        Length of the shadow.
    """

    colour: Image
    alpha: Image
    shadow: Image
    origin: Point
    drop_px: float

    def paste(self, canvas: Image, position: Point, angle: float) -> None:
        """Draw onto `canvas` (H, W, 3) with its shadow, turned by `angle` radians about the origin."""
        drop = self.drop_px * SHADOW_SIDE
        fallen = _warp(self.shadow, self.origin, (position[0] + drop[0], position[1] + drop[1]), angle, canvas.shape)
        if fallen is not None:
            _dim(canvas[fallen[0]], fallen[1])
        drawn = _warp(self.colour, self.origin, position, angle, canvas.shape)
        covered = _warp(self.alpha, self.origin, position, angle, canvas.shape)
        if drawn is not None and covered is not None:
            view = canvas[drawn[0]]
            _dim(view, covered[1])
            cv2.add(view, drawn[1], dst=view)

    def cover(self, mask: npt.NDArray[np.bool_], position: Point, angle: float) -> None:
        """Set `mask` (H, W) where the pasted drawing hides more than half of a pixel."""
        covered = _warp(self.alpha, self.origin, position, angle, mask.shape)
        if covered is not None:
            mask[covered[0]] |= covered[1] > 127


def _dim(view: Image, loss: Image) -> None:
    """Take the share `loss` (h, w) / 255 of its light from `view` (h, w, 3)."""
    cv2.multiply(view, cv2.cvtColor(255 - loss, cv2.COLOR_GRAY2BGR), dst=view, scale=1.0 / 255.0)


def _warp(
    picture: Image, origin: Point, position: Point, angle: float, shape: tuple[int, ...]
) -> tuple[tuple[slice, slice], Image] | None:
    """Return the region of an image (H, W, ...) that the turned picture touches and what it shows there, if any."""
    cos, sin = math.cos(angle), math.sin(angle)
    turn = np.array([[cos, -sin], [sin, cos]])
    offset = np.asarray(position) - turn @ np.asarray(origin)
    height, width = picture.shape[:2]
    corners = np.array([[0, 0], [width, 0], [0, height], [width, height]]) @ turn.T + offset
    left, top = (int(v) for v in np.maximum(np.floor(corners.min(axis=0)), 0))
    right, bottom = (int(v) for v in np.minimum(np.ceil(corners.max(axis=0)) + 1, [shape[1], shape[0]]))
    if left >= right or top >= bottom:
        return None
    matrix = np.column_stack((turn, offset - [left, top]))
    warped = cv2.warpAffine(picture, matrix, (right - left, bottom - top), flags=cv2.INTER_LINEAR)
    return (slice(top, bottom), slice(left, right)), np.asarray(warped, dtype=np.uint8)


class Sketch:
    """A drawing board whose unit, the design px, is a pixel of a 1280 x 720 image.

    Parameters
    ----------
    left, top, right, bottom : float
        Extent of the board around the origin, design px.
    scale : float
        Pixels per design px.
    """

    def __init__(self, left: float, top: float, right: float, bottom: float, scale: float) -> None:
        self.scale = scale
        self.x, self.y = np.meshgrid(
            np.arange(left * scale, right * scale) / scale, np.arange(top * scale, bottom * scale) / scale
        )
        self._origin = (-left * scale, -top * scale)
        self._colour = np.zeros((*self.x.shape, 3))
        self._alpha = np.zeros(self.x.shape)

    def fill(self, distance: FloatArray, colour: npt.ArrayLike, opacity: float = 1.0) -> None:
        """Paint where `distance` (h, w) is negative; `colour` is BGR in 0..255, shape (3,) or (h, w, 3)."""
        alpha = opacity * np.clip(0.5 - distance * self.scale, 0.0, 1.0)
        self._colour += alpha[..., None] * (np.asarray(colour, dtype=np.float64) - self._colour)
        self._alpha += alpha * (1.0 - self._alpha)

    def bevel(self, distance: FloatArray, colour: npt.ArrayLike, edge: float = 3.0, gloss: float = 0.35) -> None:
        """Paint a block whose rim, `edge` wide, catches the light on one side and loses it on the other."""
        down, across = np.gradient(distance)
        rim = np.clip(1.0 + distance / edge, 0.0, 1.0)
        facing = (across * LIGHT[0] + down * LIGHT[1]) * self.scale
        self.fill(distance, np.asarray(colour, dtype=np.float64) * (1.0 + gloss * rim * facing)[..., None])

    def relief(
        self, distance: FloatArray, height: FloatArray, colour: npt.ArrayLike, gloss: float, angle: float
    ) -> None:
        """Paint a surface of given height (h, w), lit from the lamp as it stands when pasted at `angle`."""
        down, across = np.gradient(height * self.scale)
        normal = np.stack((-across, -down, np.ones_like(across)), axis=-1)
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        cos, sin = math.cos(-angle), math.sin(-angle)
        light = np.array([cos * LIGHT[0] - sin * LIGHT[1], sin * LIGHT[0] + cos * LIGHT[1], LIGHT[2]])
        diffuse = np.maximum(normal @ light, 0.0)
        shine = np.maximum(normal @ halfway(light), 0.0) ** 24
        base = np.asarray(colour, dtype=np.float64)
        self.fill(distance, base * (0.35 + 0.85 * diffuse)[..., None] + gloss * 255.0 * shine[..., None])

    def finish(self, drop: float, softness: float, strength: float = 0.5) -> Sprite:
        """Return the drawing with a shadow that falls `drop` away and is blurred by `softness`, design px."""
        pad = math.ceil(3.0 * softness * self.scale) + 1
        edge = ((pad, pad), (pad, pad))
        alpha = np.pad(self._alpha, edge)
        sigma = max(softness * self.scale, 0.3)
        shadow = cv2.GaussianBlur((255.0 * strength * alpha).astype(np.float32), (0, 0), sigma)
        colour = np.clip(np.pad(self._colour, (*edge, (0, 0))), 0.0, 255.0)
        # Colours blend from black where nothing was painted: they are multiplied by the coverage already.
        return Sprite(
            colour.round().astype(np.uint8),
            (255.0 * alpha).round().astype(np.uint8),
            shadow.round().astype(np.uint8),
            (self._origin[0] + pad, self._origin[1] + pad),
            drop * self.scale,
        )

    def capsule(self, start: Point, end: Point, start_radius: float, end_radius: float | None = None) -> FloatArray:
        """Return the distance (h, w) to a rod with round ends, tapered where the radii differ."""
        end_radius = start_radius if end_radius is None else end_radius
        axis = np.subtract(end, start)
        dx, dy = self.x - start[0], self.y - start[1]
        part = np.clip((dx * axis[0] + dy * axis[1]) / max(float(axis @ axis), 1e-9), 0.0, 1.0)
        reach = np.hypot(dx - part * axis[0], dy - part * axis[1])
        return reach - (start_radius + part * (end_radius - start_radius))

    def disc(self, centre: Point, radius: float) -> FloatArray:
        """Return the distance (h, w) to a disc."""
        return np.hypot(self.x - centre[0], self.y - centre[1]) - radius

    def box(self, left: float, top: float, right: float, bottom: float, corner: float = 0.0) -> FloatArray:
        """Return the distance (h, w) to an upright box with rounded corners."""
        dx = np.abs(self.x - (left + right) / 2.0) - (right - left) / 2.0 + corner
        dy = np.abs(self.y - (top + bottom) / 2.0) - (bottom - top) / 2.0 + corner
        outside = np.hypot(np.maximum(dx, 0.0), np.maximum(dy, 0.0))
        return outside + np.minimum(np.maximum(dx, dy), 0.0) - corner

    def polygon(self, corners: list[Point]) -> FloatArray:
        """Return the distance (h, w) to a convex polygon, its corners clockwise as seen; exact along its sides."""
        distance = np.full(self.x.shape, -np.inf)
        for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
            side = np.subtract(end, start)
            across = side[1] * (self.x - start[0]) - side[0] * (self.y - start[1])
            distance = np.maximum(distance, across / np.hypot(*side))
        return distance
