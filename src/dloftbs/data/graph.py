"""The skeleton as a graph: branches, and the junctions at which they meet.

An end is a number; `other_end`, `branch_of`, `is_start` and their like read it. Points have the orientation of the
mask's crop.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dloftbs.kernels.shared.graph_ends import (
    FREE,
    UNAVAILABLE,
    X,
    Y,
    branch_of,
    inward,
    is_start,
    other_end,
    same_side,
    start_of,
    stop_of,
)
from dloftbs.support.arrays import BoolArray, FloatArray, IntArray

__all__ = [
    "FREE",
    "POSITION",
    "RAY",
    "TANGENT",
    "UNAVAILABLE",
    "Graph",
    "X",
    "Y",
    "branch_of",
    "ends_of",
    "inward",
    "is_start",
    "other_end",
    "same_side",
    "start_of",
    "stop_of",
]

POSITION, TANGENT, RAY = slice(0, 2), slice(2, 4), slice(0, 4)
"""Columns of end states: x and y; the outward unit tangent; both."""


def ends_of(branches: IntArray) -> IntArray:
    """Return both ends of each branch, branch after branch."""
    ends = np.empty((len(branches), 2), dtype=np.int64)
    ends[:, 0], ends[:, 1] = start_of(branches), stop_of(branches)
    return ends.ravel()


class Graph(NamedTuple):
    """Branches and junctions.

    Parameters
    ----------
    points : numpy.ndarray, shape (m, 2)
        ``(x, y)`` in the middle of the mask, branch after branch, px.
    pixels : numpy.ndarray, shape (m, 2)
        Skeleton pixels of the points.
    radius : numpy.ndarray, shape (m,)
        Half the mask's width at each point, px.
    offsets : numpy.ndarray, shape (branches + 1,)
        First point of each branch, and the end. Branches with ends come first, then the loops.
    nodes : numpy.ndarray, shape (2 n,)
        Junction at each end of the n branches with ends, `FREE`, or `UNAVAILABLE`.
    spans : numpy.ndarray, shape (n, 2)
        Points of each branch that lie clear of its junctions.
    end_states : numpy.ndarray, shape (2 n, 6)
        Position, outward tangent and curvature of each end: the columns of `dloftbs.kernels.shared.graph_ends`.
    end_roundness : numpy.ndarray, shape (2 n,)
        Roundness of each free end, in 0..1.
    spurs : numpy.ndarray, shape (n,)
        Branches that are so short that they need no explanation.
    bordering : numpy.ndarray, shape (2 n,)
        Free ends that the image's border cuts.
    corners : numpy.ndarray, shape (2 n,)
        Point of the corner of the sharp bend at each end, where the bend has a branch of its own; else -1.
    width : float
        Width of the cables, px.
    """

    points: FloatArray
    pixels: FloatArray
    radius: FloatArray
    offsets: IntArray
    nodes: IntArray
    spans: IntArray
    end_states: FloatArray
    end_roundness: FloatArray
    spurs: BoolArray
    bordering: BoolArray
    corners: IntArray
    width: float

    @property
    def branch_count(self) -> int:
        """Number of branches with ends."""
        return len(self.spans)

    @property
    def loops(self) -> list[tuple[int, int]]:
        """Spans of points of the loops that touch no junction."""
        starts = self.offsets[self.branch_count :].tolist()
        return list(pairwise(starts))
