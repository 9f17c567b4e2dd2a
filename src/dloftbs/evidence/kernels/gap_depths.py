"""Depth before and between the ends of cables: one cable or two, ground in sight, or something nearer that hides."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import boolean, float32, float64, int64, uint8, uint16

from dloftbs.evidence.kernels.colours import BLOCK_WIDTHS, CLEAR_PX, CLEAR_WIDTHS, is_on_mask
from dloftbs.evidence.kernels.end_references import BACK_WIDTHS, place_before
from dloftbs.kernels.compiler import Bools, Bytes, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.gaussian import MEDIAN_DEVIATION
from dloftbs.kernels.shared.graph_ends import branch_of
from dloftbs.kernels.shared.selection import nth_least

EDGE_PX = 4.0
"""Distance from the mask within which a depth camera may still show the cable, px.

Source: geometry; depth cameras displace edges by 2 to 4 px.
"""

DEPTH_NOISE_PER_M = 0.012
"""Three standard deviations of a depth camera, metres at a distance of one, growing with its square.

Source: geometry; one is 4e-3 z^2.
"""

_BESIDE_WIDTHS = 1.0
"""Distance from the axis to the samples of the ground beside a cable, widths.

Source: geometry; half a width beyond the edge.
"""

_MIN_DEPTHS = 5
"""Least number of pixels of a place with depth, of nine.

Source: by definition; the majority.
"""

_MIN_STANDING = 2.0
"""Least height of a cable over the ground beside it for its depth to count in swerves, standard deviations of a place.

Source: by definition; half the height is then more than noise.
"""

_SAG = 0.05
"""Sag of a hidden cable, in depth, as a share of the gap's length: the scale of a Cauchy density.

Source: measured; of cables in hands, moved by people, and drawn, shares from .03 to .1 separate hidden gaps from ground
equally well.
"""

_SWERVE = 0.15
"""Swerve of a cable towards the camera or away from it, rad: the scale of a Cauchy density.

Source: measured; scales from .05 to .2 make true readings with depth equally probable, and at .15 the fitted weight of
the density's logarithm is 1.
"""

_SAMPLES = 7
"""Number of places before an end, a width apart.

Source: derived; as many as lie up to `REACH_WIDTHS`.
"""


_Depths = npt.NDArray[np.float32] | npt.NDArray[np.uint16]


def _exchanges() -> Ints:
    """Return pairs of nine places whose values change places if they are not in order: the middle one is then in place.

    They are those of J. L. Smith, Implementing median filters in XC4000E FPGAs, 1996.
    """
    columns = [(1, 2), (4, 5), (7, 8), (0, 1), (3, 4), (6, 7), (1, 2), (4, 5), (7, 8)]
    across = [(0, 3), (5, 8), (4, 7), (3, 6), (1, 4), (2, 5), (4, 7), (2, 4), (4, 6), (2, 4)]
    return np.array(columns + across, dtype=np.int64)


_EXCHANGES = _exchanges()


@helper
def _median(values: Floats) -> float:
    """Return the lower median of a few values, NaN if there are none; their order changes."""
    return nth_least(values, (len(values) - 1) // 2) if len(values) > 0 else np.nan


@helper
def pixel(x: float, most: int) -> int:
    """Return the row or column nearest to a coordinate; beyond the border that of the border counts."""
    return min(max(int(np.rint(x)), 0), most - 1)


@helper
def _gather(depth: _Depths, x: float, y: float, reach: float, counts: npt.NDArray[np.float32]) -> None:
    """Write the depths of nine pixels around a place.

    All places are read before any is judged: what is read of a new frame comes from far away, and many pixels at once
    take as long as one if nothing waits for the first.
    """
    most = depth.shape[1]
    left, middle, right = pixel(x - reach, most), pixel(x, most), pixel(x + reach, most)
    for k in range(3):
        row = pixel(y + reach * (k - 1), depth.shape[0])
        counts[3 * k], counts[3 * k + 1], counts[3 * k + 2] = depth[row, left], depth[row, middle], depth[row, right]


@helper
def _metres_of(counts: npt.NDArray[np.float32], unit: float, low: float, high: float, found: Floats) -> float:
    """Return the lower median of nine depths, m; NaN where too few are known. There is room for nine in `found`."""
    count = 0
    for k in range(9):
        metres = counts[k] * unit
        if low <= metres <= high and metres < np.inf:
            found[count] = metres
            count += 1
    if count < 9:
        return _median(found[:count]) if count >= _MIN_DEPTHS else np.nan
    for k in range(len(_EXCHANGES)):
        i, j = _EXCHANGES[k, 0], _EXCHANGES[k, 1]
        a, b = found[i], found[j]
        found[i] = a if a < b else b
        found[j] = b if a < b else a
    return found[4]


@helper
def _is_clear(mask: Bytes, x: float, y: float) -> bool:
    """Return True if the mask is not near a place: depth there may be the ground's."""
    most = mask.shape[1]
    left, middle, right = pixel(x - EDGE_PX, most), pixel(x, most), pixel(x + EDGE_PX, most)
    for k in range(-1, 2):
        row = pixel(y + EDGE_PX * k, mask.shape[0])
        if mask[row, left] != 0 or mask[row, middle] != 0 or mask[row, right] != 0:
            return False
    return True


