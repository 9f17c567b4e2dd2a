"""Convex bodies of a robot, and the pixels that they cover in an image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.support.arrays import FloatArray

Mask = npt.NDArray[np.bool_]

_NEAR_M = 0.01
"""Distance before the camera at which bodies are cut off, metres.

Source: by definition; no camera sees anything nearer.
"""

_ROUND = 64
"""Points of a round outline; a polygon of so many lies within 0.12 % of its radius.

Source: geometry.
"""

_SUBPIXEL_BITS = 4
"""Binary digits of a pixel in which corners are drawn.

Source: by definition.
"""

_LARGEST_CANVAS = 4
"""Size of the picture without distortion, at most, in sides of the image.

Source: by definition; rays beyond are those of a fisheye near a right angle.
"""


@dataclass(frozen=True, eq=False)
class Body:
    """All points within a radius of the convex hull of some points: a sphere, a capsule, a box, a hull.

    Parameters
    ----------
    link : str
        Link that it belongs to.
    points : numpy.ndarray, shape (n, 3)
        In the link's frame, metres.
    radius_m : float
        0 for a hull with corners.
    """

    link: str
    points: FloatArray
    radius_m: float

    def moved(self, pose: FloatArray) -> Body:
        """Return the body in the frame that the link has a pose (4, 4) in."""
        return Body(self.link, self.points @ pose[:3, :3].T + pose[:3, 3], self.radius_m)


def cover(bodies: Sequence[Body], camera: PinholeCamera, size: tuple[int, int]) -> Mask:
    """Return the pixels (H, W) that bodies in the camera's frame cover.

    Parameters
    ----------
    bodies : sequence of Body
        In the camera's frame.
    camera : PinholeCamera
    size : (int, int)
        ``(H, W)`` of the image.

    Returns
    -------
    numpy.ndarray, shape (H, W), bool
    """
    import cv2

    canvas = _canvas_of(camera, size)
    picture = np.zeros(canvas.size, np.uint8)
    limits = np.array([-1.0, canvas.size[1], -1.0, canvas.size[0]])
    for body in bodies:
        outline = _outline(body)
        corners = _clipped(_hull(outline * canvas.focal + canvas.centre), limits) if len(outline) else outline
        if len(corners):
            scaled = np.rint(corners * (1 << _SUBPIXEL_BITS)).astype(np.int32)
            cv2.fillConvexPoly(picture, scaled, 1, shift=_SUBPIXEL_BITS)
    if canvas.to_image is not None:
        picture = cv2.remap(picture, canvas.to_image, None, cv2.INTER_NEAREST, borderValue=0)
    covered: Mask = picture.astype(np.bool_)
    return covered


class _Canvas(NamedTuple):
    """Picture without distortion that holds all rays of an image, and where the image's pixels are in it."""

    size: tuple[int, int]
    focal: FloatArray
    centre: FloatArray
    to_image: npt.NDArray[np.float32] | None


@lru_cache(maxsize=2)
def _canvas_of(camera: PinholeCamera, size: tuple[int, int]) -> _Canvas:
    focal, centre = np.array([camera.fx, camera.fy]), np.array([camera.cx, camera.cy])
    if not camera.distortion:
        return _Canvas(size, focal, centre, None)
    rows, columns = size
    pixels = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1)
    rays = camera.deproject(pixels, np.ones(size))[..., :2] * focal
    most = _LARGEST_CANVAS * np.array([columns, rows])
    low = np.maximum(np.nanmin(rays, axis=(0, 1)), -0.5 * most) - 1.0
    high = np.minimum(np.nanmax(rays, axis=(0, 1)), 0.5 * most) + 1.0
    width, height = np.ceil(high - low).astype(int) + 1
    places = np.nan_to_num(rays - low, nan=-2.0, posinf=-2.0, neginf=-2.0).astype(np.float32)
    return _Canvas((int(height), int(width)), focal, -low, places)


def _outline(body: Body) -> FloatArray:
    """Return points (n, 2) on the plane at a distance of 1 whose hull is the body's silhouette; none behind it."""
    nearest = body.points[:, 2] - body.radius_m
    if (nearest >= _NEAR_M).all():
        points = body.points if body.radius_m == 0.0 else _contour(body.points, body.radius_m)
    else:
        points = _in_front(_surface(body.points, body.radius_m))
    return points[:, :2] / points[:, 2:]


def _contour(centres: FloatArray, radius: float) -> FloatArray:
    """Return the circles (n, 3) in which rays from the camera touch spheres."""
    squared = (centres**2).sum(axis=1, keepdims=True)
    share = 1.0 - radius**2 / squared
    towards = centres / np.sqrt(squared)
    across = np.cross(towards, np.eye(3)[np.abs(towards).argmin(axis=1)])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    aside = np.cross(towards, across)
    angle = 2.0 * np.pi * np.arange(_ROUND)[:, None, None] / _ROUND
    circle = np.cos(angle) * across + np.sin(angle) * aside
    touched: FloatArray = (centres * share + radius * np.sqrt(share) * circle).reshape(-1, 3)
    return touched


def _surface(centres: FloatArray, radius: float) -> FloatArray:
    """Return points (n, 3) on spheres, by meridians and parallels about the optical axis."""
    if radius == 0.0:
        return centres
    along = np.pi * (np.arange(_ROUND // 4) + 0.5) / (_ROUND // 4)
    around = 2.0 * np.pi * np.arange(_ROUND // 2) / (_ROUND // 2)
    ring = np.stack((np.cos(around), np.sin(around)), axis=1)
    sphere = np.concatenate([np.column_stack((np.sin(at) * ring, np.full(len(ring), np.cos(at)))) for at in along])
    points: FloatArray = (centres[:, None] + radius * sphere).reshape(-1, 3)
    return points


def _in_front(points: FloatArray) -> FloatArray:
    """Return points whose hull is that part of the points' hull that is before the camera."""
    ahead = points[:, 2] >= _NEAR_M
    front, behind = points[ahead], points[~ahead]
    if not len(front):
        return front
    share = (_NEAR_M - behind[None, :, 2:]) / (front[:, None, 2:] - behind[None, :, 2:])
    cut = behind + share * (front[:, None] - behind)
    return np.concatenate((front, cut.reshape(-1, 3)))


def _hull(points: FloatArray) -> FloatArray:
    """Return the corners (n, 2) of the convex hull, in order."""
    import cv2

    hull: FloatArray = cv2.convexHull(points.astype(np.float32))[:, 0].astype(np.float64)
    return hull


def _clipped(polygon: FloatArray, limits: FloatArray) -> FloatArray:
    """Return the part of a convex polygon (n, 2) between limits left, right, top, bottom (Sutherland and Hodgman)."""
    for number, limit in enumerate(limits):
        axis, sign = number // 2, (1.0, -1.0)[number % 2]
        if not len(polygon):
            break
        inside = sign * (polygon[:, axis] - limit)
        following, ends = np.roll(polygon, -1, axis=0), np.roll(inside, -1)
        kept = []
        for start, end, before, after in zip(polygon, following, inside, ends, strict=True):
            if before >= 0.0:
                kept.append(start)
            if (before >= 0.0) != (after >= 0.0):
                kept.append(start + before / (before - after) * (end - start))
        polygon = np.array(kept).reshape(-1, 2)
    return polygon
