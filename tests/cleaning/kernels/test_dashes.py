"""Dashes in line, and specks that are not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, turn
from scipy import ndimage
from thin_parts import AROUND, slow_dashes

from dloftbs.cleaning.kernels.dashes import find_dashes

MIN = 20


def pieces_of(mask: np.ndarray) -> list[np.ndarray]:
    labels, count = ndimage.label(mask, AROUND)
    rows, columns = np.nonzero(labels)
    order = np.argsort(labels[rows, columns], kind="stable")
    xy = np.stack((columns, rows), axis=1)[order]
    return np.split(xy, np.cumsum(np.bincount(labels[rows, columns], minlength=count + 1)[1:-1]))


def with_kernel(mask: np.ndarray, least: int = MIN) -> np.ndarray:
    """The mask of the pieces found."""
    pieces, rows = pieces_of(mask), mask.shape[0]
    xy = np.concatenate(pieces)
    pixels = ((xy[:, 0] // 64) * rows + xy[:, 1]) * 64 + xy[:, 0] % 64
    found = find_dashes(pixels, np.cumsum([len(piece) for piece in pieces]), rows, least)
    result = np.zeros_like(mask)
    for piece in np.array(range(len(pieces)))[found]:
        result[pieces[piece][:, 1], pieces[piece][:, 0]] = 1
    return result


def strokes(seed: int, count: int, longest: float, size: tuple[int, int]) -> np.ndarray:
    """Strokes of all directions anywhere."""
    rng, mask = np.random.default_rng(seed), np.zeros(size, np.uint8)
    for _ in range(count):
        start, angle, length = rng.uniform(0, size[::-1]), rng.uniform(0, np.pi), rng.uniform(1, longest)
        end = start + length * np.array([np.cos(angle), np.sin(angle)])
        cv2.line(mask, start.astype(int).tolist(), end.astype(int).tolist(), 1)
    return mask


def dashed(angle: float, dash: float, gap: float, count: int = 9, radius: float = 0.0) -> np.ndarray:
    """Dashes along a line through the middle, or with a radius along an arc."""
    mask = np.zeros((260, 260), np.uint8)
    for k in range(count):
        s = (k - count / 2) * (dash + gap) + np.array([0.0, dash - 1.0])
        x, y = (s, 0 * s) if radius == 0.0 else (radius * np.sin(s / radius), radius * (1 - np.cos(s / radius)))
        ends = 130 + np.stack((x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)), axis=1)
        start, end = np.rint(ends).astype(int).tolist()
        cv2.line(mask, start, end, 1)
    return mask


@pytest.mark.parametrize("seed", range(12))
def test_what_is_found_agrees_with_comparing_each_with_each(seed: int) -> None:
    mask = strokes(seed, 30, 14.0, (120, 200)) | dashed(0.3 * seed, 8.0, 4.0)[70:190, 30:230]
    pieces = pieces_of(mask)
    found = with_kernel(mask)
    expected = slow_dashes(pieces, MIN)
    assert expected.any()
    assert [bool(found[y, x]) for x, y in (piece[0] for piece in pieces)] == expected.tolist()


@pytest.mark.parametrize("angle", np.linspace(0.0, np.pi, 9)[:-1])
@pytest.mark.parametrize(("dash", "gap"), [(4.0, 2.0), (6.0, 5.0), (8.0, 8.0), (12.0, 10.0), (16.0, 16.0)])
def test_dashes_in_line_are_found(angle: float, dash: float, gap: float) -> None:
    mask = dashed(angle, dash, gap)
    np.testing.assert_array_equal(with_kernel(mask), mask)


@pytest.mark.parametrize("radius", [60.0, 100.0, 300.0])
def test_dashes_along_an_arc_are_found(radius: float) -> None:
    mask = dashed(0.4, 10.0, 6.0, radius=radius)
    np.testing.assert_array_equal(with_kernel(mask), mask)


@pytest.mark.parametrize("last", [199, 949])  # the sums of the second exceed 64 bits when squared
def test_dashes_at_the_end_of_a_long_thin_cable_are_found(last: int) -> None:
    mask = np.zeros((200, last + 101), np.uint8)
    x = np.arange(10, last + 1)
    y = 100 + 60 * np.sin(x / 40)
    cv2.polylines(mask, [np.rint(np.stack((x, y), axis=1)).astype(np.int32)], False, 1)
    slope = 1.5 * np.cos(last / 40)
    for k in range(3):
        s = last + 6 + 12 * k + np.array([0, 7])
        ends = np.rint(np.stack((s, y[-1] + slope * (s - last)), axis=1)).astype(int).tolist()
        cv2.line(mask, ends[0], ends[1], 1)
    np.testing.assert_array_equal(with_kernel(mask), mask)


@pytest.mark.parametrize(
    ("count", "longest", "size"), [(8, 18.0, (96, 128)), (60, 14.0, (224, 224)), (1500, 8.0, (480, 640))]
)
def test_specks_anywhere_are_no_line(count: int, longest: float, size: tuple[int, int]) -> None:
    for seed in range(20 if count < 1000 else 3):
        assert not with_kernel(strokes(seed, count, longest, size)).any()


def test_two_dashes_are_no_line() -> None:
    assert not with_kernel(dashed(0.0, 8.0, 6.0, count=2)).any()


def test_dashes_of_fewer_pixels_than_a_thin_cable_are_no_line() -> None:
    mask = dashed(0.0, 4.0, 2.0, count=9)
    assert with_kernel(mask, int(mask.sum())).any()
    assert not with_kernel(mask, int(mask.sum()) + 1).any()


def test_in_much_noise_the_largest_pieces_are_looked_at() -> None:
    dots = np.zeros((260, 1200), np.uint8)
    dots[::6, ::6] = dots[::6, 1::6] = 1
    for added, found in ((dashed(0.0, 10.0, 5.0), True), (dashed(0.0, 2.0, 1.0, count=14), False)):
        mask = dots.copy()
        mask[124:137, :260] = 0
        mask[:, :260] |= added
        assert bool(with_kernel(mask)[130].any()) is found
    assert len(pieces_of(dots)) > 1000


def test_all_eight_versions_have_the_same_dashes() -> None:
    for seed in range(6):
        mask = strokes(seed, 25, 14.0, (120, 200)) | dashed(0.5 * seed, 7.0, 5.0)[70:190, 30:230]
        found = with_kernel(mask)
        for how in EIGHT_VERSIONS:
            turned = np.ascontiguousarray(turn(mask, *how))
            np.testing.assert_array_equal(with_kernel(turned), turn(found, *how))