@helper
def _lay_line(depths: Floats, at: Floats, slopes: Floats, known: Floats) -> None:
    """Write what the line of Theil and Sen through depths before an end shows: all columns but the ground's.

    There is room for the slopes of all pairs.
    """
    count, found = 0, len(depths)
    for i in range(found):
        for j in range(i + 1, found):
            slopes[count] = (depths[j] - depths[i]) / (at[j] - at[i])
            count += 1
    slope = _median(slopes[:count]) if count > 0 else 0.0
    middle = np.mean(at)
    known[0] = _median(depths - slope * at)
    known[2] = -slope if found > 1 else np.nan
    known[3] = 1.0 / np.sqrt(found)
    known[4] = _median(np.abs(depths - slope * at - known[0])) / MEDIAN_DEVIATION
    known[5] = middle
    known[6] = 1.0 / np.sqrt(np.sum((at - middle) ** 2)) if found > 1 else np.nan


@kernel(
    (read(float32, 2), read(uint16, 2)), float64, float64, float64, read(uint8, 2), read(float64, 2), read(int64, 2),
    read(boolean, 1), float64,
)  # fmt: skip
def sample_depths(
    depth: _Depths,
    unit: float,
    low: float,
    high: float,
    mask: Bytes,
    points: Floats,
    spans: Ints,
    free: Bools,
    width: float,
) -> Floats:
    """Measure the depth of cables at their ends, by the line of Theil and Sen through what lies before.

    Where there is one place only, the line is level, and its slope is not known.

    Parameters
    ----------
    depth : (h, w) float32 or uint16
        Counts, around the mask.
    unit : float
        Metres per count.
    low, high : float
        Depths outside of these, m, are missing, and so are those that are not finite.
    mask : (h, w) uint8
    points : (m, 2) float64
        ``(x, y)`` in the mask.
    spans : (n, 2) int64
        The points of each run.
    free : (2 n,) bool
        True for ends that may lie at the edge of what hides the rest: the last widths may have its depth.
    width : float
        px.

    Returns
    -------
    (2 n, 7) float64
        The depth at each end, m, and how much farther the ground beside the cable is, m; how fast the depth grows
        beyond the end, m per px; the standard deviation of the line's depth in its middle, times that of a place's
        depth; by how much the places' depths scatter about the line, as a standard deviation, m; how far its middle
        lies before the end, px; and the standard deviation of its slope, times that of a place's depth, per px. NaN
        where they are not known.
    """
    known = np.full((len(free), 7), np.nan)
    reach, aside = max(BLOCK_WIDTHS * width, 1.0), _BESIDE_WIDTHS * width + EDGE_PX
    depths, at, heights = np.empty(_SAMPLES), np.empty(_SAMPLES), np.empty(2 * _SAMPLES)
    slopes = np.empty(_SAMPLES * (_SAMPLES - 1) // 2)
    places, counts = np.empty((_SAMPLES, 5)), np.empty((_SAMPLES, 3, 9), dtype=np.float32)
    nine = np.empty(9)
    for e in range(len(free)):
        start, stop = spans[branch_of(e)]
        # A branch too short for that is asked in its middle.
        clear = BACK_WIDTHS * width if free[e] else min(EDGE_PX, max(0.5 * (stop - start - 2), 0.0))
        laid = 0
        for k in range(_SAMPLES):
            i, x, y, dx, dy = place_before(points, spans, e, clear, k, width)
            if i < 0:
                break
            places[k, 0], places[k, 1], places[k, 2] = i, x, y
            places[k, 3], places[k, 4] = aside * dx, aside * dy
            _gather(depth, x, y, reach, counts[k, 0])
            _gather(depth, x + places[k, 4], y - places[k, 3], reach, counts[k, 1])
            _gather(depth, x - places[k, 4], y + places[k, 3], reach, counts[k, 2])
            laid += 1
        found, grounds = 0, 0
        for k in range(laid):
            metres = _metres_of(counts[k, 0], unit, low, high, nine)
            if np.isnan(metres):
                continue
            i, x, y, dx, dy = places[k]
            depths[found], at[found] = metres, i
            found += 1
            if dx == 0.0 and dy == 0.0:
                continue
            for side in range(1, 3):
                sign = 2 * side - 3
                if _is_clear(mask, x - sign * dy, y + sign * dx):
                    ground = _metres_of(counts[k, side], unit, low, high, nine)
                    if not np.isnan(ground):
                        heights[grounds] = ground - metres
                        grounds += 1
        if found > 0:
            _lay_line(depths[:found], at[:found], slopes, known[e])
        known[e, 1] = _median(heights[:grounds])
    return known


@helper
def _depth_beside(
    mask: Bytes,
    counts: npt.NDArray[np.float32],
    place: Floats,
    aside: float,
    unit: float,
    low: float,
    high: float,
    nine: Floats,
) -> float:
    """Return the mean depth on those sides of a place that are clear of the mask, m; NaN where none is known."""
    x, y, dx, dy = place
    total, sides = 0.0, 0
    for side in range(1, 3):
        sign = 2 * side - 3
        if _is_clear(mask, x + sign * aside * dy, y - sign * aside * dx):
            metres = _metres_of(counts[side], unit, low, high, nine)
            if not np.isnan(metres):
                total, sides = total + metres, sides + 1
    return total / sides if sides > 0 else np.nan


@helper
def _unlike(away: float, scale: float) -> float:
    """Return minus the logarithm of a Cauchy density over its peak."""
    return math.log1p((away / scale) ** 2)


@kernel(
    (read(float32, 2), read(uint16, 2)), float64, float64, float64, read(uint8, 2), read(float64, 2), read(int64, 2),
    read(float64, 3), read(int64, 1), read(float64, 1), float64, float64, read(uint8, 2),
)  # fmt: skip
def describe_depths(
    depth: _Depths,
    unit: float,
    low: float,
    high: float,
    mask: Bytes,
    known: Floats,
    pairs: Ints,
    ways: Floats,
    steps: Ints,
    lengths: Floats,
    focal: float,
    width: float,
    covered: Bytes,
) -> Floats:
    """Describe how much more the depth along the ways between ends is that of the ground than that of a cable.

    Each place is compared with the depths of the cables and of the ground beside their ends, and with what lies beside
    it, from which a cable stands out. The latter counts where it is farther away than the cable: something nearer may
    lie over both. Densities have wide tails, since depth mixes surfaces at edges, and is far from both. A way is a
    guess, so that a few places of a hidden one may show the ground, too.

    Parameters
    ----------
    depth, unit, low, high, mask
        As `sample_depths` takes them.
    known : (2 n, 7) float64
        As it returns them.
    pairs : (k, 2) int64
        Of ends.
    ways, steps
        As `lay_ways` makes them.
    lengths : (k,) float64
        Of the ways, px.
    focal : float
        px; infinite where it is not known.
    width : float
        px.
    covered : (k, s) uint8
        Where it is not 0, a place is not looked at.

    Returns
    -------
    (k, 2) float64
        By how much the ground is more probable than a cable, 0 where it is not, on the average of the way's places
        beside the mask. And the greatest mean of two logarithms in a row of how many times more probable it is, times
        the share of places whose depth is known. Both are 0 where nothing is known.
    """
    reach, aside = max(BLOCK_WIDTHS * width, 1.0), _BESIDE_WIDTHS * width + EDGE_PX
    clear = CLEAR_WIDTHS * width + CLEAR_PX
    counts, nine = np.empty((ways.shape[1], 3, 9), dtype=np.float32), np.empty(9)
    columns, looked_at = np.zeros((len(pairs), 2)), np.empty(ways.shape[1], dtype=np.bool_)
    for p in range(len(pairs)):
        one, other = known[pairs[p, 0]], known[pairs[p, 1]]
        start = other[0] if np.isnan(one[0]) else one[0]  # a short branch may have no depth
        stop = one[0] if np.isnan(other[0]) else other[0]
        if np.isnan(start):
            continue
        height = 0.5 * ((other[1] if np.isnan(one[1]) else one[1]) + (one[1] if np.isnan(other[1]) else other[1]))
        stands = not np.isnan(height)
        height = max(height, 0.0) if stands else 0.0
        places, looked, grounds, last, most = 0, 0, 0.0, np.nan, -np.inf
        for k in range(1, steps[p]):
            x, y, dx, dy = ways[p, k]
            is_beside = not is_on_mask(mask, x, y, clear)
            places += is_beside
            looked_at[k] = is_beside and covered[p, k] == 0
            if looked_at[k]:
                _gather(depth, x, y, reach, counts[k, 0])
                if stands:
                    _gather(depth, x - aside * dy, y + aside * dx, reach, counts[k, 1])
                    _gather(depth, x + aside * dy, y - aside * dx, reach, counts[k, 2])
        for k in range(1, steps[p]):
            found = _metres_of(counts[k, 0], unit, low, high, nine) if looked_at[k] else np.nan
            if np.isnan(found):
                continue
            looked += 1
            expected = max(start + (stop - start) * k / steps[p], low)  # a steep line leads behind the camera
            deviation = DEPTH_NOISE_PER_M * expected * expected / 3.0
            behind = found - expected
            with_sag = math.hypot(deviation, _SAG * lengths[p] * expected / focal)
            ratio = _unlike(max(behind, 0.0), with_sag) - _unlike(min(behind - height, 0.0), with_sag)
            if stands:
                beside = _depth_beside(mask, counts[k], ways[p, k], aside, unit, low, high, nine)
                if beside > expected:
                    stood = beside - found
                    ratio += _unlike(min(stood - height, 0.0), deviation) - _unlike(max(stood, 0.0), deviation)
            grounds += max(math.tanh(0.5 * ratio), 0.0)  # twice a probability, less 1
            if looked > 1:
                most = max(most, 0.5 * (last + ratio))
            last = ratio
        if looked > 0:
            columns[p, 0] = grounds / places
            columns[p, 1] = (most if looked > 1 else last) * looked / places
    return columns


@helper
def _may_be_ground(known: Floats, deviation: float, radius: float) -> bool:
    """Return True if what an end shows does not stand out from the ground beside it: a cable does by its width."""
    return known[1] < max(_MIN_STANDING * deviation, radius)


@helper
def _spread(known: Floats, beyond: float) -> float:
    """Return the standard deviation of a line at a place beyond its end, times that of a place's depth."""
    return math.hypot(known[3], (known[5] + beyond) * known[6])


@kernel(read(float64, 2), read(int64, 2), read(float64, 1), float64, float64)
def measure_swerves(known: Floats, pairs: Ints, lengths: Floats, focal: float, width: float) -> Floats:
    """Measure how unlikely a cable is from one end to another, by its swerve towards the camera or away from it.

    Parameters
    ----------
    known : (2 n, 7) float64
        As `sample_depths` returns them.
    pairs : (k, 2) int64
        Of ends.
    lengths : (k,) float64
        Of the ways between them, px.
    focal : float
        px.
    width : float
        px; a shorter way counts as so long.

    Returns
    -------
    (k,) float64
        Minus the logarithm of a density over its peak, nats, of the angle between the way and the mean of the
        directions at both ends, less what noise explains; 0 where depth shows no direction, scatters before an end by
        more than noise, or may be the ground's.
    """
    swerves = np.zeros(len(pairs))
    for p in range(len(pairs)):
        one, other = known[pairs[p, 0]], known[pairs[p, 1]]
        mean = 0.5 * (one[0] + other[0])
        if np.isnan(one[2] + other[2]) or not min(one[0], other[0]) > 0.0:  # a steep line leads behind the camera
            continue
        deviation = DEPTH_NOISE_PER_M * mean * mean / 3.0  # a place is the median of nine pixels
        radius = 0.5 * width * mean / focal
        if _may_be_ground(one, deviation, radius) or _may_be_ground(other, deviation, radius):
            continue
        if max(one[4], other[4]) > deviation:  # it is not one cable's all along
            continue
        length = max(lengths[p], width)
        straight = 0.5 * (one[2] - other[2]) * length
        jump = other[0] - one[0] - straight
        explained = deviation * math.hypot(_spread(one, 0.5 * length), _spread(other, 0.5 * length))
        way = straight + np.sign(jump) * max(abs(jump) - explained, 0.0)
        across = length * mean / focal
        swerves[p] = _unlike(np.arctan2(way, across) - np.arctan2(straight, across), _SWERVE)
    return swerves
