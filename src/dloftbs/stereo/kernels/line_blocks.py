"""Centre lines in blocks: means of some points each, with direction and noise."""

from __future__ import annotations

import math

import numpy as np
from numba import float64, int64, uint8

from dloftbs.kernels.compiler import Bytes, Floats, Ints, helper, kernel, read, write
from dloftbs.stereo.kernels.observations import CLEAR, COLUMNS, RADIUS, WEIGHT

_NOISE_PX3 = 0.026
"""Noise of a centre line: variance of the mean of a stretch, px squared, times the stretch's length, px.

Source: measured by `benchmarks.stereo` on masks of recorded motion: 0.025 px over 48 px.
"""

_GRID_NOISE_PX3 = 0.0048
"""The same of the pixel grid, over the slope of the line against the nearer axis: steps come the rarer, px cubed.

Source: measured as before: 0.1 px over 48 px at a slope of 0.015.
"""

_BEND_NOISE_PX3 = 400.0
"""The same of a bend, over the fourth power of its radius times its curvature, px cubed.

Source: measured as before: 0.35 px at 0.3.
"""

_MOST_RADII = 1.5
"""Distance from a line beside it at which a mask is that of something else, too, radii.

Source: by hand; half-way from its own border to the axis of an equal cable that touches it.
"""

_BORDER_PX = 1.5
"""The same in addition, px.

Source: geometry; borders are right to a pixel, and a diagonal step is longer.
"""

_APART = 3.0
"""Distance along a line, in sums of both radii, from which on another stretch of it is another pass.

Source: geometry; a hairpin whose sides touch has half of that.
"""


