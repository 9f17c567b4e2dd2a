"""The criteria of the paper (Kicki, Szymko, Walas, ICRA 2023): how far found curves are from the truth.

Points are ``(x, y)`` px or ``(x, y, z)`` m; the results have the same unit. A set without points has no distance: the
functions refuse it, and a table counts it as missing instead.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray, as_points

_TINY = np.finfo(np.float64).tiny


def mmd(x: npt.ArrayLike, y: npt.ArrayLike) -> float:
    """Mean minimal distance of one set of points from another (paper: evaluation, ``MMD``).

    ``MMD(X, Y) = 1 / |X| * sum over x in X of min over y in Y of |x - y|``; not symmetric.

    Parameters
    ----------
    x : array_like, shape (n, d)
    y : array_like, shape (m, d)

    Raises
    ------
    InputError
        If a set is empty, its shape is wrong, or a value is not finite.
    """
    return _mmd(*_pair(("x", x), ("y", y), least=1))


def l1(mask_pixels: npt.ArrayLike, curve_points: npt.ArrayLike) -> float:
    """Mean distance of the mask's pixels from the curve (paper: evaluation, ``L1``); parts that were missed raise it.

    ``L1 = MMD(mask pixels, curve points)``. A perfect centre line scores a quarter of the object's width, not 0.

    Parameters
    ----------
    mask_pixels : array_like, shape (n, d)
        Pixels ``(x, y)``, or points in space, of the object.
    curve_points : array_like, shape (m, d)
        Points along the found curve, dense.

    Raises
    ------
    InputError
        As `mmd`.
    """
    return _mmd(*_pair(("mask_pixels", mask_pixels), ("curve_points", curve_points), least=1))


def l2(curve_points: npt.ArrayLike, mask_pixels: npt.ArrayLike) -> float:
    """Mean distance of the curve from the mask's pixels (paper: evaluation, ``L2``); invented parts raise it.

    ``L2 = MMD(curve points, mask pixels)``.

    Parameters
    ----------
    curve_points : array_like, shape (m, d)
        Points along the found curve, dense.
    mask_pixels : array_like, shape (n, d)
        Pixels ``(x, y)``, or points in space, of the object.

    Raises
    ------
    InputError
        As `mmd`.
    """
    return _mmd(*_pair(("curve_points", curve_points), ("mask_pixels", mask_pixels), least=1))


def f_distance(x: npt.ArrayLike, y: npt.ArrayLike) -> float:
    """Mean distance of one ordered curve from another at equal arc lengths (paper: evaluation, ``F``).

    ``F(X, Y) = 1 / |X| * sum over i of d(X(i), segment Y(k(i)) Y(k(i) + 1))``, where ``k(i)`` brackets the normalised
    arc length of ``X(i)`` and never decreases.

    Parameters
    ----------
    x : array_like, shape (n, d)
        At least two points, in order.
    y : array_like, shape (m, d)
        At least two points, in order.

    Raises
    ------
    InputError
        If a curve has less than two points, its shape is wrong, or a value is not finite.
    """
    return _f(*_pair(("x", x), ("y", y), least=2))


def l3(c: npt.ArrayLike, r: npt.ArrayLike) -> float:
    """Distance of a found curve from the reference, order and direction included (paper: evaluation, ``L3``).

    ``L3 = (F(C, R) + F(R, C)) / 2``; symmetric.

    Parameters
    ----------
    c : array_like, shape (n, d)
        The found curve, at least two points in order.
    r : array_like, shape (m, d)
        The reference, at least two points in order.

    Raises
    ------
    InputError
        As `f_distance`.
    """
    return _l3(*_pair(("c", c), ("r", r), least=2))


def l3_undirected(c: npt.ArrayLike, r: npt.ArrayLike) -> float:
    """`l3` where it does not matter at which end a curve begins: the smaller one of both directions of `r`.

    Parameters
    ----------
    c, r
        As `l3` has them.

    Raises
    ------
    InputError
        As `f_distance`.
    """
    found, reference = _pair(("c", c), ("r", r), least=2)
    return min(_l3(found, reference), _l3(found, reference[::-1]))


def _mmd(x: FloatArray, y: FloatArray) -> float:
    # A tree that is not balanced is built in less time than a balanced one saves.
    distance, _ = cKDTree(y, balanced_tree=False).query(x)
    return float(distance.mean())


def _l3(x: FloatArray, y: FloatArray) -> float:
    return (_f(x, y) + _f(y, x)) / 2.0


def _f(x: FloatArray, y: FloatArray) -> float:
    # Both arc lengths grow, and so does k.
    k = np.clip(np.searchsorted(_arc(y), _arc(x), side="right") - 1, 0, len(y) - 2)
    return mean_distance_to_sides(x, y, k)


def mean_distance_to_sides(x: FloatArray, y: FloatArray, k: npt.NDArray[np.intp]) -> float:
    """Return the mean of `distances_to_sides`."""
    return float(distances_to_sides(x, y, k).mean())


def distances_to_sides(x: FloatArray, y: FloatArray, k: npt.NDArray[np.intp]) -> FloatArray:
    """Return the distances (n,) of the points ``x[i]``, shape (n, d), from the segments ``y[k[i]]`` to ``y[k[i] + 1]``.

    Nothing is checked; ``k``, shape (n,), must lie in ``0 .. len(y) - 2``.
    """
    side = y[k + 1] - y[k]
    from_start = x - y[k]
    squared = (side**2).sum(axis=1)
    along = (from_start * side).sum(axis=1)
    part = np.clip(np.divide(along, squared, out=np.zeros_like(along), where=squared > _TINY), 0.0, 1.0)
    return np.linalg.norm(from_start - part[:, None] * side, axis=1)


def _arc(points: FloatArray) -> FloatArray:
    """Return the normalised arc length at each point, shape (n,); zeros where the points are all one."""
    arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    return arc / arc[-1] if arc[-1] > 0 else arc


def _pair(first: tuple[str, npt.ArrayLike], second: tuple[str, npt.ArrayLike], least: int) -> list[FloatArray]:
    checked = [as_points(name, value) for name, value in (first, second)]
    for (name, _), points in zip((first, second), checked, strict=True):
        if len(points) < least:
            raise InputError(f"{name} must have {least} or more points, got {len(points)}")
    if checked[0].shape[1] != checked[1].shape[1]:
        raise InputError(
            f"{first[0]} and {second[0]} must have the same dimension, got {checked[0].shape} and {checked[1].shape}"
        )
    return checked
