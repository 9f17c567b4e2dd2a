"""Centre lines of a mask that is a probability: their width, and whether they go on beyond an end."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from dloftbs.data.centerline import Centerline, NearJoint
from dloftbs.kernels.shared.soft_masks import AHEAD_WIDTHS, LEAST_PROBABLE
from dloftbs.linking.kernels.soft_borders import least_ahead, soft_width
from dloftbs.linking.soft_end_weights import GOES_ON
from dloftbs.support.arrays import ByteArray
from dloftbs.support.values import varied


def with_ends_that_go_on(lines: Sequence[Centerline], soft: ByteArray, limit: int) -> tuple[list[Centerline], bool]:
    """Return centre lines with near joints where the probability shows more of the cable ahead of an end.

    Parameters
    ----------
    lines : sequence of Centerline
        Of what is at least `limit`.
    soft : numpy.ndarray, shape (H, W), uint8
        The probability, of 256.
    limit : int

    Returns
    -------
    lines : list of Centerline
    is_more : bool
        Whether a lower limit has more to show: something somewhat probable lies ahead of an end.
    """
    found, is_more = [], False
    for line in lines:
        ends = () if line.closed else [u for u, met in zip((0.0, 1.0), line.branch_ends, strict=True) if met is None]
        ahead = {u: least_ahead(line.points, u == 1.0, soft, line.width_px, limit) for u in ends}
        is_more = is_more or any(value >= LEAST_PROBABLE for value in ahead.values())
        seen = {u: value for u, value in ahead.items() if value > 0}
        found.append(varied(line, near_joints=_near_joints(line, seen)) if seen else line)
    return found, is_more


def with_soft_widths(lines: Sequence[Centerline], soft: ByteArray) -> list[Centerline]:
    """Return centre lines that are no wider than up to where the probability is half of what it is along them.

    Parameters
    ----------
    lines : sequence of Centerline
    soft : numpy.ndarray, shape (H, W), uint8
        The probability, of 256.
    """
    return [line._narrowed(min(soft_width(line.points, soft, line.width_px) / line.width_px, 1.0)) for line in lines]


def goes_on(value: int) -> float:
    """Return the probability that a cable goes on ahead of an end, where the mask's probability is as much of 256."""
    base, per_log = GOES_ON
    return 1.0 / (1.0 + math.exp(-(base + per_log * math.log((value + 1) / 256.0))))


def _near_joints(line: Centerline, ahead: Mapping[float, int]) -> tuple[NearJoint, ...]:
    """Return the most probable place where each end goes on: across a gap, or where values lie ahead of ends."""
    surest = {near.u: near for near in line.near_joints}
    points, reach = line.points, AHEAD_WIDTHS[-1] * line.width_px
    for u, value in ahead.items():
        confidence = goes_on(value)
        if u not in surest or confidence > surest[u].confidence:
            tip, other = (-1, -1 - math.ceil(reach)) if u == 1.0 else (0, math.ceil(reach))
            other = min(max(other, -len(points)), len(points) - 1)
            way = points[tip] - points[other]
            x, y = (points[tip] + way / np.hypot(*way) * reach).tolist()
            surest[u] = NearJoint(u, (x, y), confidence)
    return tuple(surest[u] for u in sorted(surest))
