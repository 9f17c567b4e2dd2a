"""Blocks of centre lines, and where their noise is larger."""

from __future__ import annotations

import numpy as np

from dloftbs.stereo.kernels.line_blocks import block_means, block_noise


def blocks_of(points, radius=5.0):
    points = np.asarray(points, float)
    return block_means(points, np.linspace(0.0, 1.0, len(points)), np.full(len(points), radius), 6, 2.5)


def noise_of(blocks, mask, starts=None):
    noise = np.empty(len(blocks))
    block_noise(blocks, np.array([0, len(blocks)] if starts is None else starts), mask.view(np.uint8), noise)
    return noise


def slanted(count=120):
    x = np.arange(count) + 20.0
    return np.stack((x, 40.0 + 0.4 * x), axis=1)


def band(points, radius, size=(120, 200)):
    rows, columns = np.mgrid[: size[0], : size[1]]
    apart = ((columns[..., None] - points[:, 0]) ** 2 + (rows[..., None] - points[:, 1]) ** 2).min(axis=2)
    return apart <= radius**2


def test_means_of_a_straight_line_lie_on_it():
    blocks = blocks_of(slanted())
    assert np.allclose(blocks[:, 1], 40.0 + 0.4 * blocks[:, 0])
    assert np.allclose(blocks[1:-1, 5] / blocks[1:-1, 4], 0.4)
    assert (np.diff(blocks[:, 2]) > 0.0).all()
    assert np.allclose(blocks[:, 6], 5.0)


def test_a_gap_ends_a_block():
    points = np.concatenate((slanted(30), slanted(30) + np.array([60.0, 24.0])))
    blocks = blocks_of(points)
    assert (blocks[:, 3] < 12.0).all()
    assert not ((blocks[:, 0] > 50.0) & (blocks[:, 0] < 79.0)).any()


def test_many_gaps_make_more_blocks_than_whole_ones():
    pieces = [slanted(4) + np.array([8.0 * k, 3.2 * k]) for k in range(60)]
    blocks = blocks_of(np.concatenate(pieces))
    assert len(blocks) == 60
    assert np.allclose(blocks[:, 1], 40.0 + 0.4 * (blocks[:, 0] - 20.0) + 8.0)


def test_along_pixels_there_is_more_noise_and_in_bends_too():
    line = slanted()
    plain = noise_of(blocks_of(line), band(line, 5.0))
    level = np.stack((np.arange(120) + 20.0, np.full(120, 60.0)), axis=1)
    along = noise_of(blocks_of(level), band(level, 5.0))
    assert along.min() > 5.0 * plain.max() > 0.0
    turn = np.linspace(0.0, 2.5, 60)
    arc = np.stack((80.0 + 20.0 * np.sin(turn), 60.0 - 20.0 * np.cos(turn)), axis=1)
    assert np.median(noise_of(blocks_of(arc), band(arc, 5.0))) > 5.0 * plain.max()


def test_where_masks_merge_there_is_no_middle():
    line = slanted()
    other = line + np.array([0.0, 8.0])
    mask = band(line, 5.0) | band(other[60:], 5.0)
    noise = noise_of(blocks_of(line), mask)
    assert (noise[:6] > 0.0).all()
    assert (noise[12:] < 0.0).all()


def test_two_lines_over_each_other_are_known_by_their_places():
    line = slanted()
    blocks = np.concatenate((blocks_of(line), blocks_of(line[::-1] + np.array([0.0, 3.0]))))
    half = len(blocks) // 2
    noise = noise_of(blocks, np.zeros((120, 200), bool), [0, half, len(blocks)])
    assert (noise < 0.0).all()
