"""Pixels around places against slow twins in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.evidence.kernels.occlusion_pixels import look_at_pixels

_OFFSETS = np.array([(0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)])
_SEEDS = st.integers(0, 10_000)
_NOTHING = np.zeros((0, 0), dtype=np.uint8)


def _look_without_depth(points: np.ndarray, occluders: np.ndarray, mask: np.ndarray) -> np.ndarray:
    nothing = np.zeros((0, 0), dtype=np.uint16), 0.0, 0.0, 0.0, np.zeros(0)
    return look_at_pixels(points, occluders, mask, 24, 32, 4.0, *nothing)


def _pixel(array: np.ndarray, x: float, y: float) -> int:
    h, w = array.shape
    return int(array[min(max(round(y), 0), h - 1), min(max(round(x), 0), w - 1)])


@given(_SEEDS)
def test_places_outside_are_hidden_and_the_others_as_the_masks_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-8.0, 40.0, (60, 2))
    occluders, mask = (rng.random((24, 32)) < 0.2).astype(np.uint8), (rng.random((24, 32)) < 0.1).astype(np.uint8)
    for (x, y), told in zip(points, _look_without_depth(points, occluders, mask), strict=True):
        inside = -0.5 < x < 31.5 and -0.5 < y < 23.5
        assert told == (1 if not inside or _pixel(occluders, x, y) else 0)


@pytest.mark.parametrize("kind", ["f4", "f8", "u2"])
@given(_SEEDS)
def test_most_depths_nearer_hide_and_all_farther_show(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.4, 23.4, (80, 2))
    depth = rng.choice([np.nan, 0.0, 20.0, 0.7, 0.99, 1.0, 1.3], (24, 32), p=[0.1, 0.05, 0.05, 0.2, 0.1, 0.1, 0.4])
    unit = 0.001 if kind == "u2" else 1.0
    stored = np.rint(np.nan_to_num(depth) / unit).astype(kind) if kind == "u2" else depth.astype(kind)
    places = np.rint(points[:, None] + 6.0 * _OFFSETS).astype(int)
    metres = stored[places[..., 1].clip(0, 23), places[..., 0].clip(0, 31)] * unit
    metres = np.where((metres >= 0.1) & (metres <= 9.0), metres, np.nan)
    expected = rng.choice([1.0, np.nan], 80, p=[0.9, 0.1])
    told = look_at_pixels(points, _NOTHING, _NOTHING, 24, 32, 6.0, stored, unit, 0.1, 9.0, expected)
    nearer = (metres < (expected - 0.01 - 0.012 * expected**2)[:, None]).sum(axis=1)
    farther = (metres > (expected + 0.01 + 0.012 * expected**2)[:, None]).sum(axis=1)
    known = np.isfinite(metres).sum(axis=1)
    shown = (farther == known) & (known >= 3)
    np.testing.assert_array_equal(told, np.where(2 * nearer > known, 1, np.where(shown, -1, 0)))


def test_where_depth_tells_the_occluders_are_not_asked_and_a_cable_in_the_mask_leaves_it_open() -> None:
    points, depth = np.array([(5.0, 5.0), (15.0, 5.0), (15.0, 15.0), (25.0, 5.0)]), np.full((24, 32), 1.5)
    depth[:, :10] = 0.5
    mask, occluders = np.zeros((24, 32), dtype=np.uint8), np.ones((24, 32), dtype=np.uint8)
    mask[15, 15] = 1
    expected = np.array([1.0, 1.0, 1.0, np.nan])
    told = look_at_pixels(points, occluders, mask, 24, 32, 4.0, depth, 1.0, 0.1, 9.0, expected)
    assert told.tolist() == [1, -1, 0, 1]


def test_without_masks_only_the_border_tells() -> None:
    assert _look_without_depth(np.array([(5.0, 5.0), (40.0, 5.0)]), _NOTHING, _NOTHING).tolist() == [0, 1]
