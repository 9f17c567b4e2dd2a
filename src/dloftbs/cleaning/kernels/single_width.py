"""Width of one cable in a piece of a mask, whatever part of it lies in bundles, from the distances to the ground."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.kernels.compiler import Bools, Floats, helper, inlined
from dloftbs.kernels.shared.selection import nth_least

_Counts = npt.NDArray[np.int32]

SINGLE_SHARE = 0.15
"""Share of the cables' length that is narrower than what counts as the width of one, beside half a width for the ends.

Source: by hand; that of the ends and of frays. The less it is, the shorter may be the part in which a bundle parts.
"""

_RIDGE_PX = 2.0
"""Largest width of a ridge of distances, px.

Source: geometry; it is one pixel wide where a width is odd, and two where it is even, so that shares are right to this.
"""


@helper
def squared_distances(solid: Bools) -> _Counts:
    """Return the squared distance of each pixel from the nearest one of the ground, after Meijster et al. (2000).

    There is ground all around, and in the first and the last column. Each run of what is solid is worked out by itself.
    """
    rows, columns = solid.shape
    down = np.zeros((rows, columns), dtype=np.int32)
    for r in range(rows):
        for c in range(columns):
            if solid[r, c]:
                down[r, c] = 1 if r == 0 else down[r - 1, c] + 1
    for r in range(rows - 1, -1, -1):
        for c in range(columns):
            down[r, c] = min(down[r, c], 1 if r == rows - 1 else down[r + 1, c] + 1)
    squares = np.zeros((rows, columns), dtype=np.int32)
    site, since = np.empty(columns, dtype=np.int64), np.empty(columns, dtype=np.int64)
    for r in range(rows):
        g, c = down[r], 1
        while c < columns:
            if g[c] == 0:
                c += 1
                continue
            first, last, count = c - 1, c, 0
            while g[last] > 0:
                last += 1
            site[0] = since[0] = first
            for new in range(c, last + 1):
                while count >= 0:
                    at, old = since[count], site[count]
                    if (at - old) ** 2 + g[old] ** 2 <= (at - new) ** 2 + g[new] ** 2:
                        break
                    count -= 1
                meet = first
                if count >= 0:
                    old = site[count]
                    meet = 1 + (new**2 - old**2 + g[new] ** 2 - g[old] ** 2) // (2 * (new - old))
                if meet <= last:
                    count += 1
                    site[count], since[count] = new, meet
            for at in range(last, first, -1):
                squares[r, at] = (at - site[count]) ** 2 + g[site[count]] ** 2
                if at == since[count]:
                    count -= 1
            c = last + 1
    return squares


@inlined
def _is_ridge(squares: _Counts, r: int, c: int) -> bool:
    """Return whether a pixel is as far from the ground as all its neighbours."""
    here = squares[r, c]
    for row in range(r - 1, r + 2):
        for column in range(c - 1, c + 2):
            if squares[row, column] > here:
                return False
    return True


@helper
def single_widths(squares: _Counts, owners: _Counts, pieces: int) -> Floats:
    """Return the width of one cable in each piece, in pixels: that of the narrow part of its ridge.

    `squares` are the squared distances from the ground, and `owners` the pieces of all pixels that are none.
    """
    rows, columns = squares.shape
    count, total = np.zeros(pieces + 1, dtype=np.int64), np.zeros(pieces)
    places = np.empty((np.count_nonzero(squares), 2), dtype=np.int32)
    n = 0
    for r in range(1, rows - 1):
        for c in range(1, columns - 1):
            if squares[r, c] > 0 and _is_ridge(squares, r, c):
                places[n, 0], places[n, 1] = r, c
                count[owners[r, c] + 1] += 1
                total[owners[r, c]] += np.sqrt(float(squares[r, c]))
                n += 1
    until = np.cumsum(count)
    ridge, filled = np.empty(n), until.copy()
    for i in range(n):
        r, c = places[i]
        ridge[filled[owners[r, c]]] = np.sqrt(float(squares[r, c]))
        filled[owners[r, c]] += 1
    widths = np.zeros(pieces)
    for k in range(pieces):
        own = ridge[until[k] : until[k + 1]]
        if len(own) > 0:
            place = min(np.int64(_RIDGE_PX * SINGLE_SHARE * (len(own) - 1) + total[k] / len(own)), len(own) - 1)
            widths[k] = 2.0 * nth_least(own, place) - 1.0
    return widths
