"""The box of a mask and the moments of its border."""

from __future__ import annotations

import numpy as np
from drawings import EIGHT_VERSIONS, random_mask, turn
from skeletons import padded

from dloftbs.kernels.boxes import border_moments, pose_pixels, tight_box, word_box
from dloftbs.kernels.thinning import find_border


def test_the_box_of_words_agrees_with_its_slow_twin_on_thousands_of_masks() -> None:
    for seed in range(2000):
        rng = np.random.default_rng(seed)
        words = (padded(random_mask(seed, 60)) * (rng.random() < 0.95)).view(np.uint64)
        row, k = np.nonzero(words)
        expected = (k.min(), row.min(), k.max() + 1, row.max() + 1) if len(row) else (0, 0, 0, 0)
        assert word_box(words) == expected, f"seed {seed}"


def test_the_tight_box_agrees_with_its_slow_twin_on_thousands_of_masks() -> None:
    for seed in range(3000):
        rng = np.random.default_rng(seed)
        mask = random_mask(seed) * (rng.random() < 0.95)
        mask = (mask & (rng.random(mask.shape) < rng.choice([0.02, 0.5, 1.0]))).astype(np.uint8)[:: rng.choice([1, -1])]
        row, column = np.nonzero(mask)
        expected = (column.min(), row.min(), column.max() + 1, row.max() + 1) if len(row) else (0, 0, 0, 0)
        assert tight_box(mask) == expected, f"seed {seed}"


def test_masks_without_rows_or_columns_have_no_box() -> None:
    for shape in ((0, 0), (0, 8), (5, 0)):
        assert tight_box(np.zeros(shape, dtype=np.uint8)) == word_box(np.zeros(shape, dtype=np.uint64)) == (0, 0, 0, 0)


def test_moments_agree_with_their_slow_twin_on_thousands_of_masks() -> None:
    for seed in range(2000):
        frame = padded(random_mask(seed))
        border, _ = find_border(frame.view(np.uint64))
        h, w = 41, 43  # any box will do
        row, column = np.divmod(border.astype(np.int64), frame.shape[1])
        y, x = 2 * row - h - 1, 2 * column - w - 1
        expected = (x, y, x * y**2, y * x**2, x**3, y**3, x**2, y**2)
        moments = border_moments(border, frame.shape[1], h, w)
        assert moments == tuple(int(values.sum()) for values in expected), f"seed {seed}"


def test_mirrored_borders_have_opposite_odd_moments() -> None:
    mask = random_mask(7)
    h, w = mask.shape
    one, other = padded(mask), padded(mask[:, ::-1])
    a = border_moments(find_border(one.view(np.uint64))[0], one.shape[1], h, w)
    b = border_moments(find_border(other.view(np.uint64))[0], other.shape[1], h, w)
    assert (b[0], b[2], b[4]) == (-a[0], -a[2], -a[4])
    assert (b[1], b[3], b[5:]) == (a[1], a[3], a[5:])


def test_posed_pixels_agree_with_their_slow_twin_on_thousands_of_masks() -> None:
    for seed in range(1000):
        mask = random_mask(seed)
        (h, w), frame = mask.shape, padded(mask)
        flat = np.flatnonzero(frame).astype(np.int32)
        for how in EIGHT_VERSIONS:
            posed = pose_pixels(flat, frame.shape[1], h, w, *map(bool, how))
            np.testing.assert_array_equal(posed, np.argwhere(turn(frame[: h + 2, : w + 2], *how)), f"seed {seed}")
