"""Evidence of a frame as columns of joints: ground in sight, hidden gaps, depths to compare."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import float64, int64

from dloftbs.kernels.compiler import kernel, read, write
from dloftbs.kernels.shared.graph_ends import X, Y
from dloftbs.linking.kernels.joint_features import GAP_GROUND, GAP_HIDDEN, GAP_ROUND, GAP_SEEN
from dloftbs.linking.kernels.pixel_weights import SHARE_IN_SIGHT

_MAX_GROUND = 0.5
"""Most ground in sight across a gap that counts, widths.

Source: fitted; of a half, one and two widths a half shows the most in all sources: more is no clearer.
The fit is older than the log-odds from images, which were in this column then.
"""

_STRAY_GROUND = 0.15
"""Share of a gap below which ground in sight counts as none.

Source: by hand; a place in seven, whose depth is a flying pixel.
"""


@kernel(read(int64, 1), read(float64, 2), read(int64, 2))
def list_gaps(
    nodes: npt.NDArray[np.int64], states: npt.NDArray[np.float64], pairs: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """List the pairs of ends that are no link through a junction, and measure how far apart the ends of each pair lie.

    Parameters
    ----------
    nodes : (n,) int64
        The junction at each end, negative where there is none.
    states : (n, 6) float64
    pairs : (k, 2) int64

    Returns
    -------
    gaps : (g,) int64
        Places in `pairs`.
    lengths : (k,) float64
        px.
    """
    gaps, lengths, count = np.empty(len(pairs), dtype=np.int64), np.empty(len(pairs)), 0
    for k in range(len(pairs)):
        i, j = pairs[k]
        lengths[k] = math.hypot(states[i, X] - states[j, X], states[i, Y] - states[j, Y])
        if nodes[i] < 0 or nodes[i] != nodes[j]:
            gaps[count] = k
            count += 1
    return gaps[:count].copy(), lengths


@kernel(
    read(float64, 2), read(float64, 1), read(int64, 1), read(float64, 1), read(int64, 2), read(float64, 1), float64,
    write(float64, 2),
)  # fmt: skip
def describe_seen(
    seen: npt.NDArray[np.float64],
    log_odds: npt.NDArray[np.float64],
    gaps: npt.NDArray[np.int64],
    lengths: npt.NDArray[np.float64],
    pairs: npt.NDArray[np.int64],
    roundness: npt.NDArray[np.float64],
    width: float,
    joints: npt.NDArray[np.float64],
) -> None:
    """Write what is seen across gaps into the columns of joints.

    The shape of an end does not count before a gap that is shown to be hidden, by as much as is hidden, whichever end
    it is joined with: what is known of one gap and not of another one must not decide between them.

    Parameters
    ----------
    seen : (g, 3) float64
        How much of each gap is ground, a cable, and neither, widths.
    log_odds : (g,) float64
        That the rest is hidden, and not ground in sight, as the image shows it, nats.
    gaps, lengths
        As `list_gaps` makes them.
    pairs : (k, 2) int64
    roundness : (n,) float64
        Of each end.
    width : float
        px.
    joints : (k, columns) float64
        Changed.
    """
    covered = np.zeros(len(roundness))
    for g in range(len(gaps)):
        k = gaps[g]
        length = max(lengths[k] / width, 1e-9)
        ground = 0.0 if seen[g, 0] < _STRAY_GROUND * length else seen[g, 0]
        hidden = min(seen[g, 1] + seen[g, 2], length)
        joints[k, GAP_GROUND], joints[k, GAP_HIDDEN] = min(ground, _MAX_GROUND), hidden
        joints[k, GAP_SEEN] = -math.log(SHARE_IN_SIGHT * math.exp(-log_odds[g]) + 1.0 - SHARE_IN_SIGHT)
        is_hidden = max((hidden - ground) / length, math.tanh(0.5 * log_odds[g]))  # twice a probability, less 1
        for end in pairs[k]:
            covered[end] = max(covered[end], is_hidden)
    for k in range(len(pairs)):
        i, j = pairs[k]
        shape = roundness[i] * (1.0 - covered[i]) + roundness[j] * (1.0 - covered[j])
        joints[k, GAP_ROUND] *= shape / max(roundness[i] + roundness[j], 1e-9)
