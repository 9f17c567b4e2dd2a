"""Thinning: the slow twin, what may go, and the topology that must survive."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
import pytest
from drawings import draw_cable, mask_from_text, random_mask, random_masks, wave
from hypothesis import given
from numba import njit
from scipy import ndimage
from skeletons import ORDER, fast_skeleton, padded

from dloftbs.skeleton.kernels.thinning import _may_go

_may_go = njit(_may_go)

NEIGHBOURS = [(-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1)]
EIGHT = np.ones((3, 3), dtype=int)


def is_simple(neighbours: list[int]) -> bool:
    """Count pieces instead of using Yokoi's formula: deleting the middle must keep both the object and its holes."""
    block = np.zeros((3, 3), dtype=int)
    for (dr, dc), value in zip(NEIGHBOURS, neighbours, strict=True):
        block[1 + dr, 1 + dc] = value
    objects = ndimage.label(block, EIGHT)[1]
    background = 1 - block
    background[1, 1] = 0
    pieces, _ = ndimage.label(background)
    beside = {pieces[0, 1], pieces[1, 0], pieces[1, 2], pieces[2, 1]} - {0}
    return objects == 1 and len(beside) == 1


MAY_GO = np.array(
    [sum(n) >= 2 and is_simple(n) for n in ([code >> bit & 1 for bit in range(8)] for code in range(256))]
)


def slow_skeleton(mask: np.ndarray, order: tuple[int, ...] = ORDER) -> np.ndarray:
    """Look at every pixel of the image in every turn, by what counting pieces says of its neighbourhood."""
    state = padded(mask)
    h, w = mask.shape
    inner = state[1 : 1 + h, 1 : 1 + w]
    around = [state[1 + dr : 1 + dr + h, 1 + dc : 1 + dc + w] for dr, dc in NEIGHBOURS]
    before = inner + 1  # at least one turn
    while (inner != before).any():
        before = inner.copy()
        for side in order:
            code = sum(neighbour << bit for bit, neighbour in enumerate(around))
            inner[(around[side] == 0) & MAY_GO[code]] = 0
    return state


def wide_blobs(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    smooth = cv2.GaussianBlur(rng.random(shape), (0, 0), 4.0)
    return (smooth > np.median(smooth)).astype(np.uint8)


@pytest.mark.parametrize("side", ORDER)
def test_pixels_go_as_counting_pieces_says(side: int) -> None:
    neighbours = [np.array([code >> bit & 1 for code in range(256)], dtype=np.uint64) for bit in range(8)]
    turned = neighbours[side:] + neighbours[:side]
    gone = [_may_go(np.uint64(1), *words) for words in zip(*turned, strict=True)]
    assert [bool(word) for word in gone] == (MAY_GO & (neighbours[side] == 0)).tolist()


def test_thinning_agrees_with_its_slow_twin_on_thousands_of_masks() -> None:
    for seed in range(3000):
        mask = random_mask(seed)
        np.testing.assert_array_equal(fast_skeleton(mask), slow_skeleton(mask), f"seed {seed}")


@pytest.mark.parametrize("order", list(itertools.permutations(ORDER))[1::5])
def test_thinning_agrees_for_any_order_of_sides(order: tuple[int, ...]) -> None:
    for seed in range(12):
        mask = random_mask(seed, largest=25)
        np.testing.assert_array_equal(fast_skeleton(mask, order), slow_skeleton(mask, order))


@pytest.mark.parametrize("width", [62, 63, 64, 126, 200])
def test_thinning_agrees_where_words_and_tiles_meet(width: int) -> None:
    for seed in range(6):
        rng = np.random.default_rng(seed)
        for mask in (wide_blobs(rng, (90, width)), rng.random((40, width)) < 0.7):
            np.testing.assert_array_equal(fast_skeleton(mask)[:, : width + 2], slow_skeleton(mask)[:, : width + 2])


def test_what_is_thin_waits_for_what_is_thick() -> None:
    mask = np.zeros((150, 300), dtype=np.uint8)
    mask[70:73] = 1
    cv2.circle(mask, (150, 71), 60, 1, -1)
    mask[71, 150] = 0  # the disc is peeled from the inside, too
    np.testing.assert_array_equal(fast_skeleton(mask), slow_skeleton(mask))


def test_thinning_keeps_pieces_and_holes_of_thousands_of_masks() -> None:
    for seed in range(4000):
        mask = padded(random_mask(seed))
        skeleton = fast_skeleton(mask[1:-1, 1:-1])[: mask.shape[0], : mask.shape[1]]
        assert ndimage.label(skeleton, EIGHT)[1] == ndimage.label(mask, EIGHT)[1], f"pieces of seed {seed}"
        assert ndimage.label(1 - skeleton)[1] == ndimage.label(1 - mask)[1], f"holes of seed {seed}"


def test_every_mask_of_4_by_4_keeps_its_topology() -> None:
    for bits in range(2**16):
        if bits % 7:  # a seventh of all, spread evenly, keeps the test short
            continue
        mask = np.array([bits >> k & 1 for k in range(16)], dtype=np.uint8).reshape(4, 4)
        skeleton = fast_skeleton(mask)
        assert cv2.connectedComponents(skeleton, connectivity=8)[0] == cv2.connectedComponents(mask, connectivity=8)[0]
        outside = cv2.connectedComponents(1 - skeleton, connectivity=4)[0]
        assert outside == cv2.connectedComponents(1 - padded(mask), connectivity=4)[0]


@given(random_masks)
def test_nothing_more_can_go(mask: np.ndarray) -> None:
    skeleton = fast_skeleton(mask)
    np.testing.assert_array_equal(fast_skeleton(skeleton[1:-1, 1:-1]), padded(skeleton[1:-1, 1:-1]))


def test_skeleton_runs_in_the_middle() -> None:
    points = wave((200, 400))
    skeleton = fast_skeleton(draw_cable(points, 13, (200, 400)))[1:201, 1:401]
    line = draw_cable(points, 1, (200, 400))
    distance = cv2.distanceTransform(1 - line, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    assert distance[skeleton != 0].max() < 2.0


def test_a_drawn_letter() -> None:
    skeleton = fast_skeleton(
        mask_from_text(
            """
            ###########
            ###########
            ###########
            ....###....
            ....###....
            ....###....
            ....###....
            ....###....
            """
        )
    )
    rows, columns = np.nonzero(skeleton)
    assert set(rows[columns < 4].tolist()) == {2}  # the bar's middle row, in the frame's coordinates
    assert set(columns[rows > 4].tolist()) == {6}  # the stem's middle column


@pytest.mark.parametrize("shape", [(1, 1), (2, 2), (1, 30), (30, 1), (64, 64)])
def test_full_masks_shrink_to_one_piece_without_holes(shape: tuple[int, int]) -> None:
    skeleton = fast_skeleton(np.ones(shape, dtype=np.uint8))
    assert ndimage.label(skeleton, EIGHT)[1] == 1
    assert ndimage.label(1 - skeleton)[1] == 1


def test_an_empty_mask_stays_empty() -> None:
    assert not fast_skeleton(np.zeros((5, 7), dtype=np.uint8)).any()
