"""Skeleton pixels moved to the middle between the two walls of the mask, to a fraction of a pixel.

Two smoothings of the same reach work together: the skeleton is smoothed first, which takes its staircase out and pulls
bends inwards; the way from there to the middle between the walls changes slowly, is smoothed as well, and puts bends
back. What both leave of noise is what either one leaves; what both distort is of fourth order in their reach.
"""

from __future__ import annotations

import numpy as np
from numba import float64, int64, uint8

from dloftbs.kernels.compiler import Bytes, Floats, Ints, helper, inlined, kernel, read
from dloftbs.kernels.shared.copying import copy_rows_to, copy_to
from dloftbs.kernels.shared.few import insert
from dloftbs.kernels.shared.polyline import chord_direction
from dloftbs.kernels.shared.ramp import ramp_down

_REACH = 2.5
"""Half the window of one smoothing, px, per square root of the radius in px.

Source: by hand; noise is as long as some pixels, bends are as long as some widths.
"""

_MIN_REACH_PX = 4
"""Number of points to either side that show the direction for a first radius, px.

Source: by hand.
"""

_ROUGH_SITES = 13
"""Number of places whose median is the first radius.

Source: bounds time.
"""

_WIDEST = 8
"""Share of the mask's longer side, as one over this number, beyond which no edge is sought for the first radius.

Source: by hand; along another cable the edge may be far.
"""

_THINNEST = 0.5
"""Smallest radius, px.

Source: geometry; a mask shows nothing narrower than a pixel.
"""

_CROSSED = 0.25
"""Distance that a wall may lie beyond the axis before it counts for nothing, px.

Source: geometry; half the radius of a line of one pixel, by which its axis is wrong at times.
"""

_DIAGONAL = 0.05
"""Difference of a normal's components around 45 degrees up to which rows and columns are both searched.

Source: by hand; it makes the change from one to the other continuous.
"""

_FAINT = 0.01
"""Weight of "no shift, the first radius", as a share of the weight of the places nearby.

Source: by hand; it only counts where all of them are missing.
"""

_PRECISION = 0.125
"""Error of a distance to a wall, as a share of it, above which the half pixel in which the wall is met is halved.

Source: by hand; half of what the width of a line of one pixel may be wrong by, and nothing is halved beyond two pixels.
"""

_TIE = 1e-6
"""Shift of a place that lies in the middle between two pixels, px.

Source: numerics; such a place belongs to the pixel ahead, from wherever it is looked at.
"""


@inlined
def _at(mask: Bytes, row: int, column: int) -> int:
    """Return a pixel that lies in the mask; unsigned indices spare numba's test for negative ones."""
    return mask[np.uint64(row), np.uint64(column)]


@inlined
def _march(mask: Bytes, x: float, y: float, dx: float, dy: float, most: float) -> float:
    """Return how far the mask goes from a point along a unit vector; not looked far beyond `most`."""
    ahead_x, ahead_y = x + _TIE * dx + 0.5, y + _TIE * dy + 0.5  # coordinates are not negative: cutting off rounds
    t = 0.5
    while t < most and _at(mask, int(ahead_y + t * dy), int(ahead_x + t * dx)) != 0:
        t += 0.5
    step = 0.25
    t -= step
    while step > _PRECISION * max(t, _THINNEST):
        step *= 0.5
        t += step if _at(mask, int(ahead_y + t * dy), int(ahead_x + t * dx)) != 0 else -step
    return t


