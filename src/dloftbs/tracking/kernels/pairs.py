"""Distances of tracks from what a frame shows, pair by pair."""

from __future__ import annotations

import math

import numpy as np
from numba import boolean, float64

from dloftbs.kernels.compiler import Bools, Floats, helper, kernel, read
from dloftbs.tracking.kernels.interpolation import value_at

_STARTS = 32
"""Number of places along a curve from which a shorter track is compared with it, at most.

Source: bounds time; one to two of a curve's samples.
"""


@helper
def _boxes(curves: Floats) -> Floats:
    """Return the least x and y, and the largest x and y, of each curve (n, m, 2), shape (n, 4)."""
    boxes = np.empty((len(curves), 4))
    for i in range(len(curves)):
        boxes[i, :2] = boxes[i, 2:] = curves[i, 0]
        for k in range(1, curves.shape[1]):
            for d in range(2):
                boxes[i, d] = min(boxes[i, d], curves[i, k, d])
                boxes[i, d + 2] = max(boxes[i, d + 2], curves[i, k, d])
    return boxes


@kernel(read(float64, 3), read(float64, 3))
def box_distances(tracks: Floats, found: Floats) -> Floats:
    """Return the distances between the boxes of tracks and of curves.

    Parameters
    ----------
    tracks : (t, m, 2) float64
    found : (f, m, 2) float64

    Returns
    -------
    (t, f) float64
    """
    ones, others = _boxes(tracks), _boxes(found)
    distances = np.empty((len(ones), len(others)))
    for t in range(len(ones)):
        for f in range(len(others)):
            x = max(ones[t, 0] - others[f, 2], others[f, 0] - ones[t, 2], 0.0)
            y = max(ones[t, 1] - others[f, 3], others[f, 1] - ones[t, 3], 0.0)
            distances[t, f] = math.sqrt(x * x + y * y)
    return distances


@helper
def _mean_distance(points: Floats, others: Floats, is_reversed: bool) -> float:
    total, last = 0.0, len(points) - 1
    for k in range(len(points)):
        j = last - k if is_reversed else k
        x, y = points[k, 0] - others[j, 0], points[k, 1] - others[j, 1]
        total += math.sqrt(x * x + y * y)
    return total / len(points)


@helper
def _length(points: Floats) -> float:
    """Return the length of the polygon through points (m, 2)."""
    length = 0.0
    for k in range(1, len(points)):
        x, y = points[k, 0] - points[k - 1, 0], points[k, 1] - points[k - 1, 1]
        length += math.sqrt(x * x + y * y)
    return length


@helper
def _distance_as_part(points: Floats, curve: Floats, share: float, is_reversed: bool) -> float:
    """Return the least mean distance of points (m, 2) from a share of a curve's samples, of all places along it."""
    last, least = len(points) - 1, np.inf
    starts = math.ceil((1.0 - share) * _STARTS)
    for start in range(starts + 1):
        first, total = (1.0 - share) * start / max(starts, 1), 0.0
        for k in range(len(points)):
            place = (first + share * (last - k if is_reversed else k) / last) * (len(curve) - 1)
            x, y = points[k, 0] - value_at(curve, place, 0), points[k, 1] - value_at(curve, place, 1)
            total += math.sqrt(x * x + y * y)
        least = min(least, total / len(points))
    return least


@kernel(read(float64, 2), read(float64, 2))
def mean_distance(points: Floats, others: Floats) -> float:
    """Return the mean distance of points (m, 2) from others in the same order, px."""
    return _mean_distance(points, others, False)


@kernel(read(float64, 3), read(float64, 3), read(float64, 2), read(boolean, 1))
def mean_distances(tracks: Floats, found: Floats, nearer: Floats, is_part: Bools) -> tuple[Floats, Floats]:
    """Return the mean distances of tracks from curves, sample by sample.

    Parameters
    ----------
    tracks : (t, m, 2) float64
    found : (f, m, 2) float64
    nearer : (t, f) float64
        Only the pairs count whose boxes are nearer to each other than this.
    is_part : (t,) bool
        Tracks that may be a part of a longer curve: they are compared with the best place along it, too.

    Returns
    -------
    there, back : (t, f) float64
        In the order of the samples of the curves, and against it; infinite for pairs that do not count.
    """
    apart = box_distances(tracks, found)
    there, back = np.full(apart.shape, np.inf), np.full(apart.shape, np.inf)
    for t in range(len(tracks)):
        for f in range(len(found)):
            if apart[t, f] < nearer[t, f]:
                there[t, f] = _mean_distance(tracks[t], found[f], False)
                back[t, f] = _mean_distance(tracks[t], found[f], True)
                length, longer = _length(tracks[t]), _length(found[f])
                if is_part[t] and length < longer:
                    share = length / longer
                    there[t, f] = min(there[t, f], _distance_as_part(tracks[t], found[f], share, False))
                    back[t, f] = min(back[t, f], _distance_as_part(tracks[t], found[f], share, True))
    return there, back


@kernel(read(float64, 2), read(float64, 3), float64)
def lie_near(points: Floats, curves: Floats, distance: float) -> Bools:
    """Return which points lie nearer to a sample of some curve than a distance.

    Parameters
    ----------
    points : (n, 2) float64
    curves : (f, m, 2) float64
    distance : float

    Returns
    -------
    (n,) bool
    """
    near = np.zeros(len(points), dtype=np.bool_)
    for i in range(len(points)):
        for f in range(len(curves)):
            for k in range(curves.shape[1]):
                x, y = points[i, 0] - curves[f, k, 0], points[i, 1] - curves[f, k, 1]
                if x * x + y * y < distance * distance:
                    near[i] = True
                    break
            if near[i]:
                break
    return near


@kernel(read(float64, 1), read(float64, 1), float64)
def ratios_differ(ones: Floats, others: Floats, largest: float) -> Bools:
    """Return which pairs of lengths have a larger ratio, or one less than its reciprocal.

    Parameters
    ----------
    ones : (n,) float64
        Those that are NaN, or not positive, are unknown, and agree with any.
    others : (m,) float64
    largest : float

    Returns
    -------
    (n, m) bool
    """
    differ = np.zeros((len(ones), len(others)), dtype=np.bool_)
    for i in range(len(ones)):
        for j in range(len(others)):
            if ones[i] > 0.0 and others[j] > 0.0:
                ratio = ones[i] / others[j]
                differ[i, j] = ratio > largest or ratio < 1.0 / largest
    return differ
