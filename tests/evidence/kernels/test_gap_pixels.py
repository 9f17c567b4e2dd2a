"""Colours between ends, against slow twins."""

from __future__ import annotations

import numpy as np
from gap_scenes import Scene, is_clear, literal_references, literal_spread
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from dloftbs.evidence.kernels.gap_pixels import describe_pixels, lay_ways, list_uncovered, mark_probable

seeds = st.integers(0, 2**31)


def literal_description(scene: Scene, p: int, covered: np.ndarray) -> list[float]:
    """Return what an image shows of one way."""
    i, j = scene.pairs[p]
    ground, cable = zip(*(literal_references(scene, int(scene.ends[e])) for e in (i, j)), strict=True)
    grounds, cables = np.concatenate(ground), np.concatenate(cable)
    (ax, ay, adx, ady), (bx, by, bdx, bdy) = scene.ways[i], scene.ways[j]
    length = float(np.hypot(bx - ax, by - ay))
    steps = min(max(int(length / max(0.5 * scene.width, 1.0)), 2), 24)
    # The second end's direction points out of its run, so the way comes in against it.
    way = CubicHermiteSpline([0.0, 1.0], [(ax, ay), (bx, by)], np.array([(adx, ady), (-bdx, -bdy)]) * length)
    clear = [k for k in range(1, steps) if is_clear(scene.mask, scene.width, *way(k / steps))]
    unknown = [k / steps for k in clear if covered[p, k] == 0]
    colours = [(t, scene.colour_at(*way(t))) for t in unknown if scene.colour_at(*way(t)) is not None]
    if len(grounds) == 0 or len(cables) == 0 or not colours:
        return [0.0, 0.0, 0.0]
    light = np.median(ground[1], axis=0) - np.median(ground[0], axis=0) if min(map(len, ground)) > 0 else np.zeros(3)
    deviation = 4.0 + 2.0 * np.average([literal_spread(own) for own in ground], weights=[len(own) for own in ground])
    most = -np.inf
    for t, colour in colours:
        as_lit = np.concatenate((ground[0] + t * light, ground[1] - (1.0 - t) * light))
        as_ground = 0.5 * (literal_share(colour, grounds, deviation) + literal_share(colour, as_lit, deviation))
        most = max(most, np.log(as_ground / literal_share(colour, cables, deviation)))
    return (len(colours) / len(clear) * np.array([1.0, most, max(most, 0.0) ** 2])).tolist()


def literal_share(colour: np.ndarray, samples: np.ndarray, deviation: float) -> float:
    """Return what share of some samples, and of one that is like anything, a colour is like."""
    away = np.linalg.norm(colour - samples, axis=1) / deviation
    return float((1.0 + np.exp(-0.5 * away[away < 6.0] ** 2).sum()) / (1.0 + len(samples)))


@given(seeds)
def test_the_description_is_that_of_the_literal_twin(seed: int) -> None:
    scene = Scene(seed)
    rng = np.random.default_rng(seed)
    asked = rng.permutation(len(scene.pairs))[: rng.integers(1, len(scene.pairs) + 1)]
    covered = (rng.random((len(scene.pairs), 25)) < rng.choice([0.0, 0.3])).astype(np.uint8)
    expected = [literal_description(scene, p, covered) for p in asked]
    np.testing.assert_allclose(scene.describe(asked, covered), expected, rtol=1e-9, atol=1e-12)


@given(seeds)
def test_places_that_are_covered_are_not_looked_at(seed: int) -> None:
    scene = Scene(seed)
    ways, steps = lay_ways(scene.ways, scene.pairs, scene.width)
    covered = np.ones(ways.shape[:2], np.uint8)
    found = describe_pixels(
        scene.image, scene.mask, scene.pairs, np.arange(3), ways, steps, *scene.references(), scene.width, covered
    )
    assert (found == 0.0).all()


@given(seeds)
def test_ways_without_an_uncovered_place_beside_the_mask_are_not_asked(seed: int) -> None:
    scene = Scene(seed)
    ways, steps = lay_ways(scene.ways, scene.pairs, scene.width)
    covered = np.random.default_rng(seed).choice([0, 1], ways.shape[:2], p=(0.1, 0.9)).astype(np.uint8)
    asked, ends, numbers = list_uncovered(scene.mask, scene.pairs, len(scene.ways), ways, steps, covered, scene.width)
    uncovered = [
        any(covered[p, k] == 0 and is_clear(scene.mask, scene.width, *ways[p, k, :2]) for k in range(1, steps[p]))
        for p in range(len(scene.pairs))
    ]
    assert asked.tolist() == np.flatnonzero(uncovered).tolist()
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
    covered = rng.choice(np.array([0, 0, 2], np.uint8), ways.shape[:2])
    expected = covered.copy()
    for p, k in np.ndindex(covered.shape):
        x, y, dx, dy = ways[p, k]
        near = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
        on_mask = any(pixel(mask, x + across, y + down) for across, down in near)
        places = [(x - a * width * dy, y + a * width * dx) for a in (-0.4, -0.2, 0.0, 0.2, 0.4)]
        seen = max(pixel(soft, *place) for place in places)
        beside = max(pixel(soft, x - a * width * dy, y + a * width * dx) for a in (-1.0, 1.0))
        is_ridge = all(within(soft, *place) for place in places) and seen > beside
        if 0 < k < steps[p] and covered[p, k] == 0 and not on_mask and is_ridge and seen >= 16:
            expected[p, k] = 1
    mark_probable(soft, mask, ways, steps, width, covered)
    np.testing.assert_array_equal(covered, expected)


def within(pixels: np.ndarray, x: float, y: float) -> bool:
    return -0.5 <= y < pixels.shape[0] - 0.5 and -0.5 <= x < pixels.shape[1] - 0.5


def pixel(pixels: np.ndarray, x: float, y: float) -> int:
    return int(pixels[int(np.floor(y + 0.5)), int(np.floor(x + 0.5))]) if within(pixels, x, y) else 0
