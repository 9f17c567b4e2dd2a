"""A tracker of the family of CDCPD2: it registers a chain of nodes of known length to each frame's points."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from dloftbs.camera import PinholeCamera
from dloftbs.config import DepthConfig
from dloftbs.data.depth import to_metres
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.evaluation.baselines.point_registration import DEFAULT, Weights, limit_stretch, register
from dloftbs_lab.truth import Truth

LENGTHS = (1.0, 0.9, 1.1)
"""Lengths that it is tried with, as shares of the true one: the best counts, as in the paper's comparison."""

NODES = 50
"""Number of nodes of the chain. Source: by hand."""
STRETCH = 1.05
"""Largest length of an edge, as a share of its length at rest. Source: by hand."""
_GRID = 1.0 / 100.0  # of the length: a cell for each point that is registered. Source: bounds time
_VISIBILITY = 30.0  # per metre behind what is seen and pixel off the mask. Source: by hand
_MIN_SEEN = 1e-6  # weight of a node that is covered. Source: by hand; no node is left without any
_OUTPUT_POINTS = 200  # Source: by hand; four to a node


@dataclass(frozen=True, eq=False)
class _Cable:
    """Cable as it is known: its length, the rest length of each edge, and where its nodes were."""

    length: float
    edges: FloatArray
    nodes: FloatArray


class CoherentPointDrift:
    """Follows one cable by coherent point drift with locally linear regularisation and stretch limits.

    The family is that of CDCPD (Chi, Berenson, IROS 2019) and CDCPD2 (Wang, McConachie, Berenson, ICRA 2021), and the
    equations are published ones; see `point_registration`. It is not the authors' code: there are no constraints for
    self-intersection, obstacles and grippers, no recovery of a lost cable, and no prediction of a gripper's motion. Its
    weights were chosen here, on sequences of another seed than those in the tables.

    Unlike the package's methods, it is given the cable's place in the first frame and its length, and it knows that
    there is exactly one. In space it follows the surface that depth shows, half a cable's width before the axis.

    Parameters
    ----------
    length : float
        Length at rest, as a share of the true one.
    weights : Weights
        Of the registration.

    Raises
    ------
    InputError
        If the length is no positive number.
    """

    def __init__(self, length: float = 1.0, weights: Weights = DEFAULT) -> None:
        if not 0.0 < length < math.inf:
            raise InputError(f"length must be a positive share of the true one, got {length}")
        self._share = length
        self._weights = weights
        self._cable: _Cable | None = None

    def start(self, frame: Frame, truth: Truth) -> None:
        """Take the shape of the one cable of the first frame: in metres where it is known there, else in px.

        Raises
        ------
        InputError
            If there is not exactly one, or the frame has no depth and camera for a cable in space.
        """
        if len(truth.curves) != 1:
            raise InputError(f"coherent point drift follows one cable that is known, got {len(truth.curves)} curves")
        curve = truth.curves_3d[0] if truth.curves_3d else truth.curves[0]
        if truth.curves_3d and (frame.depth is None or frame.camera is None):
            raise InputError("coherent point drift in space needs frames with depth and a camera, got none")
        length = self._share * curve.length
        edges = np.full(NODES - 1, length / (NODES - 1))
        self._cable = _Cable(length, edges, curve.sample(NODES))

    def __call__(self, frame: Frame) -> dict[int, FloatArray]:
        """Return the cable under the id 0: points (n, 3) m or (n, 2) px.

        Raises
        ------
        InputError
            Before `start`, or if the frame has no mask, or no depth or camera for a cable in space.
        """
        cable = self._cable
        if cable is None:
            raise InputError("coherent point drift needs the first frame's truth: call start(frame, truth)")
        in_space = cable.nodes.shape[1] == 3
        points = points_in_space(frame) if in_space else points_in_image(frame)
        if len(points):
            origin = cable.nodes.mean(axis=0)
            data = thin_out(points, _GRID * cable.length)
            seen = visibility(cable.nodes, frame) if in_space else None
            moved = register((cable.nodes - origin) / cable.length, (data - origin) / cable.length, self._weights, seen)
            nodes = limit_stretch(origin + cable.length * moved, STRETCH * cable.edges)
            self._cable = cable = _Cable(cable.length, cable.edges, nodes)
        return {0: CubicSpline(np.arange(NODES), cable.nodes)(np.linspace(0.0, NODES - 1.0, _OUTPUT_POINTS))}


def points_in_image(frame: Frame) -> FloatArray:
    """Return the mask's pixels, shape (n, 2).

    Raises
    ------
    InputError
        If the frame has no mask.
    """
    is_cable = frame.is_cable
    if is_cable is None:
        raise InputError("coherent point drift needs a mask, got an image alone")
    rows, columns = np.nonzero(is_cable)
    return np.stack((columns, rows), axis=1).astype(np.float64)


def points_in_space(frame: Frame) -> FloatArray:
    """Return where the mask's pixels lie whose depth is known, shape (n, 3) m.

    Raises
    ------
    InputError
        If the frame has no mask, no depth or no camera.
    """
    pixels = points_in_image(frame)
    camera, depth = _camera_and_depth(frame)
    z = depth[pixels[:, 1].astype(np.intp), pixels[:, 0].astype(np.intp)]
    known = z > 0.0
    return camera.deproject(pixels[known], z[known])


def thin_out(points: FloatArray, cell: float) -> FloatArray:
    """Return the mean of the points (n, d) in each cell of a grid: as many as there are cells with points."""
    cells = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    _, number = np.unique(np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1)), return_inverse=True)
    counts = np.bincount(number)
    return np.stack([np.bincount(number, values) / counts for values in points.T], axis=1)


def visibility(nodes: FloatArray, frame: Frame) -> FloatArray:
    """Return the weight of each node (m,): small where something nearer than the node covers it, off the mask.

    It falls with the distance to the mask in px times the metres by which what is seen lies before the node.
    """
    is_cable = frame.is_cable
    assert is_cable is not None  # points_in_space saw to it
    camera, depth = _camera_and_depth(frame)
    pixels = np.rint(np.nan_to_num(camera.project(nodes), nan=-1.0)).astype(np.intp)
    columns, rows = pixels.T
    inside = (columns >= 0) & (rows >= 0) & (columns < depth.shape[1]) & (rows < depth.shape[0])
    rows, columns = rows[inside], columns[inside]
    behind = np.where(depth[rows, columns] > 0.0, np.maximum(nodes[inside, 2] - depth[rows, columns], 0.0), 0.0)
    away, _ = cKDTree(np.argwhere(is_cable)).query(np.stack((rows, columns), axis=1))
    seen = np.full(len(nodes), _MIN_SEEN)
    seen[inside] = np.maximum(np.exp(-_VISIBILITY * behind * away), _MIN_SEEN)
    return seen


def _camera_and_depth(frame: Frame) -> tuple[PinholeCamera, FloatArray]:
    """Return the camera, and the depth (H, W) m, 0 where `DepthConfig` does not read it by default."""
    if frame.depth is None or frame.camera is None:
        raise InputError("coherent point drift in space needs frames with depth and a camera, got none")
    return frame.camera, np.nan_to_num(to_metres(np.squeeze(frame.depth), frame.depth_unit_m, DepthConfig()))
