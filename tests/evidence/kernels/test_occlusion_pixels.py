"""Pixels around places against slow twins in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.evidence.kernels.occlusion_pixels import judge_depths, look_around

_OFFSETS = np.array([(0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)])
_SEEDS = st.integers(0, 10_000)


def _pixel(array: np.ndarray, x: float, y: float) -> int:
    h, w = array.shape
    return int(array[min(max(round(y), 0), h - 1), min(max(round(x), 0), w - 1)])


@given(_SEEDS)
def test_places_outside_are_hidden_and_the_others_as_the_masks_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-8.0, 40.0, (60, 2))
    occluders, mask = (rng.random((24, 32)) < 0.2).astype(np.uint8), (rng.random((24, 32)) < 0.1).astype(np.uint8)
    reach, given_told = 4.0, rng.integers(-1, 2, 60)
    told = given_told.copy()
    look_around(points, occluders, mask, 24, 32, reach, 1, -1, told)
    for (x, y), before, after in zip(points, given_told, told, strict=True):
        expected = before
        around = [_pixel(occluders, x + dx, y + dy) for dx in (-reach, 0, reach) for dy in (-reach, 0, reach)]
        if expected == 0:
            expected = 1 if _pixel(occluders, x, y) else 0 if any(around) else -1
        half = reach / 2
        cross = [_pixel(mask, x + dx, y + dy) for dx, dy in ((0, 0), (half, 0), (-half, 0), (0, half), (0, -half))]
        if expected == -1 and any(cross):
            expected = 0
        if not (-0.5 < x < 31.5 and -0.5 < y < 23.5):
            expected = 1
        assert after == expected


@pytest.mark.parametrize("kind", ["f4", "f8", "u2"])
@given(_SEEDS)
def test_most_depths_nearer_hide_and_all_farther_show(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-8.0, 40.0, (80, 2))
    depth = rng.choice([np.nan, 0.0, 20.0, 0.7, 0.99, 1.0, 1.3], (24, 32), p=[0.1, 0.05, 0.05, 0.2, 0.1, 0.1, 0.4])
    unit = 0.001 if kind == "u2" else 1.0
    stored = np.rint(np.nan_to_num(depth) / unit).astype(kind) if kind == "u2" else depth.astype(kind)
    places = np.rint(points[:, None] + 6.0 * _OFFSETS).astype(int)
    metres = stored[places[..., 1].clip(0, 23), places[..., 0].clip(0, 31)] * unit
    metres = np.where((metres >= 0.1) & (metres <= 9.0), metres, np.nan)
    expected = rng.choice([1.0, np.nan], 80, p=[0.9, 0.1])
    told = np.zeros(80, dtype=np.int64)
    judge_depths(points, stored, unit, 0.1, 9.0, expected, 6.0, 0.01, 0.012, 1, -1, told)
    nearer = (metres < (expected - 0.01 - 0.012 * expected**2)[:, None]).sum(axis=1)
    farther = (metres > (expected + 0.01 + 0.012 * expected**2)[:, None]).sum(axis=1)
    known = np.isfinite(metres).sum(axis=1)
    shown = (farther == known) & (known >= 3)
    np.testing.assert_array_equal(told, np.where(2 * nearer > known, 1, np.where(shown, -1, 0)))


def test_without_masks_only_the_border_tells() -> None:
    nothing, told = np.zeros((0, 0), dtype=np.uint8), np.zeros(2, dtype=np.int64)
    look_around(np.array([(5.0, 5.0), (40.0, 5.0)]), nothing, nothing, 24, 32, 4.0, 1, -1, told)
    assert told.tolist() == [0, 1]
