"""Labels of single objects before the ends of branches."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float64, int64, uint16

from dloftbs.evidence.kernels.end_references import place_before
from dloftbs.kernels.compiler import Floats, Ints, helper, kernel, read


@helper
def _label_at(labels: npt.NDArray[np.uint16], x: float, y: float) -> int:
    row, column = math.floor(y + 0.5), math.floor(x + 0.5)
    inside = 0 <= row < labels.shape[0] and 0 <= column < labels.shape[1]
    return int(labels[row, column]) if inside else 0


@kernel(read(uint16, 2), read(float64, 2), read(int64, 2), float64)
def label_ends(labels: npt.NDArray[np.uint16], points: Floats, spans: Ints, width: float) -> Ints:
    """Return the label that most places before each end have: beyond a width, where another cable may lie on top.

    Parameters
    ----------
    labels : (h, w) uint16
        0 is ground.
    points : (m, 2) float64
    spans : (n, 2) int64
        The points of each run.
    width : float
        px.

    Returns
    -------
    (2 n,) int64
        Of two that are as frequent the one that is nearer to the end; 0 where none is seen.
    """
    found = np.zeros(2 * len(spans), dtype=np.int64)
    for end in range(len(found)):
        seen = np.zeros(0, dtype=np.int64)
        k = 0
        while True:
            at, x, y, _, _ = place_before(points, spans, end, width, k, width)
            if at < 0:
                break
            seen = np.append(seen, _label_at(labels, x, y))
            k += 1
        most = 0
        for label in seen:
            count = 0
            for other in seen:
                count += other == label
            if label > 0 and count > most:
                found[end], most = label, count
    return found
