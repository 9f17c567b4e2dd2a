"""Skeleton to segments."""

from __future__ import annotations

import numpy as np
from drawings import mask_from_text, random_masks
from hypothesis import given

from dloftbs.cleaning import clean
from dloftbs.config import CleaningConfig, GreedyLinkingConfig
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.pipeline.published import Walks, make_segments, walk
from dloftbs.skeleton import skeletonize

THIN = CleaningConfig(open_px=1, close_px=1, thin_px=0, fill_holes=False)


def walks_of(mask: np.ndarray, min_length_px: int) -> tuple[MaskCrop, Walks]:
    crop = clean(mask, THIN)
    assert crop is not None
    return crop, walk(skeletonize(crop), GreedyLinkingConfig(min_length_px=min_length_px))


PLUS = mask_from_text(
    """
    .....#.....
    .....#.....
    .....#.....
    .....#.....
    ###########
    .....#.....
    .....#.....
    """
)


def test_a_plus_falls_into_four_arms() -> None:
    _, walks = walks_of(PLUS, 2)
    # The middle has four neighbours and its four neighbours have more than two: the arms begin behind them.
    assert sorted(map(len, walks.open)) == [3, 4, 4]
    assert list(map(len, walks.short)) == [1]
    assert walks.loops == []


def test_segments_shorter_than_p_are_dropped() -> None:
    _, walks = walks_of(PLUS, 4)
    assert sorted(map(len, walks.open)) == [4, 4]
    assert sorted(map(len, walks.short)) == [1, 3]


def test_a_segment_of_exactly_p_pixels_stays() -> None:
    mask = np.ones((1, 10), dtype=np.uint8)
    assert len(walks_of(mask, 10)[1].open) == 1
    assert len(walks_of(mask, 11)[1].open) == 0


def test_a_ring_is_a_loop() -> None:
    mask = np.ones((20, 30), dtype=np.uint8)
    mask[4:-4, 4:-4] = 0
    _, walks = walks_of(mask, 10)
    assert (len(walks.open), len(walks.loops)) == (0, 1)


def test_a_short_loop_is_dropped() -> None:
    _, walks = walks_of(mask_from_text(".#.\n#.#\n.#."), 5)
    assert (len(walks.open), len(walks.loops), list(map(len, walks.short))) == (0, 0, [4])


@given(random_masks)
def test_no_pixel_is_lost_but_the_branch_points(mask: np.ndarray) -> None:
    crop = clean(mask, THIN)
    if crop is None:
        return
    skeleton = skeletonize(crop)
    walks = walk(skeleton, GreedyLinkingConfig(min_length_px=3))
    walked = [tuple(p) for run in walks.open + walks.loops + walks.short for p in run.astype(int).tolist()]
    kept = skeleton.pixels_rc[~skeleton.is_branch_point][:, ::-1]
    assert sorted(walked) == sorted(map(tuple, kept.tolist()))


def test_radius_belongs_to_its_own_segment() -> None:
    mask = np.zeros((60, 100), dtype=np.uint8)
    mask[10:13, 5:95] = 1  # 3 px wide
    mask[30:45, 5:95] = 1  # 15 px wide
    crop, walks = walks_of(mask, 20)
    widths = sorted(2 * float(np.median(segment.radius)) for segment in make_segments(crop, walks.open))
    np.testing.assert_allclose(widths, [3.0, 15.0], atol=0.5)


def test_no_runs_make_no_segments() -> None:
    crop, _ = walks_of(PLUS, 2)
    assert make_segments(crop, []) == []
