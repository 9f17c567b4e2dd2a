"""Frames along a curve that do not turn about it more than they must: where a gripper may take hold, and how."""

from __future__ import annotations

import numpy as np

from dloftbs.data.curve_like import CurveLike
from dloftbs.data.spline_geometry import directions
from dloftbs.support.arrays import FloatArray

_TURN = 0.01
"""Largest angle between neighbouring tangents of the frames that are carried along, radians.

Source: numerics; carrying them by double reflection is then right to some 1e-9 over a whole curve.
"""

_FEWEST = 16
"""Least number of steps in a knot span.

Source: numerics; as for the angle.
"""


def frames_in_plane(curve: CurveLike, u: FloatArray) -> FloatArray:
    """Return poses (n, 3, 3): columns along the curve, across it, and the point."""
    poses = np.zeros((len(u), 3, 3))
    along = curve.tangent(u)
    poses[:, :2, 0] = along
    poses[:, :2, 1] = np.stack((-along[:, 1], along[:, 0]), axis=1)
    poses[:, :2, 2] = curve(u)
    poses[:, 2, 2] = 1.0
    return poses


def frames_in_space(curve: CurveLike, u: FloatArray, towards: FloatArray) -> FloatArray:
    """Return poses (n, 4, 4) with x along the curve, and z carried along from the start, where it is near `towards`.

    By double reflection: Wang, Juettler, Zheng, Liu, Computation of rotation minimizing frames, TOG 2008.
    """
    t = curve.t_at(u)
    grid, places = np.unique(np.concatenate((_grid(curve), t)), return_inverse=True)
    points, tangents = curve.spline(grid), directions(curve.spline, grid)
    chosen = places.ravel()[-len(t) :] if len(t) else np.empty(0, np.intp)
    normals = _carried(points, tangents, _across(tangents[0], towards))[chosen]
    poses = np.zeros((len(t), 4, 4))
    poses[:, :3, 0] = tangents[chosen]
    poses[:, :3, 1] = np.cross(normals, tangents[chosen])
    poses[:, :3, 2] = normals
    poses[:, :3, 3] = points[chosen]
    poses[:, 3, 3] = 1.0
    return poses


def _grid(curve: CurveLike) -> FloatArray:
    """Return parameters of the spline from 0 to 1 between which it turns little."""
    breaks = curve.breaks
    looks = breaks[:-1, None] + np.diff(breaks)[:, None] * np.linspace(0.0, 1.0, _FEWEST + 1)
    sines = 0.5 * np.linalg.norm(np.diff(directions(curve.spline, looks), axis=1), axis=2)
    turned = 2.0 * np.arcsin(np.minimum(sines, 1.0)).sum(axis=1)
    steps = np.maximum(np.ceil(turned / _TURN), _FEWEST).astype(np.intp)
    parts = [
        low + (high - low) * (np.arange(n) / n) for low, high, n in zip(breaks[:-1], breaks[1:], steps, strict=True)
    ]
    return np.concatenate((*parts, [1.0]))


def _across(tangent: FloatArray, towards: FloatArray) -> FloatArray:
    """Return the unit vector across a tangent that is nearest to a direction, or to an axis if that is along it."""
    candidates = (towards, *np.eye(3))
    across = [one - (one @ tangent) * tangent for one in candidates]
    chosen = next(one for one in across if np.linalg.norm(one) > _TURN)
    return chosen / np.linalg.norm(chosen)


def _carried(points: FloatArray, tangents: FloatArray, first: FloatArray) -> FloatArray:
    """Return normals (n, 3) along points and unit tangents (n, 3), each the one before, reflected twice."""
    normals = np.empty_like(points)
    normals[0] = first
    for i in range(len(points) - 1):
        step = points[i + 1] - points[i]
        squared = step @ step
        if not squared > 0.0:
            normals[i + 1] = normals[i]
            continue
        normal = normals[i] - 2.0 / squared * (step @ normals[i]) * step
        tangent = tangents[i] - 2.0 / squared * (step @ tangents[i]) * step
        turn = tangents[i + 1] - tangent
        squared = turn @ turn
        normals[i + 1] = normal - (2.0 / squared * (turn @ normal) * turn if squared > 0.0 else 0.0)
    # What rounding has added along the tangents is taken away.
    normals -= np.einsum("ij,ij->i", normals, tangents)[:, None] * tangents
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)
