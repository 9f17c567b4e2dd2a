"""Thinning: the slow twin, the table, and the topology that must survive."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
import pytest
from drawings import draw_cable, mask_from_text, random_mask, random_masks, wave
from hypothesis import given
from scipy import ndimage
from skeletons import ORDER, fast_skeleton, padded

from dloftbs.kernels.thinning import DELETION_TABLE, find_border

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
    before = np.empty_like(state)
    while (state != before).any():
        before = state.copy()
        for side in order:
            around = [np.roll(state, (-dr, -dc), (0, 1)) for dr, dc in NEIGHBOURS]
            code = sum(neighbour.astype(int) << bit for bit, neighbour in enumerate(around))
            state = state & ~((around[side] == 0) & MAY_GO[code]).astype(np.uint8)
    return state


def slow_border(frame: np.ndarray) -> list[int]:
    beside = [np.roll(frame, shift, axis) for shift, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1))]
    return np.flatnonzero(frame.astype(bool) & (np.minimum.reduce(beside) == 0)).tolist()


def test_table_agrees_with_counting_pieces() -> None:
    for code in range(256):
        neighbours = [code >> bit & 1 for bit in range(8)]
        for side in ORDER:
            expected = MAY_GO[code] and neighbours[side] == 0
            assert bool(DELETION_TABLE[code] >> (side // 2) & 1) == expected, f"{code:08b} from side {side}"


def test_border_agrees_with_its_slow_twin_on_thousands_of_masks() -> None:
    for seed in range(2000):
        frame = padded(random_mask(seed))
        border, area = find_border(frame.view(np.uint64))
        assert area == frame.sum(), f"seed {seed}"
        assert border.tolist() == slow_border(frame), f"seed {seed}"


def test_border_of_a_wide_block_skips_its_inside() -> None:
    frame = padded(np.ones((20, 60), dtype=np.uint8))
    border, area = find_border(frame.view(np.uint64))
    assert (area, len(border)) == (1200, 2 * 60 + 2 * 18)


def test_thinning_agrees_with_its_slow_twin_on_thousands_of_masks() -> None:
    for seed in range(3000):
        mask = random_mask(seed)
        np.testing.assert_array_equal(fast_skeleton(mask), slow_skeleton(mask), f"seed {seed}")


@pytest.mark.parametrize("order", list(itertools.permutations(ORDER))[1::5])
def test_thinning_agrees_for_any_order_of_sides(order: tuple[int, ...]) -> None:
    for seed in range(12):
        mask = random_mask(seed, largest=25)
        np.testing.assert_array_equal(fast_skeleton(mask, order), slow_skeleton(mask, order))


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
