"""Curves of one view as the rays that a rig compares and fits: evenly spaced points, and observations with normals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

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

WEIGHT, RADIUS, CLEAR = 4, 5, 6
"""Index of each column of `ViewCurve.rows` behind the ray and the normal.

Source: by definition.
"""


_CLOSED = "it is a closed loop, for which two views are not put together"
_BEYOND = "parts of it lie beyond the field of the lens model"


class ViewCurve(NamedTuple):
    """A detection in one view, without its lens.

    Parameters
    ----------
    nodes : numpy.ndarray, shape (n, 2)
        Rays of points along it, evenly spaced in its spline's own parameter.
    widths : numpy.ndarray, shape (n,)
        Half the width of the mask there, of rays.
    places : numpy.ndarray, shape (m,)
        Shares of the length at which there are observations, ascending.
    rows : numpy.ndarray, shape (m, 7)
        For each observation the ray x and y, the unit normal of the curve there, one over the variance across it, half
        the width of the mask, all of rays, and 1. The last one is 0 where the mask merges with that of another pass: an
        observation may be as far off as the cable is wide there.
    problem : str, optional
        Reason why it cannot be matched.
    """

    nodes: FloatArray
    widths: FloatArray
    places: FloatArray
    rows: FloatArray
    problem: str | None


def view_curves(
    detections: Sequence[Detection], mask: AnyArray, camera: PinholeCamera, spacing_px: float
) -> list[ViewCurve]:
    """Return the curves of a view.

    Parameters
    ----------
    detections : sequence of Detection
    mask : numpy.ndarray, shape (H, W)
        That they were found in.
    camera : PinholeCamera
    spacing_px : float
        From node to node.
    """
    if not detections:
        return []
    nodes, lines = [], []
    for detection in detections:
        curve, line = detection.curve, detection.centerline
        count = max(round(rough_length(detection) / spacing_px) + 1, _FEWEST_NODES)
        nodes.append(sample_cubic(curve.knots, curve.control_points, 0.0, 1.0, count)[0])
        lines.append(block_means(line.points, line.u, line.radius, _BLOCK_POINTS, _GAP_PX))
    blocks = np.concatenate(lines)
    starts = np.cumsum([0, *map(len, lines)])
    noise = np.empty(len(blocks))
    bits = mask if mask.dtype == np.uint8 else (mask if mask.dtype == np.bool_ else mask != 0).view(np.uint8)
    block_noise(blocks, starts, bits, noise)
    rows = _rows(blocks, noise, camera)
    rays = _rays(np.concatenate(nodes), camera)
    curves = []
    first = 0
    for number, (own_nodes, line_blocks) in enumerate(zip(nodes, lines, strict=True)):
        own = rays[first : first + len(own_nodes)]
        first += len(own_nodes)
        places, own_rows = line_blocks[:, 2].copy(), rows[starts[number] : starts[number + 1]]
        problem = _CLOSED if detections[number].curve.closed else None
        if camera.distortion:
            known = np.isfinite(own_rows[:, :4]).all(axis=1)
            places, own_rows = places[known], own_rows[known]
            problem = problem if np.isfinite(own).all() else _BEYOND
        if len(places):
            widths = np.interp(np.arange(len(own)) / (len(own) - 1), places, own_rows[:, RADIUS])
        else:
            widths = np.full(len(own), 0.5 * detections[number].width_px / math.sqrt(camera.fx * camera.fy))
        curves.append(ViewCurve(own, widths, places, own_rows, problem))
    return curves


def rough_length(detection: Detection) -> float:
    """Return the length of the polygon of a curve's control points, px, which is hardly longer than the curve."""
    steps = np.diff(detection.curve.control_points, axis=0)
    return float(np.sqrt((steps * steps).sum(axis=1)).sum())


def _rows(blocks: FloatArray, noise: FloatArray, camera: PinholeCamera) -> FloatArray:
    """Return the observations that blocks are."""
    focal_px = math.sqrt(camera.fx * camera.fy)
    rows = np.empty((len(blocks), 7))
    chords = blocks[:, 4:6]
    if camera.distortion:
        means = blocks[:, :2]
        rows[:, :2] = _rays(means, camera)
        chords = _rays(means + 0.5 * chords, camera) - _rays(means - 0.5 * chords, camera)
    else:
        rows[:, 0], rows[:, 1] = (blocks[:, 0] - camera.cx) / camera.fx, (blocks[:, 1] - camera.cy) / camera.fy
        chords = chords / (camera.fx, camera.fy)
    size = np.hypot(chords[:, 0], chords[:, 1])
    rows[:, 2], rows[:, 3] = -chords[:, 1] / size, chords[:, 0] / size
    rows[:, RADIUS] = blocks[:, 6] / focal_px
    rows[:, CLEAR] = clear = noise > 0.0
    rows[:, WEIGHT] = np.where(clear, blocks[:, 3] * focal_px**2 / noise, 0.25 / rows[:, RADIUS] ** 2)
    return rows


def _rays(points_px: FloatArray, camera: PinholeCamera) -> FloatArray:
    """Return the rays (x, y, 1) of points, without the lens."""
    rays: FloatArray = (points_px - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    return camera.lens.undistorted(rays) if camera.distortion else rays
