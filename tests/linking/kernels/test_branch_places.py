"""Where a branch leaves a trunk, on drawn masks."""

from __future__ import annotations

import math
from itertools import accumulate, product

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from scipy.interpolate import CubicHermiteSpline

from dloftbs.kernels.tracing import measure_radius
from dloftbs.linking.kernels.branch_places import branch_place

SIZE = 320
JOINT = np.array([160.0, 160.0])
WIDTH = 12

Floats = npt.NDArray[np.float64]


def ray(angle: float, bend_px: float = math.inf, length: int = 110) -> Floats:
    """Return an axis (n, 2) from the joint on, that begins in a direction, rad, and bends by a radius."""
    along = np.arange(float(length))
    headings = angle + along / bend_px
    return JOINT + np.cumsum(np.column_stack((np.cos(headings), np.sin(headings))), axis=0)


def three(trunk: float, angle: float, bends_px: tuple[float, float, float]) -> list[Floats]:
    """Return the axes of both sides of a trunk, and of a branch at an angle, rad, that begin at the true joint."""
    return [ray(trunk, bends_px[0]), ray(trunk + math.pi, bends_px[1]), ray(trunk + angle, bends_px[2])]


def split(axes: list[Floats]) -> list[Floats]:
    """Return the axes as a skeleton has them, which splits where the branch is a width away from the nearer side."""
    near, far, branch = axes if (axes[0][9] - JOINT) @ (axes[2][9] - JOINT) >= 0.0 else [axes[1], axes[0], axes[2]]
    at = int(np.argmax(np.hypot(*(branch - near).T) >= WIDTH))
    return [near[at:], np.concatenate((near[at::-1], far)), branch[at:]]


def draw(axes: list[Floats], widths: list[int]) -> npt.NDArray[np.uint8]:
    mask = np.zeros((SIZE, SIZE), np.uint8)
    for axis, width in zip(axes, widths, strict=True):
        cv2.polylines(mask, [np.rint(16.0 * axis).astype(np.int32)], False, (1,), width, cv2.LINE_8, 4)
    return mask


def place(mask: npt.NDArray[np.uint8], axes: list[Floats]) -> tuple[bool, float, float]:
    """Run the kernel."""
    points, offsets = np.concatenate(axes), np.array([0, *accumulate(map(len, axes))])
    return branch_place(mask, points, measure_radius(mask, points, offsets), offsets, float(WIDTH))


def place_on(line: Floats, at: float) -> Floats:
    return np.array([np.interp(at, np.arange(len(line)), column) for column in line.T])


def bend_of(line: Floats) -> float:
    ways = np.diff(line, axis=0)
    lengths = np.hypot(*ways.T)
    cosines = (ways[1:] * ways[:-1]).sum(axis=1) / (lengths[1:] * lengths[:-1])
    return float(WIDTH * (4.0 * (1.0 - cosines) / (lengths[1:] + lengths[:-1])).sum())


def slowly(mask: npt.NDArray[np.uint8], axes: list[Floats]) -> Floats:
    """The same by arrays."""
    points, offsets = np.concatenate(axes), [0, *accumulate(map(len, axes))]
    widths = measure_radius(mask, points, np.array(offsets))
    rays, radii = [], []
    for axis, low, high in zip(axes, offsets, offsets[1:], strict=False):
        own = widths[low:high]
        radius = float(np.median(own[len(own) // 2 :]))
        gone = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(axis, axis=0).T))))
        wide = np.maximum.accumulate(np.where((own > radius + 1.0) & (np.arange(len(own)) > 0), gone, 0.0))
        at = int(np.argmax(gone - wide >= WIDTH))
        reach = int(radius)
        way = axis[max(at - reach, 0)] - axis[at + reach]
        rays.append((axis[at], way / np.hypot(*way)))
        radii.append(radius)

    def cubic(start: Floats, way: Floats, end: tuple[Floats, Floats], count: int) -> Floats:
        length = np.hypot(*(end[0] - start))
        return CubicHermiteSpline([0, 1], [start, end[0]], [length * way, -length * end[1]])(np.linspace(0, 1, count))

    def away(line: Floats) -> Floats:
        ways = np.diff(line, axis=0)
        off = outline[:, None] - line[:-1]
        share = np.clip((off * ways).sum(axis=2) / ((ways**2).sum(axis=1) + 1e-9), 0.0, 1.0)
        return np.hypot(*(off - share[..., None] * ways).transpose(2, 0, 1)).min(axis=1)

    corners = np.array([at for at, _ in rays])
    margin = 2.0 * WIDTH
    left, top = np.maximum((corners.min(axis=0) - margin).astype(int), 0)
    right, bottom = np.minimum((corners.max(axis=0) + margin).astype(int), SIZE - 2)
    found = []
    for row in range(top, bottom):
        for column in range(left, right):
            found += [(column + 0.5, row)] * int(mask[row, column] != mask[row, column + 1])
            found += [(column, row + 0.5)] * int(mask[row, column] != mask[row + 1, column])
    outline = np.array(found, dtype=float)[1::2]
    for (at, way), radius in zip(rays, radii, strict=True):
        off = outline - at
        outline = outline[(off @ way >= 0.0) | (abs(off @ (way[1], -way[0])) >= 2.0 * radius)]

    def costs_of(trunk: Floats, first: int, guesses: list[tuple[float, float, float]]) -> list[float]:
        from_trunk = away(trunk) - max(radii[(first + 1) % 3], radii[(first + 2) % 3])
        costs = []
        for at, turn, pull in guesses:
            start = place_on(trunk, at)
            angle = math.atan2(*(rays[first][0] - start)[::-1]) + turn
            line = cubic(start, pull * np.array([math.cos(angle), math.sin(angle)]), rays[first], 13)
            off = np.minimum(from_trunk, away(line) - radii[first]) / WIDTH
            costs.append(float(np.minimum(off**2, 0.01).sum() * 2.0 / WIDTH * (1.0 + 0.1 * bend_of(line))))
        return costs

    found = []
    for first in range(3):
        trunk = cubic(*rays[(first + 1) % 3], rays[(first + 2) % 3], 13)
        count = max(int(2.0 * np.hypot(*np.diff(trunk, axis=0).T).sum() / WIDTH), 2)
        guesses = list(product(np.arange(1, count) * 12.0 / count, np.arange(-2, 3) * 0.5, (0.5, 1.0, 2.0, 3.0)))
        costs = costs_of(trunk, first, guesses)
        found.append((min(costs), first, 12.0 / count, guesses[int(np.argmin(costs))], trunk))
    _, first, step, guess, trunk = min(found, key=lambda one: one[0])
    turning = 0.5
    for _ in range(3):
        step, turning = 0.5 * step, 0.5 * turning
        at, turn, pull = guess
        near = product(at + step * np.arange(-1, 2), turn + turning * np.arange(-1, 2), (pull,))
        guesses = [guess, *(one for one in near if 0.0 <= one[0] <= 12.0)]
        guess = guesses[int(np.argmin(costs_of(trunk, first, guesses)))]
    return place_on(trunk, guess[0])


