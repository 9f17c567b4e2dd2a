"""Probabilities around a centre line: the value ahead of an end, and the border to both sides."""

from __future__ import annotations

import math

import numpy as np
from numba import boolean, float64, int64, uint8

from dloftbs.kernels.compiler import Bytes, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.soft_masks import AHEAD_WIDTHS, ridge_at


@helper
def _interpolated(soft: Bytes, x: float, y: float) -> float:
    """Return the probability between four pixels; beyond the border as on it."""
    x, y = min(max(x, 0.0), soft.shape[1] - 1.0), min(max(y, 0.0), soft.shape[0] - 1.0)
    column, row = int(x), int(y)
    right, below = min(column + 1, soft.shape[1] - 1), min(row + 1, soft.shape[0] - 1)
    u, v = x - column, y - row
    upper = (1.0 - u) * soft[row, column] + u * soft[row, right]
    lower = (1.0 - u) * soft[below, column] + u * soft[below, right]
    return float((1.0 - v) * upper + v * lower)


@kernel(read(float64, 2), boolean, read(uint8, 2), float64, int64)
def least_ahead(points: Floats, at_end: bool, soft: Bytes, width: float, limit: int) -> int:
    """Return the value that is nowhere missing ahead of an end, beyond what its soft border has there.

    That is what lies as far beside the cable as the place ahead lies beyond its end, on the side that has less.

    Parameters
    ----------
    points : (n, 2) float64
        Of a centre line, ``(x, y)`` px.
    at_end : bool
        Which end: that of the last point.
    soft : (h, w) uint8
        Probability, of 256.
    width : float
        px.
    limit : int
        What is less is ground.

    Returns
    -------
    int
        Of the values below the limit across each place ahead the largest, less the border's, and of these the least; -1
        where another object or the image's border lies there.
    """
    last = len(points) - 1
    back = min(math.ceil(AHEAD_WIDTHS[-1] * width), last)
    tip, other = (last, last - back) if at_end else (0, back)  # by the other one the tip's direction is measured
    dx, dy = points[tip, 0] - points[other, 0], points[tip, 1] - points[other, 1]
    length = math.sqrt(dx * dx + dy * dy)
    if length == 0.0:
        return -1
    dx, dy = dx / length, dy / length
    least, is_seen = limit, False
    for along in AHEAD_WIDTHS:
        x, y = points[tip, 0] + along * width * dx, points[tip, 1] + along * width * dy
        most = ridge_at(soft, x, y, dx, dy, width)
        if most < 0:
            return -1
        if most >= limit:
            continue
        is_seen = True
        beside = 255.0
        for side in (-1.0, 1.0):
            aside = side * (along + 0.5) * width
            beside = min(beside, _interpolated(soft, points[other, 0] - aside * dy, points[other, 1] + aside * dx))
        least = min(least, max(most - round(beside), 0))
    return least if is_seen else -1


@kernel(read(float64, 2), read(uint8, 2), float64)
def ridge_values(points: Floats, soft: Bytes, width: float) -> Ints:
    """Return the largest value across each point of a curve that has less than half of it a width aside.

    An edge is where there is half, so that this is what a cable has.

    Parameters
    ----------
    points : (n, 2) float64
        ``(x, y)`` px.
    soft : (h, w) uint8
        Probability, of 256.
    width : float
        px.

    Returns
    -------
    (n,) int64
        0 where there is more on a side, -1 off the image.
    """
    values = np.empty(len(points), dtype=np.int64)
    for at in range(len(points)):
        first, last = max(at - 1, 0), min(at + 1, len(points) - 1)
        dx, dy = points[last, 0] - points[first, 0], points[last, 1] - points[first, 1]
        length = max(math.sqrt(dx * dx + dy * dy), 1e-9)
        x, y, dx, dy = points[at, 0], points[at, 1], dx / length, dy / length
        values[at] = ridge_at(soft, x, y, dx, dy, width)
        beside = max(
            _interpolated(soft, x - width * dy, y + width * dx), _interpolated(soft, x + width * dy, y - width * dx)
        )
        if 2.0 * beside >= values[at] > 0:
            values[at] = 0
    return values


@kernel(read(float64, 2), read(uint8, 2), float64)
def soft_width(points: Floats, soft: Bytes, width: float) -> float:
    """Return the median distance between the borders to both sides, where the probability is half of that between them.

    Measured every half width.

    Parameters
    ----------
    points : (n, 2) float64
        Of a centre line, ``(x, y)`` px.
    soft : (h, w) uint8
        Probability, of 256.
    width : float
        px; a border is sought up to as far to either side.

    Returns
    -------
    float
        px.
    """
    back, steps = math.ceil(0.5 * width), math.ceil(width)
    widths = np.zeros((len(points) + back - 1) // back)
    for k in range(len(widths)):
        at = k * back
        first, last = max(at - back, 0), min(at + back, len(points) - 1)
        dx, dy = points[last, 0] - points[first, 0], points[last, 1] - points[first, 1]
        length = max(math.sqrt(dx * dx + dy * dy), 1e-9)
        half = 0.5 * _interpolated(soft, points[at, 0], points[at, 1])
        for side in (-1.0, 1.0):
            before, step = 2.0 * half, 0
            while step < steps:
                step += 1
                aside = side * step / length
                value = _interpolated(soft, points[at, 0] - aside * dy, points[at, 1] + aside * dx)
                if value < half:
                    widths[k] += (half - before) / (value - before) - 1.0
                    break
                before = value
            widths[k] += step
    return float(np.median(widths))
