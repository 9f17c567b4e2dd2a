"""Pixels around places of the image: occluders, which may hide a cable there, and other cables."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import float64, int64, uint8

from dloftbs.kernels.compiler import helper, kernel, read, write


@helper
def _is_set(pixels: npt.NDArray[np.uint8], x: float, y: float) -> bool:
    """Return True if the pixel nearest to a place is not 0; beyond the border that of the border counts."""
    row = min(max(int(np.rint(y)), 0), pixels.shape[0] - 1)
    column = min(max(int(np.rint(x)), 0), pixels.shape[1] - 1)
    return bool(pixels[row, column] != 0)


@kernel(read(float64, 2), read(float64, 2), float64, int64, int64)
def pixels_around(
    points: npt.NDArray[np.float64], offsets: npt.NDArray[np.float64], scale: float, rows: int, columns: int
) -> npt.NDArray[np.int64]:
    """Find the pixels nearest to places around others.

    Parameters
    ----------
    points : (n, 2) float64
        ``(x, y)`` px.
    offsets : (k, 2) float64
        Of the places around each, as shares of `scale`.
    scale : float
        px.
    rows, columns : int
        Size of the image; the border's pixels stand for those beyond it.

    Returns
    -------
    (2, n, k) int64
        Rows and columns.
    """
    found = np.empty((2, len(points), len(offsets)), dtype=np.int64)
    for n in range(len(points)):
        for k in range(len(offsets)):
            x, y = points[n, 0] + scale * offsets[k, 0], points[n, 1] + scale * offsets[k, 1]
            found[0, n, k] = min(max(int(np.rint(y)), 0), rows - 1)
            found[1, n, k] = min(max(int(np.rint(x)), 0), columns - 1)
    return found


@kernel(
    read(float64, 2),
    float64,
    read(float64, 1),
    float64,
    float64,
    float64,
    float64,
    int64,
    int64,
    int64,
    write(int64, 1),
)
def judge_depths(
    stored: npt.NDArray[np.float64],
    unit: float,
    expected: npt.NDArray[np.float64],
    nearest: float,
    farthest: float,
    tolerance: float,
    noise: float,
    least: int,
    hidden: int,
    in_sight: int,
    told: npt.NDArray[np.int64],
) -> None:
    """Tell by the depths in places what hides a cable there.

    Parameters
    ----------
    stored : (n, k) float64
        Around each place, counts.
    unit : float
        Metres per count.
    expected : (n,) float64
        That of the cable, m; NaN where it is unknown: nothing is told.
    nearest, farthest : float
        Depths outside of these, m, are missing, and so are those that are not finite.
    tolerance : float
        Largest difference that tells nothing, m, at no distance.
    noise : float
        The same in addition, at a distance of one metre; it grows with the square.
    least : int
        Number of depths, all of them farther than the cable, that tell that the place is in plain sight.
    hidden, in_sight : int
        Codes; a place is hidden if most known depths are nearer than the cable.
    told : (n,) int64
        Written where the depths tell.
    """
    for n in range(len(stored)):
        limit = tolerance + noise * expected[n] * expected[n]
        nearer, farther, known = 0, 0, 0
        for k in range(stored.shape[1]):
            metres = stored[n, k] * unit
            if nearest <= metres <= farthest:
                known += 1
                nearer += metres < expected[n] - limit
                farther += metres > expected[n] + limit
        if 2 * nearer > known:
            told[n] = hidden
        elif farther == known and known >= least:
            told[n] = in_sight


@kernel(read(float64, 2), read(uint8, 2), read(uint8, 2), int64, int64, float64, int64, int64, write(int64, 1))
def look_around(
    points: npt.NDArray[np.float64],
    occluders: npt.NDArray[np.uint8],
    mask: npt.NDArray[np.uint8],
    rows: int,
    columns: int,
    reach: float,
    hidden: int,
    in_sight: int,
    told: npt.NDArray[np.int64],
) -> None:
    """Tell what hides places, of which depth may have told already; those outside of the image are hidden.

    Parameters
    ----------
    points : (n, 2) float64
        ``(x, y)`` px.
    occluders, mask : (H, W) uint8
        Not 0 where something may hide cables, and where a cable is seen; (0, 0) if it is not known.
    rows, columns : int
        Size of the image.
    reach : float
        Distance in which occluders are near a place, px; cables are in half of it.
    hidden, in_sight : int
        Codes of places that something hides, and that are in plain sight and empty; 0 is unknown.
    told : (n,) int64
        What depth told; written.
    """
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        if not (-0.5 < x < columns - 0.5 and -0.5 < y < rows - 0.5):
            told[n] = hidden
            continue
        if told[n] == 0 and occluders.size:
            near = False
            for dy in (-reach, 0.0, reach):
                for dx in (-reach, 0.0, reach):
                    near |= _is_set(occluders, x + dx, y + dy)
            told[n] = hidden if _is_set(occluders, x, y) else 0 if near else in_sight
        if told[n] == in_sight and mask.size:
            half = 0.5 * reach
            beside = _is_set(mask, x, y) or _is_set(mask, x - half, y) or _is_set(mask, x + half, y)
            if beside or _is_set(mask, x, y - half) or _is_set(mask, x, y + half):
                told[n] = 0
