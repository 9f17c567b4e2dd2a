"""Colours before and between ends, against slow twins."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from dloftbs.evidence.kernels.gap_pixels import (
    lay_ways,
    list_unknown,
    look_across,
    measure_ways,
    sample_references,
    transform,
)

SIZE = (90, 120)
COLOURS = np.array([(150, 160, 165), (40, 60, 190), (90, 140, 40)])
"""Ground, cable, and what hides them."""

seeds = st.integers(0, 2**31)


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

    def look(self) -> np.ndarray:
        """Return how much of each way is ground, cable and neither, in widths."""
        ways, steps = lay_ways(self.ways, self.pairs, self.width)
        told = np.zeros(ways.shape[:2], dtype=np.uint8)
        look_across(
            self.image,
            self.mask,
            self.pairs,
            np.arange(len(self.pairs)),
            ways,
            steps,
            *self.references(),
            self.width,
            told,
        )
        return measure_ways(self.ways, self.pairs, steps, told, self.width)

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

    def is_clear(self, x: float, y: float) -> bool:
        """Tell whether the mask has none of five points, a quarter of a width and a pixel apart."""
        reach = 0.25 * self.width + 1.0
        for dx, dy in ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)):
            row, column = math.floor(y + reach * dy + 0.5), math.floor(x + reach * dx + 0.5)
            if 0 <= row < SIZE[0] and 0 <= column < SIZE[1] and self.mask[row, column]:
                return False
        return True


def literal_far(colour: np.ndarray, colours: np.ndarray) -> float:
    return float(np.sort(np.linalg.norm(colours - colour, axis=1))[len(colours) // 6])


def literal_spread(colours: np.ndarray) -> float:
    return float(np.sort([literal_far(colour, colours) for colour in colours] or [0.0])[len(colours) // 6])


def literal_references(scene: Scene, end: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the colours of the ground and of the cable, from two widths before an end to eight."""
    run = scene.points[slice(*scene.spans[end // 2])]
    back = run if end % 2 == 0 else run[::-1]
    width = scene.width
    last = int(min(8.0 * width, len(back) - 1))
    ground, cable = ([], []), []
    for k in range(24):
        at = int(2.0 * width + k * max(width, 1.0))
        if at >= last:
            break
        x, y = back[at]
        way = back[min(at + max(int(width), 2), last)] - back[at]
        cable.append(scene.colour_at(x, y))
        normal = np.array([-way[1], way[0]]) / np.hypot(*way) * (width + 1.0)
        for number, side in enumerate((-normal, normal)):
            if scene.is_clear(*(back[at] + side)):
                ground[number].append((k, scene.colour_at(*(back[at] + side))))
    return literal_both_sides(ground), np.array([c for c in cable if c is not None]).reshape(-1, 3)


def literal_both_sides(ground: tuple[list, list]) -> np.ndarray:
    """Return the colours, in their order, that are near one on the other side; all if the other side has none."""
    sides = [[(k, colour) for k, colour in found if colour is not None] for found in ground]
    every = sorted(((k, side, colour) for side in (0, 1) for k, colour in sides[side]), key=lambda found: found[:2])
    colours = np.array([colour for _, _, colour in every]).reshape(-1, 3)
    if not all(sides):
        return colours
    alike = max(12.0, 4.0 * literal_spread(colours))
    kept = [min(np.linalg.norm(colour - other) for _, other in sides[1 - side]) <= alike for _, side, colour in every]
    return colours[np.array(kept)]


def literal_keep(beside: list[np.ndarray | None], ground: np.ndarray, alike: float) -> list[np.ndarray | None]:
    """Keep samples like ground; then, forwards and backwards, those like the nearest kept one that was passed."""
    kept = [colour is not None and literal_far(colour, ground) <= alike for colour in beside]
    for order in (range(len(beside)), reversed(range(len(beside)))):
        passed = None
        for k in order:
            colour = beside[k]
            if colour is None:
                continue
            kept[k] = kept[k] or (passed is not None and bool(np.linalg.norm(colour - passed) <= alike))
            passed = colour if kept[k] else passed
    return [colour if keep else None for colour, keep in zip(beside, kept, strict=True)]


def literal_other_light(colour: np.ndarray, grounds: np.ndarray) -> bool:
    """Return True if a colour is that of some ground, darker or brighter."""
    share = grounds @ colour / (grounds**2).sum(axis=1)
    away = np.linalg.norm(colour - share[:, None] * grounds, axis=1)
    return bool(((share >= 0.35) & (share <= 1.0 / 0.35) & (away <= 12.0 * np.maximum(share, 1.0))).any())


def literal_look(scene: Scene, i: int, j: int) -> list[float]:
    """Return how much of one way is ground, cable and neither, in widths."""
    ground, cable = zip(*(literal_references(scene, int(scene.ends[e])) for e in (i, j)), strict=True)
    if sum(map(len, ground)) < 6 or min(map(len, cable)) == 0:
        return [0.0, 0.0, 0.0]
    like_ground = max(12.0, *(4.0 * literal_spread(colours) for colours in ground))
    like_cable = max(12.0, *(4.0 * literal_spread(colours) for colours in cable))
    grounds, cables = np.concatenate(ground), np.concatenate(cable)
    (ax, ay, adx, ady), (bx, by, bdx, bdy) = scene.ways[i], scene.ways[j]
    length = float(np.hypot(bx - ax, by - ay))
    steps = min(max(int(length / max(0.5 * scene.width, 1.0)), 2), 24)
    # The second end's direction points out of its run, so the way comes in against it.
    way = CubicHermiteSpline([0.0, 1.0], [(ax, ay), (bx, by)], np.array([(adx, ady), (-bdx, -bdy)]) * length)
    seen = [0.0, 0.0, 0.0]
    beside = []
    for side in (-1.0, 1.0):
        colours = []
        for t in np.linspace(0.0, 1.0, steps + 1):
            dx, dy = way(t, 1) / max(float(np.hypot(*way(t, 1))), 1e-9)
            x, y = way(t) + side * (scene.width + 1.0) * np.array([-dy, dx])
            colours.append(scene.colour_at(x, y) if scene.is_clear(x, y) else None)
        beside.append(literal_keep(colours, grounds, like_ground))
    for k in range(1, steps):
        x, y = way(k / steps)
        colour = scene.colour_at(x, y)
        if colour is None or not scene.is_clear(x, y):
            continue
        to_ground, to_cable = literal_far(colour, grounds), literal_far(colour, cables)
        to_ground = min([to_ground, *(np.linalg.norm(colour - side[k]) for side in beside if side[k] is not None)])
        is_ground, is_cable = to_ground <= like_ground, to_cable <= like_cable
        if is_ground and is_cable:
            is_ground, is_cable = to_ground < to_cable, to_cable < to_ground
            if not is_ground and not is_cable:
                continue
        if is_ground or is_cable or not literal_other_light(colour, grounds):
            seen[0 if is_ground else 1 if is_cable else 2] += length / steps / scene.width
    return seen


@given(seeds)
def test_references_are_the_colours_before_the_ends_and_beside_them(seed: int) -> None:
    scene = Scene(seed)
    ground, grounds, cable, cables, spread = scene.references()
    for e, end in enumerate(scene.ends.tolist()):
        expected_ground, expected_cable = literal_references(scene, end)
        np.testing.assert_allclose(ground[e, : grounds[e]], expected_ground)
        np.testing.assert_allclose(cable[e, : cables[e]], expected_cable)
        np.testing.assert_allclose(spread[e], [literal_spread(expected_ground), literal_spread(expected_cable)])


def test_what_lies_on_one_side_of_a_cable_alone_is_no_ground() -> None:
    """It may be what hides the cable, and lie along it before it does."""
    scene = Scene(0)
    scene.image[:] = COLOURS[0]
    scene.mask[:], scene.width = 0, 6.0
    scene.mask[42:48, 10:100] = 1
    scene.points, scene.spans = np.column_stack((np.arange(10.0, 100.0), np.full(90, 44.5))), np.array([[0, 90]])
    scene.ends = np.array([0, 1])
    scene.image[:42, 80:] = COLOURS[2]  # a cover that comes up to the cable's end from one side
    ground, grounds, *_ = scene.references()
    assert grounds.min() >= 6
    assert (np.concatenate([own[:count] for own, count in zip(ground, grounds, strict=True)]) == COLOURS[0]).all()


@given(seeds)
def test_the_lengths_across_are_those_of_the_literal_twin(seed: int) -> None:
    scene = Scene(seed)
    found = scene.look()
    np.testing.assert_allclose(found, [literal_look(scene, *pair) for pair in scene.pairs.tolist()])


@given(seeds)
def test_no_more_is_seen_than_the_way_is_long(seed: int) -> None:
    scene = Scene(seed)
    seen = scene.look()
    straight = np.hypot(*(scene.ways[scene.pairs[:, 0], :2] - scene.ways[scene.pairs[:, 1], :2]).T) / scene.width
    assert (seen >= 0.0).all()
    assert (seen.sum(axis=1) <= straight + 1e-9).all()


@given(seeds)
def test_ways_without_an_unknown_place_beside_the_mask_are_not_asked(seed: int) -> None:
    scene = Scene(seed)
    ways, steps = lay_ways(scene.ways, scene.pairs, scene.width)
    told = np.random.default_rng(seed).choice([0, 1], ways.shape[:2], p=(0.1, 0.9)).astype(np.uint8)
    asked, ends, numbers = list_unknown(scene.mask, scene.pairs, len(scene.ways), ways, steps, told, scene.width)
    unknown = [
        any(told[p, k] == 0 and scene.is_clear(*ways[p, k, :2]) for k in range(1, steps[p]))
        for p in range(len(scene.pairs))
    ]
    assert asked.tolist() == np.flatnonzero(unknown).tolist()
    assert ends.tolist() == sorted(set(scene.pairs[asked].ravel().tolist()))
    np.testing.assert_array_equal(ends[numbers], scene.pairs[asked])


@given(seeds)
def test_points_are_moved_as_a_product_of_matrices_does(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points, matrix, offset = rng.normal(0.0, 99.0, (rng.integers(0, 5), 2)), rng.normal(size=(2, 2)), rng.normal(size=2)
    np.testing.assert_allclose(transform(points, matrix, offset), points @ matrix.T + offset)
