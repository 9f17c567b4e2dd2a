"""Places beyond the ends of curves."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float64

from dloftbs.kernels.compiler import kernel, read

_Floats = npt.NDArray[np.float64]


@kernel(read(float64, 2), float64, read(float64, 1))
def places_beyond(points: _Floats, width: float, distances: _Floats) -> _Floats:
    """Find places beyond both ends of a curve, straight on.

    Parameters
    ----------
    points : (n, 2) float64
        Along the curve; two or more. The first two and the last two tell the directions.
    width : float
        px.
    distances : (k,) float64
        From the ends, widths.

    Returns
    -------
    (2 k, 2) float64
        Those beyond the first end, then those beyond the last; at the end itself where its direction is unknown.
    """
    count, last = len(distances), len(points) - 1
    places = np.empty((2 * count, 2))
    for side in range(2):
        end, before = (0, 1) if side == 0 else (last, last - 1)
        dx, dy = points[end, 0] - points[before, 0], points[end, 1] - points[before, 1]
        norm = math.sqrt(dx * dx + dy * dy)
        scale = width / norm if norm > 0.0 else 0.0
        for k in range(count):
            places[side * count + k, 0] = points[end, 0] + distances[k] * scale * dx
            places[side * count + k, 1] = points[end, 1] + distances[k] * scale * dy
    return places
