"""The skeleton as a graph: runs of pixels, the junctions where they meet, and how their ends are joined.

An end is a number: run ``r`` has the ends ``2 r`` at its first point and ``2 r + 1`` at its last one. Points are posed,
as the patch's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray

_Ints = npt.NDArray[np.int64]
_Bools = npt.NDArray[np.bool_]

FREE = -1
"""In the place of a junction: an end that touches none."""
UNAVAILABLE = -2
"""In the place of a junction: an end that cannot be joined."""


@dataclass(frozen=True, eq=False)
class Graph:
    """Runs and junctions.

    Parameters
    ----------
    points : numpy.ndarray, shape (m, 2)
        ``(x, y)`` in the middle of the mask, run after run, px.
    pixels : numpy.ndarray, shape (m, 2)
        The skeleton's pixels that they come from.
    radius : numpy.ndarray, shape (m,)
        Half the mask's width at each point, px.
    offsets : numpy.ndarray, shape (runs + 1,)
        First point of each run, and the end. First those with ends, then the loops.
    nodes : numpy.ndarray, shape (2 n,)
        The junction at each end of the n runs with ends, `FREE`, or `UNAVAILABLE`.
    spans : numpy.ndarray, shape (n, 2)
        Of each run, the points that lie clear of its junctions.
    arms : numpy.ndarray, shape (2 n, 6)
        See `dloftbs.skeleton.kernels.branch_ends.locate_arms`.
    caps : numpy.ndarray, shape (2 n,)
        Roundness of each free end.
    through : numpy.ndarray, shape (2 n,)
        Distance that the mask goes straight on from each arm of a junction, px.
    spurs : numpy.ndarray, shape (n,)
        Runs that are so short that they need no explanation.
    bordering : numpy.ndarray, shape (2 n,)
        Free ends that the image's border cuts.
    corners : numpy.ndarray, shape (2 n,)
        The point where each end meets another one in a sharp bend, if it has a run of its own; else -1.
    width : float
        Of the cables, px.
    """

    points: FloatArray
    pixels: FloatArray
    radius: FloatArray
    offsets: _Ints
    nodes: _Ints
    spans: _Ints
    arms: FloatArray
    caps: FloatArray
    through: FloatArray
    spurs: _Bools
    bordering: _Bools
    corners: _Ints
    width: float

    @property
    def runs(self) -> int:
        """The number of runs with ends."""
        return len(self.spans)

    @property
    def loops(self) -> list[tuple[int, int]]:
        """The spans of points of the loops that touch no junction."""
        starts = self.offsets[self.runs :].tolist()
        return list(pairwise(starts))


@dataclass(eq=False)
class Pairing:
    """Joints between the ends of a graph. A run that two cables share is listed once for each of them.

    Parameters
    ----------
    points : numpy.ndarray, shape (m, 2)
        As the graph's; where cables lie side by side, each copy has its own.
    radius : numpy.ndarray, shape (m,)
    original : list of int
        The run of the graph that each run is.
    nodes : list of int
        As the graph's, of all runs.
    price : list of float
        Of leaving each end open.
    spans : list of (int, int)
        Of each run, the points that are its own.
    spurs : list of bool
    arms : numpy.ndarray, shape (2 n, 6)
    partner : list of int
        The end that each end is joined to, or -1.
    cost, margin : list of float
        Of the joint at each end.
    other : list of int
        The end that each end would be joined to in the next best choice, or -1.
    twin : dict of int to int
        From each shared run to the other one.
    raw : numpy.ndarray, shape (m,), or None
        Half the mask's width at each point of the graph as its pixels have it, without any smoothing, where it was
        asked for.
    nearly : list of (float, float, int, int)
        Pairs of free ends that were left open although a little less would have joined them: how much, the cost, and
        the two ends; the least first.
    overruled : float
        By how much this frame alone would prefer another reading than the one that follows what was seen before.
    """

    points: FloatArray
    radius: FloatArray
    original: list[int]
    nodes: list[int]
    price: list[float]
    spans: list[tuple[int, int]]
    spurs: list[bool]
    arms: FloatArray
    partner: list[int]
    cost: list[float]
    margin: list[float]
    other: list[int]
    twin: dict[int, int]
    raw: FloatArray | None = None
    overruled: float = 0.0
    nearly: list[tuple[float, float, int, int]] = field(default_factory=list)
    _chains: list[tuple[list[int], bool]] | None = field(default=None, init=False)

    def join(self, i: int, j: int) -> None:
        """Join two ends; whom they were joined to before is not told."""
        self._chains = None
        self.partner[i], self.partner[j] = j, i

    def open(self, i: int) -> None:
        """Open the joint at an end."""
        self._chains = None
        j = self.partner[i]
        if j >= 0:
            self.partner[j] = -1
        self.partner[i] = -1

    def exchange(self, i: int, k: int) -> None:
        """Give two ends each other's partner, open or not."""
        self._chains = None
        p, q = self.partner[i], self.partner[k]
        self.partner[i], self.partner[k] = q, p
        if q >= 0:
            self.partner[q] = i
        if p >= 0:
            self.partner[p] = k

    def is_crossing(self, end: int) -> bool:
        """Return whether the joint at an end runs through a junction."""
        return self.nodes[end] >= 0 and self.nodes[self.partner[end]] == self.nodes[end]

    def chain(self, start: int) -> list[int]:
        """List the ends at which a cable enters its runs, from one end on, until it stops or is back."""
        ends = [start]
        while (end := self.partner[ends[-1] ^ 1]) >= 0 and end != start:
            ends.append(end)
        return ends

    def chains(self) -> list[tuple[list[int], bool]]:
        """List all cables as chains, and whether each is a ring, in a fixed order; runs of no cable are left out."""
        if self._chains is None:
            self._chains = self._list_chains()
        return self._chains

    def _list_chains(self) -> list[tuple[list[int], bool]]:
        found = []
        visited = [False] * len(self.original)
        nodes, partner = self.nodes, self.partner
        live = []
        for run, is_spur in enumerate(self.spurs):
            first, last = 2 * run, 2 * run + 1
            if is_spur:
                if partner[first] >= 0 or partner[last] >= 0:
                    live.append(run)
            elif nodes[first] != UNAVAILABLE or nodes[last] != UNAVAILABLE:
                live.append(run)
        starts = [end for run in live for end in (2 * run, 2 * run + 1) if partner[end] < 0]
        for start in starts + [2 * run for run in live]:
            if not visited[start // 2]:
                chain = self.chain(start)
                for end in chain:
                    visited[end // 2] = True
                found.append((chain, partner[start] >= 0))
        return found
