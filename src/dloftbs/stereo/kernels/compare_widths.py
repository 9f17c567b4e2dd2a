"""Widths of an object in two views, in metres, which must agree."""

from __future__ import annotations

import math

import numpy as np
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import Bools, Floats, Ints, kernel, read, write
from dloftbs.stereo.kernels.observations import CLEAR, DEPTH, RADIUS, WEIGHT, half_widths

_WIDER = 2.0
"""Excess of a width over the object's median from which it is that of several passes, standard deviations.

Source: by hand; 1.25 times as wide, where two equal strands overlap by three quarters.
"""


@kernel(
    read(float64, 1, "C"), write(float64, 2, "C"), read(float64, 1, "C"), read(int64, 1, "C"),
    read(float64, 1, "C"), int64, float64, float64, float64, write(boolean, 1, "C"),
)  # fmt: skip
def compare_widths(
    t: Floats,
    rows: Floats,
    depths: Floats,
    views: Ints,
    focals_px: Floats,
    spans: int,
    width_std: float,
    radius_std_px: float,
    most: float,
    shown: Bools,
) -> tuple[int, float]:
    """Find where the widths in two views, in metres, contradict each other: one of them shows something else there.

    Where an object is wider than elsewhere, its mask has merged with that of another pass, which counts as well.

    Parameters
    ----------
    t, depths, views
        As `fit_views` left them.
    rows : (m, 8) float64
        What is contradicted is no longer clear then, and may be as far off as the cable is wide.
    focals_px : (k,) float64
        Of the views.
    spans : int
        Number of equal parts of the curve in which views are compared.
    width_std : float
        Standard deviation of the logarithm of a width.
    radius_std_px : float
        Standard deviation of half a width, px.
    most : float
        Difference that is a contradiction, standard deviations.
    shown : (spans,) bool
        Written: whether at least two views have clear observations there, or one a depth.

    Returns
    -------
    found : int
        Number of observations that are contradicted.
    width_m : float
        Width of the object, the geometric mean of what is clear; 0 where nothing is.
    """
    m, k = len(t), len(focals_px)
    sums, counts = np.zeros((k, spans)), np.zeros((k, spans))
    half_widths_m = half_widths(rows) * depths
    for i in range(m):
        if rows[i, CLEAR] > 0.0:
            span = min(int(t[i] * spans), spans - 1)
            sums[views[i], span] += math.log(half_widths_m[i])
            counts[views[i], span] += 1.0
    usual = np.log(np.median(half_widths_m[rows[:, DEPTH] == 0.0]))
    found = 0
    for i in range(m):
        if rows[i, CLEAR] == 0.0:
            continue
        span, own = min(int(t[i] * spans), spans - 1), math.log(half_widths_m[i])
        std = math.hypot(width_std, radius_std_px / (focals_px[views[i]] * rows[i, RADIUS]))
        if own - usual > _WIDER * std:
            rows[i, WEIGHT], rows[i, CLEAR] = 0.25 / (rows[i, RADIUS] * rows[i, RADIUS]), 0.0
            found += 1
        for view in range(k):
            if view == views[i] or counts[view, span] == 0.0:
                continue
            if rows[i, CLEAR] > 0.0 and abs(own - sums[view, span] / counts[view, span]) > most * std:
                rows[i, WEIGHT], rows[i, CLEAR] = 0.25 / (rows[i, RADIUS] * rows[i, RADIUS]), 0.0
                found += 1
    counts[:] = 0.0
    total = number = 0.0
    for i in range(m):
        span = min(int(t[i] * spans), spans - 1)
        if rows[i, DEPTH] > 0.0:
            counts[views[i], span] = 2.0
        if rows[i, CLEAR] > 0.0:
            counts[views[i], span] = max(counts[views[i], span], 1.0)
            total += math.log(half_widths_m[i])
            number += 1.0
    for span in range(spans):
        shown[span] = counts[:, span].sum() >= 2.0
    return found, 2.0 * math.exp(total / number) if number > 0.0 else 0.0
