"""Curves of one view as the rays that a rig compares and fits: evenly spaced points, and observations with normals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.data.detection import Detection
from dloftbs.data.frame_result import FrameResult
from dloftbs.kernels.cubic_samples import sample_cubic
from dloftbs.stereo.kernels.line_blocks import block_means, block_noise, observe
from dloftbs.stereo.kernels.observations import COLUMNS, DEPTH, SHARED, WEIGHT, half_widths
from dloftbs.stereo.shutters import Steps, values_at
from dloftbs.support.arrays import AnyArray, BoolArray, FloatArray

_BLOCK_POINTS = 9
"""Number of points of a centre line that one observation is the mean of.

Source: by hand; three quarters of a cable of 12 px, within which its course is straight.
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


_BEYOND = "parts of it lie beyond the field of the lens model"


class ViewCurve(NamedTuple):
    """A detection in one view, or several that are one object there, without the lens.

    Parameters
    ----------
    nodes : numpy.ndarray, shape (n, 2)
        Rays of points along it, evenly spaced in its spline's own parameter; of a loop, the last is the first.
    widths : numpy.ndarray, shape (n,)
        Half the width of the object there over its depth along z.
    shown : numpy.ndarray, shape (n,), bool
        Whether a node is a point of a detection; else it lies between two.
    places : numpy.ndarray, shape (m,)
        Where there are observations, in nodes.
    rows : numpy.ndarray, shape (m, 9)
        The observations; see `dloftbs.stereo.kernels.observations`. One is not clear where the mask merges with that of
        another pass: it may be as far off as the cable is wide there.
    closed : bool
        Whether it is a loop; then the number of steps from node to node can be divided by 4.
    problem : str, optional
        Reason why it cannot be matched.
    """

    nodes: FloatArray
    widths: FloatArray
    shown: BoolArray
    places: FloatArray
    rows: FloatArray
    closed: bool
    problem: str | None

    def reversed(self) -> ViewCurve:
        """Return the same curve run the other way."""
        last = len(self.nodes) - 1
        nodes, widths = np.ascontiguousarray(self.nodes[::-1]), self.widths[::-1].copy()
        return self._replace(nodes=nodes, widths=widths, shown=self.shown[::-1], places=last - self.places)


def curves_of_views(
    results: Sequence[FrameResult], masks: Sequence[AnyArray], cameras: Sequence[PinholeCamera], steps: Sequence[Steps]
) -> list[list[ViewCurve]]:
    """Return the curves of each view, all with the same distance between their nodes as rays.

    Parameters
    ----------
    results : sequence of FrameResult
    masks : sequence of numpy.ndarray, each of shape (H, W)
        That the detections were found in.
    cameras : sequence of PinholeCamera
    steps : sequence of sequence
        For each view how far its detections are to be moved; see `dloftbs.stereo.shutters`.
    """
    lengths = []
    for result, camera in zip(results, cameras, strict=True):
        focal_px = math.sqrt(camera.fx * camera.fy)
        lengths.append([_rough_length(detection) / focal_px for detection in result.detections])
    longest = max((length for own in lengths for length in own), default=0.0)
    curves = []
    for result, mask, camera, own, moves in zip(results, masks, cameras, lengths, steps, strict=True):
        # A pixel is the least distance from node to node.
        spacing = max(longest / NODES, 1.0 / math.sqrt(camera.fx * camera.fy))
        curves.append(_curves_of(result.detections, mask, camera, [length / spacing for length in own], moves))
    return curves


