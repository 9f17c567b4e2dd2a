"""Ropes whose knots are known, drawn as masks with shaded pictures, for `benchmarks.topology`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import ConvexHull

from dloftbs import Frame
from dloftbs.topology import Diagram

FloatArray = npt.NDArray[np.float64]

KNOTS = [f"{n}_{k}" for n, count in ((3, 1), (4, 1), (5, 2), (6, 3), (7, 7)) for k in range(1, count + 1)]
_LIGHT = np.array([-0.42, -0.58, 0.70])
_SAMPLES = 1500
_GRID = 10.0  # of spherogram's drawings, and of random ropes

Lines = tuple[npt.NDArray[np.float64], list[tuple[int, int]]]
"""Corners (n, 2) of a closed rope of straight sides on a grid; its crossings, as the sides below and above."""
_BLUE, _GROUND = np.array([196.0, 92.0, 12.0]), 150.0


@dataclass(frozen=True)
class Drawing:
    """A frame with one rope, and what it is."""

    frame: Frame
    truth: Diagram


def draw_knot(link: Any, rng: np.random.Generator, is_open: bool) -> Drawing:
    """Draw a knot of spherogram: its own drawing with straight lines, rounded, turned and sheared, or cut."""
    points, truth = _lay(_straight_lines(link), rng, is_open, 12.0, 4.0)
    return Drawing(_paint(points, 12.0, rng), truth)


def draw_random(rng: np.random.Generator, step_widths: float, *, knotted: bool) -> Drawing:
    """Draw a random open rope of 3 to 8 crossings, whose strands lie so many widths apart."""
    while True:
        lines, width_px = _random_lines(rng), float(rng.uniform(8.0, 16.0))
        if 3 <= len(lines[1]) <= 8:
            points, truth = _lay(lines, rng, True, width_px, step_widths)
            if truth.is_knotted is knotted:
                return Drawing(_paint(points, width_px, rng), truth)


def _lay(
    lines: Lines, rng: np.random.Generator, is_open: bool, width_px: float, step_widths: float
) -> tuple[FloatArray, Diagram]:
    """Return points (n, 3) of a rope along straight lines, px, and its diagram."""
    corners, order = lines
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.abs(sides).sum(axis=1)
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    heights: list[tuple[float, float]] = []
    for below, above in order:
        for side, other, height in ((below, above, -1.0), (above, below, 1.0)):
            along = 0 if sides[side, 0] else 1
            heights.append((starts[side] + abs(corners[other, along] - corners[side, along]), height))
    at, z = np.array(sorted(heights)).T
    s = (np.arange(_SAMPLES) + rng.uniform(0.1, 0.9)) * starts[-1] / _SAMPLES
    laps = np.concatenate([at[-1:] - starts[-1], at, at[:1] + starts[-1]])
    height = PchipInterpolator(laps, np.concatenate([z[-1:], z, z[:1]]))(s)
    corner = np.minimum(np.searchsorted(starts, s, side="right") - 1, len(corners) - 1)
    points = corners[corner] + (s - starts[corner])[:, None] * sides[corner] / lengths[corner, None]
    points = gaussian_filter1d(points, 0.3 * _GRID * _SAMPLES / starts[-1], axis=0, mode="wrap")
    turn = rng.uniform(0.0, 2.0 * np.pi)
    shear = np.array([[1.0, rng.uniform(-0.25, 0.25)], [0.0, rng.uniform(0.9, 1.2)]])
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    points = points @ (rotation @ shear).T * (step_widths * width_px / _GRID)
    if is_open:
        # Cut on the outside, where it is farthest from all crossings.
        outside = ConvexHull(points).vertices
        apart = np.abs((s[outside, None] - at + 0.5 * starts[-1]) % starts[-1] - 0.5 * starts[-1]).min(axis=1)
        cut = outside[np.argmax(apart)]
        gap = int(1.5 * width_px / np.linalg.norm(np.diff(points, axis=0), axis=1).mean())
        points, height = (np.roll(one, -cut - gap, axis=0)[: -2 * gap] for one in (points, height))
    points += 3.0 * width_px - points.min(axis=0)
    # As seen, the y axis of the image points down.
    truth = Diagram.from_curves([np.column_stack([points * (1.0, -1.0), height])], closed=not is_open)
    return np.column_stack([points, 0.6 * width_px * height]), truth


def _paint(curve: FloatArray, width_px: float, rng: np.random.Generator) -> Frame:
    """Paint spheres along a curve, the nearest in front, lit from one side, with the noise of a camera."""
    size = tuple(np.ceil(curve[:, :2].max(axis=0) + 3.0 * width_px).astype(int)[::-1])
    radius = 0.5 * width_px
    top = np.full(size, -np.inf)
    light = np.zeros(size)
    reach = int(np.ceil(radius)) + 1
    dy, dx = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    for x, y, z in curve:
        column, row = np.rint((x, y)).astype(int).tolist()
        ox, oy = dx + column - x, dy + row - y
        square = radius**2 - ox**2 - oy**2
        up = np.sqrt(np.maximum(square, 0.0))
        part = slice(row - reach, row + reach + 1), slice(column - reach, column + reach + 1)
        nearer = (square >= 0.0) & (z + up > top[part])
        top[part][nearer] = (z + up)[nearer]
        shade = 0.35 + 0.75 * np.maximum(ox * _LIGHT[0] + oy * _LIGHT[1] + up * _LIGHT[2], 0.0) / radius
        light[part][nearer] = shade[nearer]
    mask = np.isfinite(top)
    picture = np.where(mask[..., None], light[..., None] * _BLUE, _GROUND)
    picture += rng.normal(0.0, 3.0, picture.shape)
    return Frame(mask=mask, image=np.clip(picture, 0.0, 255.0).astype(np.uint8))


def _random_lines(rng: np.random.Generator) -> Lines:
    """Return a random rope: an upright side in each column and a level one in each row, either of a pair on top."""
    count = int(rng.integers(4, 8))
    columns, rows = rng.permutation(count), rng.permutation(count)
    corners = _GRID * np.array([np.repeat(columns, 2), np.roll(np.repeat(rows, 2), 1)], float).T
    crossings = [
        (2 * i, 2 * j + 1)
        for i, j in np.ndindex(count, count)
        if (columns[i] - columns[j]) * (columns[i] - columns[(j + 1) % count]) < 0
        and (rows[j] - rows[i - 1]) * (rows[j] - rows[i]) < 0
    ]
    return corners, [pair if rng.random() < 0.5 else pair[::-1] for pair in crossings]


def _straight_lines(link: Any) -> Lines:
    from spherogram.links.orthogonal import OrthogonalLinkDiagram

    corners, sides, crossings = OrthogonalLinkDiagram(link).plink_data()
    after: dict[int, int] = dict(sides)
    number = {pair: k for k, pair in enumerate(sides)}
    walk, at = [], 0
    for _ in corners:
        walk.append(at)
        at = after[at]
    order: dict[int, int] = {number[(at, after[at])]: k for k, at in enumerate(walk)}
    points = np.array([corners[k] for k in walk], dtype=float)
    return points, [(order[below], order[above]) for below, above, *_ in crossings]