BRANCHES = [(0.6, 90.0), (0.6, math.inf), (0.9, -80.0), (1.3, 60.0), (1.57, math.inf), (2.2, 120.0)]
"""Directions in which a branch leaves, rad, and the radius by which it bends, px."""


@pytest.mark.parametrize(("angle", "bend_px"), BRANCHES)
@pytest.mark.parametrize("thick", [WIDTH, 16])
def test_a_branch_is_found_where_it_leaves_however_it_bends(angle, bend_px, thick):
    axes = three(0.1, angle, (400.0, -400.0, bend_px))
    shown, x, y = place(draw(axes, [thick, thick, WIDTH]), split(axes))
    assert shown
    assert np.hypot(*((x, y) - JOINT)) < 0.45 * WIDTH


@pytest.mark.parametrize(("angle", "bend_px"), BRANCHES)
def test_the_kernel_is_its_twin_by_arrays(angle, bend_px):
    axes = three(0.3, angle, (300.0, math.inf, bend_px))
    mask = draw(axes, [WIDTH] * 3)
    assert np.allclose(place(mask, split(axes))[1:], slowly(mask, split(axes)), atol=1e-6)


def test_the_order_of_the_branches_does_not_matter():
    axes = three(0.0, 0.8, (math.inf, math.inf, 70.0))
    mask, axes = draw(axes, [WIDTH] * 3), split(axes)
    first = place(mask, axes)
    assert np.allclose(place(mask, axes[1:] + axes[:1]), first)
    assert np.allclose(place(mask, axes[2:] + axes[:2]), first)


def test_a_ragged_edge_moves_it_little():
    axes = three(0.0, 0.9, (math.inf, math.inf, 200.0))
    mask, axes = draw(axes, [WIDTH] * 3), split(axes)
    rng, found = np.random.default_rng(3), []
    for _ in range(10):
        edge = cv2.dilate(mask, np.ones((3, 3), np.uint8)) != cv2.erode(mask, np.ones((3, 3), np.uint8))
        shown, x, y = place(np.where(edge & (rng.random(mask.shape) < 0.2), 1 - mask, mask), axes)
        found += [np.hypot(*((x, y) - JOINT))] * shown
    assert len(found) >= 8
    assert max(found) < 0.8 * WIDTH


@pytest.mark.parametrize("half_axes", [(22, 15), (30, 15), (18, 18), (25, 13), (40, 14)])
def test_tape_shows_no_joint(half_axes):
    axes = three(0.0, 1.0, (math.inf,) * 3)
    mask = draw(axes, [WIDTH] * 3)
    cv2.ellipse(mask, (160, 160), half_axes, 0, 0, 360, 1, -1)
    assert place(mask, axes) == (False, 0.0, 0.0)


@pytest.mark.parametrize("seed", range(20))
def test_axes_anywhere_in_any_mask_have_a_place_near_them(seed):
    rng = np.random.default_rng(seed)
    mask = (rng.random((40, 60)) < rng.uniform(0.2, 1.0)).astype(np.uint8)
    mask[[0, -1]] = mask[:, [0, -1]] = 0
    axes = [np.clip(start + np.cumsum(rng.normal(size=(n, 2)), axis=0), 1.0, (58.0, 38.0))
            for start, n in zip(rng.uniform(2.0, 38.0, (3, 2)), rng.integers(2, 40, 3), strict=True)]  # fmt: skip
    shown, x, y = place(mask, axes)
    assert not shown or (-60.0 < x < 120.0 and -60.0 < y < 100.0)
