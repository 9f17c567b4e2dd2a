"""Masks as bitmasks: cut out, framed, measured and listed."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, random_mask, random_masks, turn
from hypothesis import given
from hypothesis import strategies as st
from skeletons import as_pixels, as_words, framed_bitmask, padded, pasted, slow_degrees

from dloftbs.kernels.bitmask import as_bytes, cut, frame, list_pixels
from dloftbs.kernels.shared.bitmask_layout import TILE_ROWS


def sparse(seed: int) -> np.ndarray:
    """Return a mask of up to 300 columns, full, sparse or empty."""
    rng = np.random.default_rng(seed)
    mask = np.zeros((int(rng.integers(1, 60)), int(rng.integers(1, 300))), dtype=np.uint8)
    part = random_mask(seed, 40)[: mask.shape[0], : mask.shape[1]]
    y, x = (int(rng.integers(0, whole - piece + 1)) for whole, piece in zip(mask.shape, part.shape, strict=True))
    mask[y : y + part.shape[0], x : x + part.shape[1]] = part & (rng.random(part.shape) < rng.choice([0.0, 0.05, 1.0]))
    return mask


@pytest.mark.parametrize("margin", [0, 1, 5, 70])
def test_what_is_cut_out_is_the_mask_with_its_margin(margin: int) -> None:
    for seed in range(300):
        mask = sparse(seed)
        h, w = mask.shape
        bitmask, inside, x0, y0, area = cut(as_words(mask), w, margin)
        rows, columns = np.nonzero(mask)
        if len(rows) == 0:
            assert bitmask.shape == (0, 0)
            continue
        np.testing.assert_array_equal(pasted(bitmask, x0, y0, mask.shape), mask)
        pixels = as_pixels(bitmask)
        assert not pixels[[0, -1]].any()
        assert not bitmask[[0, -1]].any()
        # All of the margin is there, as far as the image goes.
        assert y0 + 1 == max(rows.min() - margin, 0)
        assert y0 + bitmask.shape[1] - 1 == min(rows.max() + 1 + margin, h)
        assert x0 + 64 <= columns.min() - margin
        assert x0 + 64 * (len(bitmask) - 1) > columns.max() + margin
        image_columns = x0 + np.arange(pixels.shape[1])
        np.testing.assert_array_equal(as_pixels(inside[:, None])[0], (image_columns >= 0) & (image_columns < w))
        assert area == (np.ptp(rows) + 1) * (np.ptp(columns) + 1)


@pytest.mark.parametrize("shape", [(0, 0), (0, 3), (5, 0)])
def test_masks_without_rows_or_columns_are_empty(shape: tuple[int, int]) -> None:
    assert cut(np.zeros(shape, dtype=np.uint64), 64 * shape[1], 2)[0].shape == (0, 0)


def test_frames_agree_with_their_slow_twin_on_thousands_of_masks() -> None:
    for seed in range(2000):
        mask = sparse(seed)
        bitmask = np.zeros((-(-mask.shape[1] // 64) + 2, len(mask) + 2), dtype=np.uint64)
        bitmask[1:-1, 1:-1] = as_words(mask).T
        pixels, framed, box, moments = frame(bitmask)
        rows, columns = np.nonzero(mask)
        if len(rows) == 0:
            assert pixels.shape == framed.shape == (0, 0)
            continue
        cropped = mask[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
        assert box == (columns.min() + 64, rows.min() + 1, *cropped.shape)
        np.testing.assert_array_equal(pixels, padded(cropped))
        np.testing.assert_array_equal(framed, framed_bitmask(cropped))
        assert moments == slow_moments(cropped), f"seed {seed}"


def slow_moments(mask: np.ndarray) -> tuple[int, ...]:
    grid = np.pad(mask, 1).astype(bool)
    inner = np.logical_and.reduce([np.roll(grid, shift, axis) for shift in (-1, 1) for axis in (0, 1)])
    row, column = np.nonzero(grid & ~inner)
    y, x = 2 * row - mask.shape[0] - 1, 2 * column - mask.shape[1] - 1
    return tuple(int(v.sum()) for v in (x, y, x * y**2, y * x**2, x**3, y**3, x**2, y**2))


def test_mirrored_masks_have_opposite_odd_moments() -> None:
    mask = random_mask(7, 90)
    a, b = (frame(np.pad(framed_bitmask(one), ((1, 1), (0, 0))))[3] for one in (mask, mask[:, ::-1]))
    assert (b[0], b[2], b[4]) == (-a[0], -a[2], -a[4])
    assert (b[1], b[3], b[5:]) == (a[1], a[3], a[5:])


@given(random_masks)
def test_bytes_are_the_pixels(mask: np.ndarray) -> None:
    wide = np.tile(mask, (1, 4))
    np.testing.assert_array_equal(as_bytes(framed_bitmask(wide), *wide.shape), padded(wide))


@given(random_masks, st.sampled_from(EIGHT_VERSIONS))
def test_listed_pixels_agree_with_their_slow_twin(mask: np.ndarray, how: tuple[int, int, int]) -> None:
    wide = np.tile(mask, (1, 3))
    pixels_rc, degrees = list_pixels(framed_bitmask(wide), *wide.shape, *map(bool, how))
    turned = turn(np.pad(wide, 1), *how)
    np.testing.assert_array_equal(pixels_rc, np.argwhere(turned))
    np.testing.assert_array_equal(degrees, slow_degrees(turned)[tuple(pixels_rc.T)])
    assert (pixels_rc.dtype, degrees.dtype) == (np.int32, np.uint8)


def test_rows_of_frames_come_in_whole_tiles() -> None:
    for height in (1, 7, 8, 9):
        assert frame(np.pad(framed_bitmask(np.ones((height, 5))), ((1, 1), (0, 0))))[1].shape[1] % TILE_ROWS == 2
