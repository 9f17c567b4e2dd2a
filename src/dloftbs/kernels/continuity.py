"""Which pairs of ends continue each other along curves that were seen before."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64

from dloftbs.kernels._compile import helper, kernel, read

_NEAR_WIDTHS = 1.5  # farther from a curve, an end has nothing to do with it
_ALONG = 0.6  # least cosine between an end and the curve
_AHEAD_CHORDS, _AHEAD_WIDTHS = 1.6, 2.0  # a joint follows the curve for no longer


@helper
def _place(
    arms: npt.NDArray[np.float64],
    end: int,
    points: npt.NDArray[np.float64],
    tangents: npt.NDArray[np.float64],
    start: int,
    stop: int,
    near: float,
    at: npt.NDArray[np.int64],
    fit: npt.NDArray[np.float64],
) -> None:
    """Write where on a curve an end lies, pointing onwards (0) and backwards (1), and how well, 0 where it does not."""
    fit[0] = fit[1] = 0.0
    for k in range(start, stop):
        dx, dy = points[k, 0] - arms[end, 0], points[k, 1] - arms[end, 1]
        if abs(dx) >= near or abs(dy) >= near:
            continue
        along = arms[end, 2] * tangents[k, 0] + arms[end, 3] * tangents[k, 1]
        if abs(along) < _ALONG:
            continue
        value = (1.0 - np.sqrt(dx * dx + dy * dy) / near) * abs(along)
        way = 0 if along > 0.0 else 1
        if value > fit[way]:
            fit[way], at[way] = value, k


@kernel(
    read(float64, 2), read(int64, 1), read(int64, 1), read(float64, 2), read(float64, 2), read(int64, 1),
    read(float64, 1), read(boolean, 1), read(float64, 1), float64,
)  # fmt: skip
def follow(
    arms: npt.NDArray[np.float64],
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    points: npt.NDArray[np.float64],
    tangents: npt.NDArray[np.float64],
    first: npt.NDArray[np.int64],
    steps: npt.NDArray[np.float64],
    closed: npt.NDArray[np.bool_],
    trust: npt.NDArray[np.float64],
    width: float,
) -> npt.NDArray[np.float64]:
    """Return how well pairs of ends continue each other along one of several curves.

    Parameters
    ----------
    arms : (n, 6) float64
        As `arms.locate_arms` makes them.
    rows, columns : (k,) int64
        The pairs.
    points, tangents : (m, 2) float64
        Samples of all curves, one curve after the other, evenly spaced, and the directions there, of length 1.
    first : (c + 1,) int64
        Where the samples of each curve start.
    steps : (c,) float64
        From sample to sample, px.
    closed : (c,) bool
    trust : (c,) float64
        In 0..1.
    width : float
        Of the cables, px.

    Returns
    -------
    (k,) float64
        From 0, not at all, to the curve's trust.
    """
    n, pairs = len(arms), len(rows)
    result = np.zeros(pairs)
    used = np.zeros(n, dtype=np.bool_)
    for k in range(pairs):
        used[rows[k]] = used[columns[k]] = True
    at = np.zeros((n, 2), dtype=np.int64)
    fit = np.zeros((n, 2))
    for c in range(len(steps)):
        count = first[c + 1] - first[c]
        for end in range(n):
            if used[end]:
                _place(arms, end, points, tangents, first[c], first[c + 1], _NEAR_WIDTHS * width, at[end], fit[end])
        for k in range(pairs):
            i, j = rows[k], columns[k]
            chord = np.sqrt((arms[i, 0] - arms[j, 0]) ** 2 + (arms[i, 1] - arms[j, 1]) ** 2)
            most = _AHEAD_CHORDS * chord + _AHEAD_WIDTHS * width
            for way in range(2):
                # One end points along the curve, the other against it, and lies ahead of it.
                value = min(fit[i, way], fit[j, 1 - way])
                ahead = at[j, 1 - way] - at[i, way] if way == 0 else at[i, way] - at[j, 1 - way]
                if closed[c] and ahead < -count // 2:
                    ahead += count
                length = ahead * steps[c]
                if value > 0.0 and -width <= length <= most:
                    result[k] = max(result[k], trust[c] * value)
    return result
