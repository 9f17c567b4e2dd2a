"""Scenes of cables with gaps in an image, and slow twins of what is sampled there."""

from __future__ import annotations

import math

import numpy as np

from dloftbs.evidence.kernels.end_references import sample_references
from dloftbs.evidence.kernels.gap_pixels import describe_pixels, lay_ways

SIZE = (90, 120)
COLOURS = np.array([(150, 160, 165), (40, 60, 190), (90, 140, 40)])
"""Ground, cable, and what hides them."""


class Scene:
    """Straight runs in an image of three colours, noisy, whose mask leaves out a vertical stripe of the runs."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        y, x = np.mgrid[: SIZE[0], : SIZE[1]]
        self.width = float(rng.uniform(3.0, 14.0))
        lines = rng.uniform((0, 10), (20, 80), (2, 2)), rng.uniform((100, 10), (119, 80), (2, 2))
        left, right = np.sort(rng.uniform(45.0, 85.0, 2))
        kind = np.zeros(SIZE, dtype=np.int64)
        self.mask = np.zeros(SIZE, dtype=np.uint8)
        runs = []
        for start, stop in zip(*lines, strict=True):
            way = stop - start
            along = ((x - start[0]) * way[0] + (y - start[1]) * way[1]) / (way @ way)
            away = np.abs((x - start[0]) * way[1] - (y - start[1]) * way[0]) / np.hypot(*way)
            cable = (away <= 0.5 * self.width) & (along >= 0.0) & (along <= 1.0)
            self.mask |= (cable & ((x < left) | (x > right))).astype(np.uint8)
            kind[cable] = 1
            points = start + np.arange(0.0, np.hypot(*way))[:, None] * way / np.hypot(*way)
            runs += [points[points[:, 0] < left], points[points[:, 0] > right]]
        self.points = np.concatenate(runs)
        bounds = np.cumsum([0, *map(len, runs)])
        self.spans = np.column_stack((bounds[:-1], bounds[1:]))
        self.ends = rng.permutation(8)[: rng.integers(1, 9)]
        first = (0, left) if rng.random() < 0.2 else (left, rng.uniform(left, right))  # hides part of the gap, or ends
        kind[(x > first[0]) & (x < first[1])] = rng.integers(0, 3)
        noise = rng.normal(0.0, rng.choice([0.0, 2.0, 15.0]), (*SIZE, 3))
        drift = np.linspace(0.0, rng.choice([0.0, 60.0]), SIZE[1])[:, None]
        self.image = np.clip(COLOURS[kind] + noise + drift, 0, 255).astype(np.uint8)
        tips = self.points[[bounds[end // 2] if end % 2 == 0 else bounds[end // 2 + 1] - 1 for end in self.ends]]
        angle = rng.uniform(-np.pi, np.pi, len(self.ends))
        self.ways = np.column_stack((tips, np.cos(angle), np.sin(angle)))
        self.pairs = rng.integers(0, len(self.ends), (3, 2))

    def describe(self, asked: np.ndarray, covered: np.ndarray) -> np.ndarray:
        """Return what the image shows of some ways."""
        ways, steps = lay_ways(self.ways, self.pairs, self.width)
        ours = self.image, self.mask, self.pairs[asked], asked
        return describe_pixels(*ours, ways, steps, *self.references(), self.width, covered)

    def references(self) -> tuple[np.ndarray, ...]:
        return sample_references(self.image, self.mask, self.points, self.spans, self.ends, self.width)

    def colour_at(self, x: float, y: float) -> np.ndarray | None:
        """Return the mean colour of the square around a place, None where the image does not have all of it."""
        half = int(0.2 * self.width)
        row, column = math.floor(y + 0.5), math.floor(x + 0.5)
        if not (half <= row < SIZE[0] - half and half <= column < SIZE[1] - half):
            return None
        square = self.image[row - half : row + half + 1, column - half : column + half + 1]
        return square.reshape(-1, 3).mean(axis=0)


def is_clear(mask: np.ndarray, width: float, x: float, y: float) -> bool:
    """Tell whether a mask has none of five points, a quarter of a width and a pixel apart."""
    reach = 0.25 * width + 1.0
    for dx, dy in ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)):
        row, column = math.floor(y + reach * dy + 0.5), math.floor(x + reach * dx + 0.5)
        if 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and mask[row, column]:
            return False
    return True


def literal_spread(colours: np.ndarray) -> float:
    """Return the median distance of a colour from the nearest other one."""
    if len(colours) < 2:
        return 0.0
    return float(np.median(np.sort(np.linalg.norm(colours[:, None] - colours, axis=2), axis=1)[:, 1]))


def literal_references(scene: Scene, end: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the colours of the ground and of the cable, from two widths before an end to eight."""
    run = scene.points[slice(*scene.spans[end // 2])]
    back = run if end % 2 == 0 else run[::-1]
    width = scene.width
    last = int(min(8.0 * width, len(back) - 1))
    ground, cable = [], []
    for k in range(24):
        at = int(2.0 * width + k * max(width, 1.0))
        if at >= last:
            break
        way = back[min(at + max(int(width), 2), last)] - back[at]
        cable.append(scene.colour_at(*back[at]))
        across = np.array([-way[1], way[0]]) / np.hypot(*way)
        for aside in (-width - 1.0, width + 1.0, -2.0 * width - 1.0, 2.0 * width + 1.0):
            if is_clear(scene.mask, width, *(back[at] + aside * across)):
                ground.append(scene.colour_at(*(back[at] + aside * across)))
    of_ground, of_cable = (np.array([c for c in own if c is not None]).reshape(-1, 3) for own in (ground, cable))
    return of_ground, of_cable
