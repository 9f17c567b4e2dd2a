"""Curves of one view as the rays that a rig compares and fits: evenly spaced points, and observations with normals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.data.detection import Detection
from dloftbs.kernels.cubic_samples import sample_cubic
from dloftbs.stereo.kernels.line_blocks import block_means, block_noise
from dloftbs.support.arrays import AnyArray, FloatArray

_BLOCK_POINTS = 6
"""Number of points of a centre line that one observation is the mean of.

Source: by hand; half of a cable of 12 px, within which its course is straight.
"""

_GAP_PX = 2.5
"""Distance from point to point of a centre line beyond which the mask is interrupted, px.

Source: geometry; neighbouring pixels are 1.5 px apart at the most, and recentring moves them.
"""

NODES = 40
"""Number of points along the longest curve of all views, by which curves are compared.

Source: by hand; on a curve of 800 px, one in 20 px.
"""

_FEWEST_NODES = 6
"""Least number of points along a curve.

Source: by hand; its ends, and a bend between them.
"""


class ViewCurve(NamedTuple):
    """A detection in one view, without its lens.

    Parameters
    ----------
    nodes : numpy.ndarray, shape (n, 2)
        Rays of points along it, evenly spaced in its spline's own parameter.
    rays, normals : numpy.ndarray, shape (m, 2)
        Observations, and the unit normals of the curve there.
    places : numpy.ndarray, shape (m,)
        Shares of the length at which they are, ascending.
    weights : numpy.ndarray, shape (m,)
        One over their variances, of rays.
    clear : numpy.ndarray, shape (m,), bool
        False where the mask merges with that of another pass, and an observation is as far off as the cable is wide.
    radii : numpy.ndarray, shape (m,)
        Half the width of the mask, of rays.
    node_radii : numpy.ndarray, shape (n,)
        The same at the nodes.
    """

    nodes: FloatArray
    rays: FloatArray
    normals: FloatArray
    places: FloatArray
    weights: FloatArray
    clear: npt.NDArray[np.bool_]
    radii: FloatArray
    node_radii: FloatArray


def view_curves(
    detections: Sequence[Detection], mask: AnyArray, camera: PinholeCamera, spacing_px: float
) -> list[ViewCurve]:
    """Return the curves of a view; those beyond the field of its lens model have NaN for some nodes."""
    if not detections:
        return []
    nodes, lines = [], []
    for detection in detections:
        curve, line = detection.curve, detection.centerline
        count = max(round(curve.length / spacing_px) + 1, _FEWEST_NODES)
        nodes.append(sample_cubic(curve.knots, curve.control_points, 0.0, 1.0, count)[0])
        lines.append(block_means(line.points, line.u, line.radius, _BLOCK_POINTS, _GAP_PX))
    blocks = np.concatenate(lines)
    starts = np.cumsum([0, *map(len, lines)])
    noise = np.empty(len(blocks))
    block_noise(blocks, starts, mask.view(np.uint8) if mask.dtype == np.bool_ else mask, noise)
    means, half_chords = blocks[:, :2], 0.5 * blocks[:, 4:6]
    rays = _rays([*nodes, means, means - half_chords, means + half_chords], camera)
    means, before, after = rays[len(nodes) :]
    chords = after - before
    normals = np.empty_like(chords)
    size = np.sqrt(chords[:, 0] ** 2 + chords[:, 1] ** 2)
    normals[:, 0], normals[:, 1] = -chords[:, 1] / size, chords[:, 0] / size
    focal_px = math.sqrt(camera.fx * camera.fy)
    clear = noise > 0.0
    radii = blocks[:, 6]
    weights = np.where(clear, blocks[:, 3] / noise, 1.0 / (2.0 * radii) ** 2) * focal_px**2
    known: Any = np.isfinite(means + normals).all(axis=1) if camera.distortion else None
    curves = []
    for number, own_nodes in enumerate(rays[: len(nodes)]):
        own: Any = slice(int(starts[number]), int(starts[number + 1]))
        if known is not None:
            own = own.start + np.flatnonzero(known[own])
        places, own_radii = blocks[own, 2].copy(), radii[own] / focal_px
        node_radii = np.interp(np.linspace(0.0, 1.0, len(own_nodes)), places, own_radii)
        curves.append(
            ViewCurve(own_nodes, means[own], normals[own], places, weights[own], clear[own], own_radii, node_radii)
        )
    return curves


def _rays(points_px: list[FloatArray], camera: PinholeCamera) -> list[FloatArray]:
    """Return the rays (x, y, 1) of several arrays of points, without the lens."""
    together = np.concatenate(points_px)
    together -= (camera.cx, camera.cy)
    together /= (camera.fx, camera.fy)
    if camera.distortion:
        together = camera.lens.undistorted(together)
    rays, start = [], 0
    for points in points_px:
        rays.append(together[start : start + len(points)])
        start += len(points)
    return rays
