"""Where fringe may lie, against each square that fits, grown."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from skeletons import as_words, pasted
from thin_parts import slow_fringe

from dloftbs.cleaning.kernels.fringe import find_fringe
from dloftbs.kernels.bitmask import cut


def with_kernel(mask: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray]:
    eroded = cv2.erode(mask, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    bitmask, inside, x0, y0, _ = cut(as_words(eroded), mask.shape[1], max(mask.shape))
    if len(bitmask) == 0:
        return np.zeros_like(mask), np.zeros_like(mask)
    edge, around = find_fringe(bitmask, inside, reach, 10)
    if len(edge) == 0:
        return np.zeros_like(mask), np.zeros_like(mask)
    return pasted(edge, x0, y0, mask.shape), pasted(around, x0, y0, mask.shape)


def thick(seed: int) -> np.ndarray:
    """Strokes of all widths, some of which leave the image."""
    rng = np.random.default_rng(seed)
    mask = np.zeros((90, 150), np.uint8)
    for _ in range(3):
        (x, y), (u, v) = rng.integers(-20, 160, (2, 2)).tolist()
        cv2.line(mask, (x, y), (u, v), 1, int(rng.integers(1, 30)))
    return mask


@pytest.mark.parametrize("reach", [1, 2, 4, 6])
def test_the_surroundings_are_those_of_each_square_that_fits(reach: int) -> None:
    seen = 0
    for seed in range(12):
        mask = thick(seed)
        if not mask.any():
            continue
        for found, expected in zip(with_kernel(mask, reach), slow_fringe(mask, reach), strict=True):
            np.testing.assert_array_equal(found != 0, expected)
            seen += int(expected.any() and not expected.all())
    assert seen > 4


@pytest.mark.parametrize("width", [1, 2, 3, 4])
def test_nothing_is_around_a_thin_cable(width: int) -> None:
    mask = np.zeros((40, 90), np.uint8)
    mask[20 : 20 + width, 5:85] = 1
    assert not any(one.any() for one in with_kernel(mask, 1))


@pytest.mark.parametrize(("angle", "thickness"), [(15.0, 2), (30.0, 2), (45.0, 2), (60.0, 3), (90.0, 3)])
def test_nothing_is_around_the_crossing_of_thin_cables(angle: float, thickness: int) -> None:
    mask = np.zeros((120, 120), np.uint8)
    for turn in (-0.5, 0.5):
        way = 55.0 * np.array([np.cos(np.deg2rad(turn * angle + 20)), np.sin(np.deg2rad(turn * angle + 20))])
        cv2.line(mask, *np.rint(60 + np.stack((-way, way))).astype(int).tolist(), 1, thickness)
    assert not any(one.any() for one in with_kernel(mask, 1))