def _curves_of(
    detections: Sequence[Detection], mask: AnyArray, camera: PinholeCamera, lengths: Sequence[float], steps: Steps
) -> list[ViewCurve]:
    """Return the curves of a view, whose lengths are given in steps from node to node."""
    if not detections:
        return []
    nodes, lines = [], []
    for detection, length in zip(detections, lengths, strict=True):
        curve, line = detection.curve, detection.centerline
        count = max(round(length), _FEWEST_NODES - 1)
        if curve.closed:
            count += -count % 4
        nodes.append(sample_cubic(curve.knots, curve.control_points, 0.0, 1.0, count + 1)[0])
        lines.append(block_means(line.points, line.u, line.radius, _BLOCK_POINTS, _GAP_PX))
    blocks = np.concatenate(lines)
    starts, firsts = np.cumsum([0, *map(len, lines)]), np.cumsum([0, *map(len, nodes)]).tolist()
    noise = np.empty(len(blocks))
    bits = mask if mask.dtype == np.uint8 else (mask if mask.dtype == np.bool_ else mask != 0).view(np.uint8)
    block_noise(blocks, starts, bits, noise)
    errors = np.zeros((len(blocks), 2))
    for number, step in enumerate(steps):
        if step is not None:
            own = slice(starts[number], starts[number + 1])
            u = blocks[own, 2]
            errors[own] = values_at(u, step.error)
            blocks[own, :2] += values_at(u, step.way)
            nodes[number] += values_at(np.linspace(0.0, 1.0, len(nodes[number])), step.way)
    if camera.distortion:
        _undo_lens(blocks, noise, camera)
    rows = observe(blocks, noise, camera.fx, camera.fy, camera.cx, camera.cy)
    rows[:, SHARED] = rows[:, 2] * errors[:, 0] / camera.fx + rows[:, 3] * errors[:, 1] / camera.fy
    rays = _rays(np.concatenate(nodes), camera)
    curves = []
    for number, detection in enumerate(detections):
        own = slice(starts[number], starts[number + 1])
        rays_of_it = rays[firsts[number] : firsts[number + 1]]
        curves.append(_curve_of(detection, rays_of_it, blocks[own, 2], rows[own], camera))
    return curves


def _curve_of(
    detection: Detection, nodes: FloatArray, u: FloatArray, rows: FloatArray, camera: PinholeCamera
) -> ViewCurve:
    """Return the curve of a detection."""
    last, problem = len(nodes) - 1, None
    if camera.distortion:
        known = np.isfinite(rows).all(axis=1)
        u, rows = u[known], rows[known]
        problem = None if np.isfinite(nodes).all() else _BEYOND
    if len(u):
        widths = np.interp(np.arange(last + 1), u * last, half_widths(rows))
    else:
        widths = np.full(last + 1, 0.5 * detection.width_px / math.sqrt(camera.fx * camera.fy))
    if detection.curve_3d is not None:
        at, measured = _depth_rows(detection)
        u, rows = np.concatenate((u, at)), np.concatenate((rows, measured))
    shown = np.ones(last + 1, bool)
    return ViewCurve(nodes, widths, shown, u * last, rows, detection.curve.closed, problem)


def _depth_rows(detection: Detection) -> tuple[FloatArray, FloatArray]:
    """Return the own parameters of a spline where it was lifted by depth, and what was measured, as observations.

    There are as many as the curve has control points: between them, depth is no evidence of its own.
    """
    curve = detection.curve_3d
    assert curve is not None
    count = len(detection.curve.control_points)
    u = (np.arange(count) + 0.5) / count
    for low, high in detection.inferred_3d:
        u = u[(u < low) | (u > high)]
    points = curve(u)
    rows = np.zeros((len(u), COLUMNS))
    rows[:, :2] = points[:, :2] / points[:, 2:]
    rows[:, DEPTH] = points[:, 2]
    rows[:, WEIGHT] = 1.0 / detection.curve_3d_std(u) ** 2
    return detection.curve.t_at(detection.u_2d(u)), rows


def _rough_length(detection: Detection) -> float:
    """Return the length of the polygon of a curve's control points, px, which is hardly longer than the curve."""
    control = detection.curve.control_points.tolist()
    return sum(map(math.dist, control, control[1:]))


def _undo_lens(blocks: FloatArray, noise: FloatArray, camera: PinholeCamera) -> None:
    """Move blocks, with their chords, to where they were without the lens, and stretch their widths and their noise."""
    focal, center = (camera.fx, camera.fy), (camera.cx, camera.cy)
    means, half = blocks[:, :2].copy(), 0.5 * blocks[:, 4:6]
    normals = half[:, ::-1] * (-0.5, 0.5) / np.linalg.norm(half, axis=1)[:, None]  # of half a pixel
    blocks[:, 4:6] = (_rays(means + half, camera) - _rays(means - half, camera)) * focal
    pixels = (_rays(means + normals, camera) - _rays(means - normals, camera)) * focal
    chords = blocks[:, 4:6]
    stretches = np.abs(chords[:, 0] * pixels[:, 1] - chords[:, 1] * pixels[:, 0]) / np.linalg.norm(chords, axis=1)
    blocks[:, :2] = _rays(means, camera) * focal + center
    blocks[:, 6] *= stretches
    noise *= stretches * stretches


def _rays(points_px: FloatArray, camera: PinholeCamera) -> FloatArray:
    """Return the rays (x, y, 1) of points, without the lens."""
    rays: FloatArray = (points_px - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    return camera.lens.undistorted(rays) if camera.distortion else rays
