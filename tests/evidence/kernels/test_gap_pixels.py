"""Colours between ends, against slow twins."""

from __future__ import annotations

import numpy as np
from gap_scenes import Scene, literal_far, literal_references, literal_spread
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from dloftbs.evidence.kernels.gap_pixels import (
    IS_CABLE,
    IS_NEITHER,
    lay_ways,
    list_unknown,
    mark_probable,
)

seeds = st.integers(0, 2**31)


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
def test_places_that_are_somewhat_probable_are_those_of_the_literal_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    soft = np.kron(rng.integers(0, 40, (10, 14)), np.ones((6, 6))).astype(np.uint8)
    mask = np.kron(rng.random((10, 14)) < 0.2, np.ones((6, 6))).astype(np.uint8)
    states = np.column_stack((rng.uniform(-4.0, 88.0, 6), rng.uniform(-4.0, 64.0, 6), np.ones(6), np.zeros(6)))
    width = rng.uniform(1.0, 9.0)
    ways, steps = lay_ways(states, np.array([(0, 1), (2, 3), (4, 5)]), width)
    told = rng.choice(np.array([0, 0, IS_NEITHER], np.uint8), ways.shape[:2])
    expected = told.copy()
    for p, k in np.ndindex(told.shape):
        x, y, dx, dy = ways[p, k]
        near = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
        on_mask = any(pixel(mask, x + across, y + down) for across, down in near)
        places = [(x - a * width * dy, y + a * width * dx) for a in (-0.4, -0.2, 0.0, 0.2, 0.4)]
        seen = max(pixel(soft, *place) for place in places)
        beside = max(pixel(soft, x - a * width * dy, y + a * width * dx) for a in (-1.0, 1.0))
        is_ridge = all(within(soft, *place) for place in places) and seen > beside
        if 0 < k < steps[p] and told[p, k] == 0 and not on_mask and is_ridge and seen >= 16:
            expected[p, k] = IS_CABLE
    mark_probable(soft, mask, ways, steps, width, told)
    np.testing.assert_array_equal(told, expected)


def within(pixels: np.ndarray, x: float, y: float) -> bool:
    return -0.5 <= y < pixels.shape[0] - 0.5 and -0.5 <= x < pixels.shape[1] - 0.5


def pixel(pixels: np.ndarray, x: float, y: float) -> int:
    return int(pixels[int(np.floor(y + 0.5)), int(np.floor(x + 0.5))]) if within(pixels, x, y) else 0