@helper
def _rough_radius(mask: Bytes, points: Floats, around: int) -> float:
    """Return the median of half the mask's width across a run, at some of its points; a loop comes `around` to one."""
    n = len(points)
    reach = min(_MIN_REACH_PX, (around - 1) // 2)
    count = min(n, _ROUGH_SITES)
    most = max(mask.shape[0], mask.shape[1]) / _WIDEST
    half = count // 2 + 1
    least = np.full(half + 1, np.inf)  # the smaller half of the radii, ascending, and a place for one more
    for turn in range(count):
        # From the middle of the run outwards: half of the radii are a bound to how far is to be looked for the rest.
        k = count // 2 + (turn + 1) // 2 * (1 - turn % 2 * 2)
        i = (2 * k + 1) * n // (2 * count)
        before, after = max(i - reach, 0), min(i + reach, n - 1)
        dx, dy = chord_direction(points, before, after)
        x, y = points[i, 0], points[i, 1]
        widest = 2.0 * least[half - 1]
        left = _march(mask, x, y, -dy, dx, min(most, widest + 1.0))
        right = _march(mask, x, y, dy, -dx, min(most, widest - left + 1.0))
        insert(0.5 * (left + right), least, half)
    return 0.5 * (least[(count - 1) // 2] + least[count // 2])


@helper
def _smooth(points: Floats, reach: int) -> Floats:
    """Return the means over `reach` points to both sides, over fewer towards the ends, which stay where they are."""
    n = len(points)
    reach = min(reach, (n - 1) // 2)
    smooth = np.empty_like(points)
    sum_x, sum_y = points[0, 0], points[0, 1]
    smooth[0, 0], smooth[0, 1] = sum_x, sum_y
    for i in range(1, reach + 1):
        for k in (2 * i - 1, 2 * i):
            sum_x += points[k, 0]
            sum_y += points[k, 1]
        share = 1.0 / (2 * i + 1)
        smooth[i, 0], smooth[i, 1] = share * sum_x, share * sum_y
    share = 1.0 / (2 * reach + 1)
    for i in range(reach + 1, n - reach):
        sum_x += points[i + reach, 0]
        sum_y += points[i + reach, 1]
        sum_x -= points[i - reach - 1, 0]
        sum_y -= points[i - reach - 1, 1]
        smooth[i, 0], smooth[i, 1] = share * sum_x, share * sum_y
    for i in range(n - reach, n):
        half = n - 1 - i
        for k in (2 * i - n - 1, 2 * i - n):
            sum_x -= points[k, 0]
            sum_y -= points[k, 1]
        share = 1.0 / (2 * half + 1)
        smooth[i, 0], smooth[i, 1] = share * sum_x, share * sum_y
    return smooth


@inlined
def _last_inside(mask: Bytes, row: int, column: int, side: int, limit: int) -> int:
    """Walk along a column to the wall, outwards from foreground or inwards from background; -1 where there is none."""
    row = min(max(row, 0), len(mask) - 1)
    if _at(mask, row, column) != 0:
        while limit > 0 and _at(mask, row + side, column) != 0:
            row += side
            limit -= 1
        return row
    while limit > 0 and _at(mask, row, column) == 0:
        row -= side
        limit -= 1
        if row < 0 or row >= len(mask):
            return -1
    return row if _at(mask, row, column) != 0 else -1


@inlined
def _wall_by_columns(
    mask: Bytes, x: float, y: float, nx: float, ny: float, guess: float, spread: float
) -> tuple[float, float]:
    """Find a wall that is flatter than 45 degrees, in the columns around where it is guessed.

    In each column the edge lies half way between the last foreground and the first background pixel. The nearer
    columns count for more, and those whose edge is much farther than guessed for nothing: that is another cable's.

    Returns
    -------
    distance, weight : float
        Along the normal ``(nx, ny)``, and the share of the columns that have a wall there.
    """
    rows, columns = mask.shape
    side = 1 if ny > 0.0 else -1
    middle = x + guess * nx
    far, too_far = 1.3 * guess + 1.0, 1.5 * guess + 1.5
    total, weights, looked_at = 0.0, 0.0, 0.0
    for column in range(max(int(np.ceil(middle - spread)), 0), min(int(np.floor(middle + spread)), columns - 1) + 1):
        along = (column - x) * nx
        edge = y + (guess - along) / ny
        weight = spread - abs(column - middle)
        looked_at += weight
        row = side * int(np.floor(side * edge - 1.0 + _TIE))
        beyond = row + 3 * side
        on_axis = side * int(np.floor(side * (edge - guess / ny) + 0.5 + _TIE))
        if side * row < side * on_axis:  # a pixel inside of the wall of so thin a line is on its other side
            row = _last_inside(mask, on_axis, column, side, int(guess) + 2)
            if row < 0:
                continue
        elif 0 <= row < rows and 0 <= beyond < rows and _at(mask, row, column) > _at(mask, beyond, column):
            row += side * (np.int64(_at(mask, row + side, column)) + np.int64(_at(mask, beyond - side, column)))
        else:
            row = _last_inside(mask, row, column, side, int(guess) + 2)
            if row < 0:
                continue
        distance = along + (row + 0.5 * side - y) * ny
        if distance > far:
            weight *= ramp_down(distance, far, too_far)
        elif distance < _CROSSED:  # beyond the axis lies no wall of this side
            weight *= ramp_down(-distance, -_CROSSED, _CROSSED)
        total += weight * distance
        weights += weight
    if weights == 0.0:
        return 0.0, 0.0
    return total / weights, weights / looked_at


@inlined
def _wall(mask: Bytes, x: float, y: float, nx: float, ny: float, guess: float, spread: float) -> tuple[float, float]:
    """Return the distance of the wall along a normal, and the share of the lines looked at that have one there."""
    share = 0.5 + 0.5 * (abs(ny) - abs(nx)) / _DIAGONAL
    total, weights = 0.0, 0.0
    if share > 0.0:
        distance, weight = _wall_by_columns(mask, x, y, nx, ny, guess, spread)
        weight *= min(share, 1.0)
        total += weight * distance
        weights += weight
    if share < 1.0:
        distance, weight = _wall_by_columns(mask.T, y, x, ny, nx, guess, spread)
        weight *= min(1.0 - share, 1.0)
        total += weight * distance
        weights += weight
    if weights == 0.0:
        return 0.0, 0.0
    return total / weights, weights


@inlined
def _is_near(mask: Bytes, x: float, y: float) -> bool:
    """Return whether a point lies on the mask or on one of the eight pixels beside it."""
    row, column = int(np.floor(y + 0.5)), int(np.floor(x + 0.5))
    if 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and _at(mask, row, column) != 0:
        return True
    for r in range(max(row - 1, 0), min(row + 2, mask.shape[0])):
        for c in range(max(column - 1, 0), min(column + 2, mask.shape[1])):
            if _at(mask, r, c) != 0:
                return True
    return False


@helper
def _recentre_run(mask: Bytes, run: Floats, is_loop: bool) -> tuple[Floats, Floats]:
    """Do what `recentre` does, to one run."""
    n = len(run)
    rough = _rough_radius(mask, run, n // 3 if is_loop else 2 * n)
    reach = max(int(_REACH * np.sqrt(rough) + 0.5), 3)
    points = _smooth(_smooth(run, reach), reach)
    kernel_reach = 2.0 * reach + 1.0  # of the two means, one after the other
    # A piece so short has a middle that is clear of its ends, whose walls show where it lies.
    sites = max(1 + (n - 1) // reach, 3 if (n - 1) // 2 >= rough else 2)
    spread = 0.5 * reach + 0.5
    index = np.empty(sites, dtype=np.int64)
    normals = np.empty((sites, 2))
    shifts = np.empty(sites)
    radii = np.empty(sites)
    weights = np.empty(sites)
    for k in range(sites):
        i = k * (n - 1) // (sites - 1)
        index[k] = i
        before, after = max(i - 2 * reach, 0), min(i + 2 * reach, n - 1)
        dx, dy = chord_direction(points, before, after)
        nx, ny = -dy, dx
        left, seen_left = _wall(mask, points[i, 0], points[i, 1], nx, ny, rough, spread)
        right, seen_right = _wall(mask, points[i, 0], points[i, 1], -nx, -ny, rough, spread)
        normals[k, 0], normals[k, 1] = nx, ny
        shifts[k] = 0.5 * (left - right)
        radii[k] = 0.5 * (left + right)
        weight = seen_left * seen_right
        if max(abs(points[after, 0] - points[before, 0]), abs(points[after, 1] - points[before, 1])) < _TIE:
            weight = 0.0  # a loop so small that smoothing leaves it no direction
        weight *= ramp_down(radii[k] - rough, 0.2 * rough + 0.5, 0.4 * rough + 1.0)
        weight *= ramp_down(abs(shifts[k]), 0.8 * rough + 0.5, 1.2 * rough + 1.0)
        if not is_loop:
            weight *= min(min(i, n - 1 - i) / rough, 1.0)
        weights[k] = weight

    moved = np.empty((sites, 2))
    radius = np.empty(n)
    smooth = np.empty(sites)
    low = 0
    for k in range(sites):
        shift, total, span, nearby = 0.0, 0.0, 0.0, 0.0
        while index[k] - index[low] >= kernel_reach:
            low += 1
        j = low
        while j < sites and index[j] - index[k] < kernel_reach:
            share = kernel_reach - abs(index[j] - index[k])
            nearby += share
            share *= weights[j]
            shift += share * shifts[j]
            span += share * radii[j]
            total += share
            j += 1
        faint = _FAINT * nearby
        shift /= total + faint
        smooth[k] = max((span + faint * rough) / (total + faint), _THINNEST)
        moved[k, 0], moved[k, 1] = shift * normals[k, 0], shift * normals[k, 1]
    for k in range(1, sites):
        share = 1.0 / (index[k] - index[k - 1])
        step_x, step_y = share * (moved[k, 0] - moved[k - 1, 0]), share * (moved[k, 1] - moved[k - 1, 1])
        step_r = share * (smooth[k] - smooth[k - 1])
        for i in range(index[k - 1], index[k] + (k == sites - 1)):
            t = i - index[k - 1]
            points[i, 0] += moved[k - 1, 0] + t * step_x
            points[i, 1] += moved[k - 1, 1] + t * step_y
            radius[i] = smooth[k - 1] + t * step_r
            if not _is_near(mask, points[i, 0], points[i, 1]):
                copy_to(points[i], run[i])
    return points, radius


@kernel(read(uint8, 2), read(float64, 2), read(int64, 1))
def recentre(mask: Bytes, points: Floats, offsets: Ints) -> tuple[Floats, Floats]:
    """Move the points of runs to the middle between the two walls of the mask, and measure half its width.

    Where the walls are not those of one cable, since the mask is much wider than the run's median or its middle is
    elsewhere, the shift is that of the neighbours, or fades to nothing; so it is over the last radius at each end,
    where skeletons are distorted. A point that the shift would take off the mask, as in a blob, keeps its pixel. Not
    checked: the outermost rows and columns of the mask are 0, and the points lie inside.

    Parameters
    ----------
    mask : (H, W) uint8
        0 and 1.
    points : (n, 2) float64
        Skeleton pixels, ``(x, y)``, run after run. A run whose last point touches its first is a loop.
    offsets : (runs + 1,) int64
        Start of each run in `points`, and the end.

    Returns
    -------
    points : (n, 2) float64
    radius : (n,) float64
        Pixels.
    """
    middle = points.copy()
    radius = np.full(len(points), 0.5)
    for r in range(len(offsets) - 1):
        first, last = offsets[r], offsets[r + 1]
        n = last - first
        if n < 2:
            continue
        gap_x, gap_y = points[first, 0] - points[last - 1, 0], points[first, 1] - points[last - 1, 1]
        is_loop = n > 3 and max(abs(gap_x), abs(gap_y)) <= 1.0
        run = points[first:last]
        if is_loop:
            run = np.concatenate((run, run, run))
        pad = n if is_loop else 0
        moved, half = _recentre_run(mask, run, is_loop)
        copy_rows_to(middle[first:last], moved[pad : pad + n])
        copy_to(radius[first:last], half[pad : pad + n])
    return middle, radius
