"""Registration of a chain of nodes to points: coherent point drift, locally linear regularisation, stretch limits.

Written from the equations of

- Myronenko, Song: Point Set Registration: Coherent Point Drift, IEEE TPAMI 2010: the mixture of Gaussians, its outliers
  and the coherent motion of the nodes,
- Ge, Fan, Ding: Non-Rigid Point Set Registration with Global-Local Topology Preservation, CVPR Workshops 2014, and
  Tang, Fan, Lin, Tomizuka: State Estimation for Deformable Objects by Point Registration and Dynamic Simulation, IROS
  2017: the locally linear term,
- Chi, Berenson: Occlusion-Robust Deformable Object Tracking without Physics Simulation, IROS 2019: weights of hidden
  nodes, and limits of stretch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dloftbs.support.arrays import FloatArray

_NEIGHBOURS = 2  # on each side, along the chain
_CONDITION = 1e-3  # of the Gram matrices of neighbours, which are singular on a straight line
_MIN_VARIANCE = 1e-8
_SWEEPS = 100
_SLACK = 1e-9


@dataclass(frozen=True)
class Weights:
    """Weights of the registration; lengths are shares of the cable's length.

    The defaults had the least mean L3 of eight settings on 70 frames of each sequence of `rgbd_artificial` with seed 7.

    Parameters
    ----------
    outliers : float
        Share of the points that belong to no node, in 0..1.
    width : float
        Distance over which nodes move together.
    coherence : float
        Weight of coherent motion.
    linearity : float
        Weight of what each node's neighbours say of its place.
    sigma : float
        Standard deviation of the mixture in the beginning.
    iterations : int
        At most.
    tolerance : float
        Largest step of a node after which the iterations end.
    """

    outliers: float = 0.1
    width: float = 0.2
    coherence: float = 1.0
    linearity: float = 10.0
    sigma: float = 0.06
    iterations: int = 60
    tolerance: float = 1e-4


DEFAULT = Weights()
"""Weights of the baseline in tables."""


def register(nodes: FloatArray, points: FloatArray, weights: Weights, seen: FloatArray | None = None) -> FloatArray:
    """Move nodes (m, d) onto points (n, d); the cable's length is 1 in both.

    Parameters
    ----------
    nodes, points : numpy.ndarray
        Not checked; at least three nodes and one point.
    weights : Weights
    seen : numpy.ndarray, shape (m,), optional
        Weight of each node in the mixture, of any scale; equal where it is left out.

    Returns
    -------
    numpy.ndarray, shape (m, d)
    """
    kernel = coherence_kernel(nodes, weights.width)
    local = local_linearity(nodes)
    prior = np.full(len(nodes), 1.0 / len(nodes)) if seen is None else seen / seen.sum()
    variance, moved = weights.sigma**2, nodes
    for _ in range(weights.iterations):
        shares = responsibilities(moved, points, variance, weights.outliers, prior)
        before = moved
        moved = nodes + kernel @ solve_motion(nodes, points, shares, kernel, local, variance, weights)
        variance = max(_variance(moved, points, shares), _MIN_VARIANCE)
        if np.linalg.norm(moved - before, axis=1).max() < weights.tolerance:
            break
    return moved


def responsibilities(
    nodes: FloatArray, points: FloatArray, variance: float, outliers: float, prior: FloatArray
) -> FloatArray:
    """Return the probability that a point is of a node, shape (m, n): CPD, equation 6, with a prior of the nodes."""
    likely = prior[:, None] * np.exp(squared_distances(nodes, points) / (-2.0 * variance))
    noise = (2.0 * math.pi * variance) ** (nodes.shape[1] / 2.0) * outliers / (1.0 - outliers) / len(points)
    return likely / (likely.sum(axis=0) + noise)


def solve_motion(
    nodes: FloatArray,
    points: FloatArray,
    shares: FloatArray,
    kernel: FloatArray,
    local: FloatArray,
    variance: float,
    weights: Weights,
) -> FloatArray:
    """Return the coefficients (m, d) of the motion ``kernel @ coefficients`` that the M-step asks for.

    CPD, equation 22, with the term of GLTP: ``(diag(P 1) G + a s I + t s H G) W = P X - (diag(P 1) + t s H) Y``, where
    ``a`` is the weight of coherence, ``t`` that of linearity, ``s`` the variance and ``H`` the matrix `local`.
    """
    pull = np.diag(shares.sum(axis=1)) + weights.linearity * variance * local
    left = pull @ kernel + weights.coherence * variance * np.eye(len(nodes))
    return np.asarray(np.linalg.solve(left, shares @ points - pull @ nodes), np.float64)


def coherence_kernel(nodes: FloatArray, width: float) -> FloatArray:
    """Return the Gaussian kernel between nodes, shape (m, m)."""
    return np.exp(squared_distances(nodes, nodes) / (-2.0 * width**2))


def local_linearity(nodes: FloatArray) -> FloatArray:
    """Return ``(I - L)^T (I - L)``, shape (m, m), where a row of L makes a node of its neighbours on the chain.

    The weights of a row add up to 1 and leave the least remainder (Roweis, Saul: Nonlinear Dimensionality Reduction by
    Locally Linear Embedding, Science 2000).
    """
    count = len(nodes)
    off = np.eye(count)
    for i in range(count):
        near = [j for j in range(max(0, i - _NEIGHBOURS), min(count, i + _NEIGHBOURS + 1)) if j != i]
        spans = nodes[near] - nodes[i]
        gram = spans @ spans.T
        gram += _CONDITION * np.trace(gram) * np.eye(len(near))
        share = np.linalg.solve(gram, np.ones(len(near)))
        off[i, near] -= share / share.sum()
    return off.T @ off


def limit_stretch(nodes: FloatArray, lengths: FloatArray) -> FloatArray:
    """Return nodes (m, d) near those given whose edges are no longer than `lengths`, shape (m - 1,).

    The even and the odd edges are drawn together in turns, both ends of each by as much. What is left after that is
    taken from the middle outwards, so that the limits hold in any case.
    """
    limited = nodes.copy()
    for _ in range(_SWEEPS):
        for first in (0, 1):
            _pull_together(limited, lengths, first)
        if (np.linalg.norm(np.diff(limited, axis=0), axis=1) <= lengths * (1.0 + _SLACK)).all():
            return limited
    middle = len(nodes) // 2
    for i in range(middle, len(nodes) - 1):
        limited[i + 1] = _within(limited[i], limited[i + 1], lengths[i])
    for i in range(middle, 0, -1):
        limited[i - 1] = _within(limited[i], limited[i - 1], lengths[i - 1])
    return limited


def _pull_together(nodes: FloatArray, lengths: FloatArray, first: int) -> None:
    """Draw the ends of every second edge together that is too long, in place."""
    edges = nodes[first + 1 :: 2] - nodes[first : len(nodes) - 1 : 2]
    long = np.linalg.norm(edges, axis=1)
    excess = np.maximum(1.0 - lengths[first::2] / np.maximum(long, 1e-300), 0.0)
    step = 0.5 * excess[:, None] * edges
    nodes[first + 1 :: 2] -= step
    nodes[first : len(nodes) - 1 : 2] += step


def _within(centre: FloatArray, node: FloatArray, reach: float) -> FloatArray:
    span = node - centre
    return centre + span * min(1.0, reach / max(float(np.linalg.norm(span)), 1e-300))


def _variance(nodes: FloatArray, points: FloatArray, shares: FloatArray) -> float:
    """Return the variance per dimension that the M-step asks for: CPD, the last line of figure 4."""
    of_points = shares.sum(axis=0) @ (points**2).sum(axis=1)
    of_nodes = shares.sum(axis=1) @ (nodes**2).sum(axis=1)
    between = float(((shares @ points) * nodes).sum())
    return float(of_points + of_nodes - 2.0 * between) / max(float(shares.sum()) * nodes.shape[1], 1e-300)


def squared_distances(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the squared distances (m, n) between points (m, d) and (n, d) that lie about the origin."""
    result: FloatArray = (x**2).sum(axis=1)[:, None] + (y**2).sum(axis=1) - 2.0 * (x @ y.T)
    return result.clip(min=0.0)
