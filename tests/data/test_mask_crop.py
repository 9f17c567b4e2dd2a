"""The canonical orientation: all eight versions of a mask come to the same view, and points find back to the image."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from drawings import mask_from_text, random_mask, versions
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.cleaning import clean
from dloftbs.config import CleaningConfig
from dloftbs.data.mask_crop import MaskCrop, Orientation, Skeleton

AS_IT_IS = CleaningConfig(open_px=1, close_px=1, fill_holes=False)
ORIENTATIONS = [Orientation(*flags) for flags in product((False, True), repeat=3)]

TIES = {
    "dot": "#",
    "square": "## ##",
    "plus": ".#. ### .#.",
    "ring": "### #.# ###",
    "bar": "####",
    "skew": ".## ##.",  # looks the same after half a turn only
    "pinwheel": "..#.. #.#.. ##### ..#.# ..#..",  # after a quarter turn only
    "arrow": ".#. ### #.#",  # in one mirror only
    "diagonal": "#.. ### .##",  # in a diagonal mirror only
    "heavy corner": "##. #.. ...",
    "moments tie, shapes differ": "#..#.. ...... ..##.. #....#",
}

seeds = st.integers(0, 100_000)


def crop_of(mask: np.ndarray) -> MaskCrop:
    crop = clean(mask, AS_IT_IS)
    assert crop is not None
    return crop


def view_of(mask: np.ndarray) -> np.ndarray:
    crop = crop_of(mask)
    return crop.oriented(crop.pixels)


def assert_all_versions_agree(mask: np.ndarray) -> None:
    first, *others = (view_of(version) for version in versions(mask))
    for other in others:
        np.testing.assert_array_equal(other, first)


def some_mask(seed: int) -> np.ndarray:
    mask = random_mask(seed, largest=14)
    mask[seed % mask.shape[0], seed % mask.shape[1]] = 1
    return mask


def made_symmetric(mask: np.ndarray, kind: int) -> np.ndarray:
    side = min(mask.shape)
    square = mask[:side, :side]
    match kind:
        case 0:
            return mask | mask[:, ::-1]
        case 1:
            return mask | mask[::-1, ::-1]
        case 2:
            return square | square.T
        case 3:
            return square | np.rot90(square) | np.rot90(square, 2) | np.rot90(square, 3)
        case _:
            return np.bitwise_or.reduce(versions(square))


class TestCanonicalPose:
    @given(seeds)
    def test_all_versions_of_a_random_mask_look_the_same(self, seed):
        assert_all_versions_agree(some_mask(seed))

    @given(seeds, st.integers(0, 4))
    def test_all_versions_of_a_symmetric_mask_look_the_same(self, seed, kind):
        mask = made_symmetric(some_mask(seed), kind)
        if mask.any():
            assert_all_versions_agree(mask)

    @pytest.mark.parametrize("text", TIES.values(), ids=TIES)
    def test_all_versions_of_a_drawing_look_the_same(self, text):
        assert_all_versions_agree(mask_from_text("\n".join(text.split())))

    def test_there_is_one_view_for_each_shape_of_3_by_3(self):
        shapes = {}
        for bits in range(1, 512):
            mask = np.array([bits >> i & 1 for i in range(9)], np.uint8).reshape(3, 3)
            rows, columns = mask.any(axis=1).nonzero()[0], mask.any(axis=0).nonzero()[0]
            first = mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
            shape = frozenset((v.shape, v.tobytes()) for v in versions(first))
            view = view_of(mask)
            shapes.setdefault(shape, set()).add((view.shape, view.tobytes()))
        assert {len(views) for views in shapes.values()} == {1}
        assert len({view for views in shapes.values() for view in views}) == len(shapes)

    @given(seeds)
    def test_the_wider_side_becomes_the_columns(self, seed):
        height, width = view_of(some_mask(seed)).shape
        assert width >= height

    @given(seeds)
    def test_the_same_mask_elsewhere_has_the_same_pose(self, seed):
        mask = some_mask(seed)
        moved = np.pad(mask, ((3, 1), (2, 5)))
        np.testing.assert_array_equal(view_of(moved), view_of(mask))
        assert crop_of(moved).orientation == crop_of(mask).orientation


class TestPose:
    @pytest.mark.parametrize("orientation", ORIENTATIONS)
    def test_an_orientation_is_a_view(self, orientation):
        array = np.arange(6, dtype=np.uint8).reshape(2, 3)
        view = orientation.view(array)
        assert np.shares_memory(view, array)
        assert view.shape == ((3, 2) if orientation.transpose else (2, 3))

    def test_the_eight_poses_are_the_eight_versions(self):
        array = np.arange(6, dtype=np.uint8).reshape(2, 3)
        assert len({(v.shape, v.tobytes()) for v in (orientation.view(array) for orientation in ORIENTATIONS)}) == 8
        expected = {(v.shape, v.tobytes()) for v in versions(array)}
        assert {(v.shape, v.tobytes()) for v in (orientation.view(array) for orientation in ORIENTATIONS)} == expected

    def test_columns_and_rows_are_flipped_before_they_are_exchanged(self):
        array = np.array([[1, 2, 3], [4, 5, 6]], dtype=np.uint8)
        np.testing.assert_array_equal(Orientation(True, False, False).view(array), [[3, 2, 1], [6, 5, 4]])
        np.testing.assert_array_equal(Orientation(False, True, False).view(array), [[4, 5, 6], [1, 2, 3]])
        np.testing.assert_array_equal(Orientation(True, False, True).view(array), [[3, 6], [2, 5], [1, 4]])


class TestCoordinates:
    @given(seeds, st.sampled_from(ORIENTATIONS))
    def test_oriented_points_find_back_to_the_image(self, seed, orientation):
        mask = some_mask(seed)
        crop = replace(crop_of(mask), orientation=orientation)
        oriented_rc = np.argwhere(crop.oriented(crop.pixels))
        xy = crop.to_image(oriented_rc[:, ::-1].astype(np.float64))
        expected = np.argwhere(mask)[:, ::-1]
        assert sorted(map(tuple, xy.tolist())) == sorted(map(tuple, expected.tolist()))

    @given(seeds, st.sampled_from(ORIENTATIONS))
    def test_an_oriented_point_keeps_to_its_pixel(self, seed, orientation):
        mask = np.pad(some_mask(seed), 1)
        crop = replace(crop_of(mask), orientation=orientation)
        numbers = np.zeros(crop.pixels.shape, np.uint8)
        (h, w), (x0, y0) = crop.size, crop.origin
        row, column = seed % (h + 2), (seed // 7) % (w + 2)
        numbers[row, column] = 1
        oriented_rc = np.argwhere(crop.oriented(numbers))
        np.testing.assert_array_equal(
            crop.to_image(oriented_rc[:, ::-1].astype(np.float64)), [[x0 + column - 1, y0 + row - 1]]
        )

    @given(seeds)
    def test_the_transform_is_rigid_and_the_same_for_all_points(self, seed):
        crop = crop_of(some_mask(seed))
        matrix, offset = crop.image_transform
        np.testing.assert_array_equal(matrix @ matrix.T, np.eye(2))
        points = np.random.default_rng(seed).normal(size=(4, 2))
        np.testing.assert_array_equal(crop.to_image(points), points @ matrix.T + offset)

    @given(seeds)
    def test_a_posed_view_has_an_empty_margin_of_one(self, seed):
        crop = crop_of(some_mask(seed))
        view = crop.oriented(crop.pixels)
        assert np.shares_memory(view, crop.pixels)
        inner = view[1:-1, 1:-1]
        assert view.sum() == inner.sum() == crop.pixels.sum()
        assert inner[[0, -1]].any(axis=1).all()
        assert inner[:, [0, -1]].any(axis=0).all()


def test_the_kinds_of_skeleton_pixels_follow_from_their_neighbours():
    skeleton = Skeleton(np.zeros((3, 3), np.uint8), np.zeros((5, 2), np.int32), np.arange(5, dtype=np.uint8))
    np.testing.assert_array_equal(skeleton.is_endpoint, [False, True, False, False, False])
    np.testing.assert_array_equal(skeleton.is_branch_point, [False, False, False, True, True])
