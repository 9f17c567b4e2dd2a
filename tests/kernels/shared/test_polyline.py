"""Lengths and directions of lines through points."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from dloftbs.kernels.shared.polyline import chord_direction, polyline_length

chord_direction = njit(chord_direction)
polyline_length = njit(polyline_length)


@pytest.mark.parametrize("n", [1, 2, 30])
def test_the_length_is_that_of_all_steps(n: int) -> None:
    points = np.random.default_rng(n).uniform(0.0, 100.0, (n, 2))
    assert polyline_length(points) == pytest.approx(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def test_a_chord_points_from_the_one_to_the_other() -> None:
    points = np.array([(1.0, 1.0), (9.0, 9.0), (4.0, 5.0)])
    assert chord_direction(points, 0, 2) == (0.6, 0.8)
    assert chord_direction(points, 2, 0) == (-0.6, -0.8)


def test_a_chord_without_length_points_along_x() -> None:
    assert chord_direction(np.array([(3.0, 4.0), (3.0, 4.0)]), 0, 1) == (1.0, 0.0)
