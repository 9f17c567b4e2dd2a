"""Where runs of a skeleton turn more sharply than a cable can, and how they are cut there."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import boolean, float64, int64

from dloftbs.kernels._compile import kernel, read

_CHORD_WIDTHS = 1.5


@kernel(read(float64, 2), read(int64, 1), read(int64, 1), int64, float64, float64)
def find_kinks(
    points: npt.NDArray[np.float64],
    offsets: npt.NDArray[np.int64],
    nodes: npt.NDArray[np.int64],
    n_open: int,
    width: float,
    sharp: float,
) -> npt.NDArray[np.int64]:
    """Find where runs turn more sharply than a cable can: where two cables meet at an angle, and no branch shows it.

    Parameters
    ----------
    points : (m, 2) float64
    offsets : (runs + 1,) int64
    nodes : (2 n_open,) int64
    n_open : int
    width : float
        px; a point's turn is that between the chords over one and a half widths before and after it.
    sharp : float
        The smallest turn, rad.

    Returns
    -------
    (k,) int64
        Indices into `points`, ascending.
    """
    reach = max(int(_CHORD_WIDTHS * width + 0.5), 3)
    blunt = np.cos(sharp) ** 2 if sharp < 0.5 * np.pi else 0.0
    found = np.empty(len(points), dtype=np.int64)
    count = 0
    for run in range(n_open):
        best, best_turn = -1, sharp
        for i in range(offsets[run] + reach, offsets[run + 1] - reach):
            ax, ay = points[i, 0] - points[i - reach, 0], points[i, 1] - points[i - reach, 1]
            bx, by = points[i + reach, 0] - points[i, 0], points[i + reach, 1] - points[i, 1]
            if best >= 0 and i > best + reach:
                found[count] = best
                count += 1
                best, best_turn = -1, sharp
            along = ax * bx + ay * by
            if along > 0.0 and along * along > blunt * (ax * ax + ay * ay) * (bx * bx + by * by):
                continue
            turn = abs(np.arctan2(ax * by - ay * bx, along))
            if turn > best_turn:
                best, best_turn = i, turn
        if best >= 0:
            found[count] = best
            count += 1
    return found[:count].copy()


@kernel(read(int64, 1), read(int64, 1), read(int64, 1), read(boolean, 1), int64)
def split_runs(
    cuts: npt.NDArray[np.int64],
    offsets: npt.NDArray[np.int64],
    nodes: npt.NDArray[np.int64],
    alive: npt.NDArray[np.bool_],
    count: int,
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    """Cut runs in two, with a new junction of two arms at each cut.

    Parameters
    ----------
    cuts : (k,) int64
        Indices of points, ascending: where the second part starts. Those in runs that are not alive are left out.
    offsets : (runs + 1,) int64
    nodes : (2 n_open,) int64
    alive : (n_open,) bool
    count : int
        Number of junctions; cut ``i`` becomes junction ``count + i``.

    Returns
    -------
    offsets, nodes, alive
        With the parts in the place of each run.
    """
    n_open = len(alive)
    room = len(cuts)
    new_offsets = np.empty(len(offsets) + room, dtype=np.int64)
    new_nodes = np.empty(len(nodes) + 2 * room, dtype=np.int64)
    new_alive = np.empty(n_open + room, dtype=np.bool_)
    n, k = 0, 0
    for run in range(n_open):
        new_offsets[n] = offsets[run]
        new_nodes[2 * n] = nodes[2 * run]
        new_alive[n] = alive[run]
        while k < len(cuts) and cuts[k] < offsets[run + 1]:
            if alive[run]:
                new_nodes[2 * n + 1] = count + k
                n += 1
                new_offsets[n] = cuts[k]
                new_nodes[2 * n] = count + k
                new_alive[n] = True
            k += 1
        new_nodes[2 * n + 1] = nodes[2 * run + 1]
        n += 1
    loops = len(offsets) - n_open
    new_offsets[n : n + loops] = offsets[n_open:]
    return new_offsets[: n + loops].copy(), new_nodes[: 2 * n].copy(), new_alive[:n].copy()