@kernel(read(float64, 2), read(float64, 1), read(float64, 1), int64, float64)
def block_means(points: Floats, u: Floats, radius: Floats, block: int, farthest: float) -> Floats:
    """Return the means of some points each along a line, without those that a gap interrupts.

    Parameters
    ----------
    points : (n, 2) float64
        In order, px.
    u : (n,) float64
        Their share of the line's length.
    radius : (n,) float64
        Half the width of the mask, px.
    block : int
        Number of points a mean.
    farthest : float
        Distance from point to point beyond which there is a gap, px.

    Returns
    -------
    (m, 7) float64
        Point x and y, `u`, length along the line, the chord x and y in the direction of the line, and the radius.
    """
    n = len(points)
    blocks = np.empty((n // (block // 2 + 1) + 1, 7))  # a gap may end a block a little beyond half
    count, k = 0, 0
    while k + 1 < n:
        x, y, at, half = points[k, 0], points[k, 1], u[k], radius[k]
        length, size, first = 0.0, 1, k
        while size < block and k + 1 < n:
            step = math.hypot(points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1])
            if step > farthest:
                break
            k += 1
            length += step
            size += 1
            x, y, at, half = x + points[k, 0], y + points[k, 1], at + u[k], half + radius[k]
        if size > block // 2 and length > 0.0:
            row = blocks[count]
            row[0], row[1], row[2], row[3] = x / size, y / size, at / size, length * size / (size - 1)
            row[4], row[5], row[6] = points[k, 0] - points[first, 0], points[k, 1] - points[first, 1], half / size
            count += 1
        k += 1
    found = blocks[:count].copy()
    for i in range(1, count - 1):
        # Over three blocks where they follow each other, so that the noise of the points turns the chord less.
        most = 2.0 * blocks[i, 3]
        before = math.hypot(blocks[i, 0] - blocks[i - 1, 0], blocks[i, 1] - blocks[i - 1, 1])
        after = math.hypot(blocks[i + 1, 0] - blocks[i, 0], blocks[i + 1, 1] - blocks[i, 1])
        if before < most and after < most:
            found[i, 4], found[i, 5] = blocks[i + 1, 0] - blocks[i - 1, 0], blocks[i + 1, 1] - blocks[i - 1, 1]
    return found


@helper
def _is_set(mask: Bytes, x: float, y: float) -> bool:
    """Return whether the pixel at a place is set; nothing is outside of the image."""
    column, row = math.floor(x + 0.5), math.floor(y + 0.5)
    return 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and mask[row, column] != 0


@kernel(read(float64, 2, "C"), read(int64, 1, "C"), read(uint8, 2), write(float64, 1, "C"))
def block_noise(blocks: Floats, starts: Ints, mask: Bytes, noise: Floats) -> None:
    """Find the noise of blocks: the variance of the mean of a stretch times its length.

    Tight bends have more, since a mask's middle is not the cable's axis there, and so has what runs along the pixels.
    Where the mask is wider than the line, it is that of several passes, and its middle is that of none of them.

    Parameters
    ----------
    blocks : (m, 7) float64
        Of all lines of a view, as `block_means` returns them.
    starts : (k + 1,) int64
        Where each line begins, and the end.
    mask : (H, W) uint8
        Of the view.
    noise : (m,) float64
        Written: px cubed; -1 where masks merge.
    """
    along = np.zeros(len(blocks))
    for line in range(len(starts) - 1):
        for i in range(starts[line] + 1, starts[line + 1]):
            dx, dy = blocks[i, 0] - blocks[i - 1, 0], blocks[i, 1] - blocks[i - 1, 1]
            along[i] = along[i - 1] + math.hypot(dx, dy)
    for line in range(len(starts) - 1):
        first, end = starts[line], starts[line + 1]
        for i in range(first, end):
            low, high = max(i - 1, first), min(i + 1, end - 1)
            ax, ay, bx, by = blocks[low, 4], blocks[low, 5], blocks[high, 4], blocks[high, 5]
            turn = abs(math.atan2(ax * by - ay * bx, ax * bx + ay * by))
            noise[i] = blocks[i, 6] * turn / max(along[high] - along[low], 1e-9) if high > low else 0.0
        # What a bend does to a mask's middle dies away over a width.
        for i in range(first + 1, end):
            fading = math.exp((along[i - 1] - along[i]) / (2.0 * blocks[i, 6]))
            noise[i] = max(noise[i], noise[i - 1] * fading)
        for i in range(end - 2, first - 1, -1):
            fading = math.exp((along[i] - along[i + 1]) / (2.0 * blocks[i, 6]))
            noise[i] = max(noise[i], noise[i + 1] * fading)
        for i in range(first, end):
            bend, dx, dy = noise[i], abs(blocks[i, 4]), abs(blocks[i, 5])
            # A bend of curvature c leaves the axis by a pixel after sqrt(2 / c), at half that slope on average.
            slope = math.hypot(min(dx, dy) / max(dx, dy), math.sqrt(0.5 * bend / blocks[i, 6]))
            noise[i] = _NOISE_PX3 + _GRID_NOISE_PX3 / max(slope, _GRID_NOISE_PX3) + _BEND_NOISE_PX3 * bend**4
    for i in range(len(blocks)):
        size = math.hypot(blocks[i, 4], blocks[i, 5])
        reach = (_MOST_RADII * blocks[i, 6] + _BORDER_PX) / size
        dx, dy = -reach * blocks[i, 5], reach * blocks[i, 4]
        x, y = blocks[i, 0], blocks[i, 1]
        if _is_set(mask, x + dx, y + dy) or _is_set(mask, x - dx, y - dy):
            noise[i] = -1.0
    for line in range(len(starts) - 1):
        for i in range(starts[line], starts[line + 1]):
            x, y, radius = blocks[i, 0], blocks[i, 1], blocks[i, 6]
            for j in range(i + 1, len(blocks)):
                reach = radius + blocks[j, 6]
                dx, dy = blocks[j, 0] - x, blocks[j, 1] - y
                if abs(dx) >= reach or abs(dy) >= reach or dx * dx + dy * dy >= reach * reach:
                    continue
                if j >= starts[line + 1] or along[j] - along[i] > _APART * reach:
                    noise[i] = noise[j] = -1.0
    # Beside such places the middle of a mask leaves the axis already.
    merged = noise < 0.0
    for line in range(len(starts) - 1):
        first, end = starts[line], starts[line + 1]
        for i in range(first, end):
            if not merged[i]:
                continue
            k = i - 1
            while k >= first and along[i] - along[k] < 2.0 * blocks[i, 6]:
                noise[k] = -1.0
                k -= 1
            k = i + 1
            while k < end and along[k] - along[i] < 2.0 * blocks[i, 6]:
                noise[k] = -1.0
                k += 1


@kernel(read(float64, 2, "C"), read(float64, 1, "C"), float64, float64, float64, float64)
def observe(blocks: Floats, noise: Floats, fx: float, fy: float, cx: float, cy: float) -> Floats:
    """Return the observations that blocks are, as `dloftbs.stereo.kernels.observations` has them, (m, 9).

    Parameters
    ----------
    blocks : (m, 7) float64
        Without the lens, px.
    noise : (m,) float64
        Of the same; see `block_noise`.
    fx, fy, cx, cy : float
        Of the camera, px.
    """
    focal_px = math.sqrt(fx * fy)
    rows = np.zeros((len(blocks), COLUMNS))
    for i in range(len(blocks)):
        row, block = rows[i], blocks[i]
        row[0], row[1] = (block[0] - cx) / fx, (block[1] - cy) / fy
        dx, dy = block[4] / fx, block[5] / fy
        size = math.hypot(dx, dy)
        row[2], row[3] = -dy / size, dx / size
        row[RADIUS] = block[6] / focal_px
        if noise[i] > 0.0:
            row[CLEAR], row[WEIGHT] = 1.0, block[3] * focal_px * focal_px / noise[i]
        else:
            row[WEIGHT] = 0.25 / (row[RADIUS] * row[RADIUS])
    return rows
