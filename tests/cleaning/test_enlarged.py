"""Masks that were enlarged by repeating their pixels."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from dloftbs import Config, detect
from dloftbs.cleaning import clean
from dloftbs.cleaning.enlarged import smooth_steps
from dloftbs.config import CleaningConfig


def bend(width: int, size: tuple[int, int] = (200, 300)) -> np.ndarray:
    mask = np.zeros(size, np.uint8)
    cv2.polylines(mask, [np.array([[30, 40], [250, 100], [30, 130]])], False, 1, width)
    return mask


def enlarged(mask: np.ndarray, step: int) -> np.ndarray:
    return np.kron(mask, np.ones((step, step), mask.dtype))


@pytest.mark.parametrize("step", [2, 3, 4])
def test_a_sharp_bend_is_one_cable_at_any_size(step: int) -> None:
    small, large = detect(bend(6)), detect(enlarged(bend(6), step))
    assert (len(small), len(large)) == (1, 1)
    middle = 0.5 * (step - 1)  # of a pixel's block
    apart = [np.linalg.norm(large[0].curve(u) - (step * small[0].curve(u) + middle)) for u in (0.0, 0.25, 0.75, 1.0)]
    assert min(max(apart), max(np.linalg.norm(large[0].curve(1 - u) - step * small[0].curve(u)) for u in (0, 1))) < 9


def test_the_edges_are_those_of_a_drawing_at_that_size() -> None:
    rows, columns = np.mgrid[:360, :360]
    disc = np.hypot(rows - 180, columns - 180) < 150
    steps = enlarged(disc[1::3, 1::3], 3)
    assert np.count_nonzero(smooth_steps(steps, 3) != disc) < 0.6 * np.count_nonzero(steps != disc)


def test_what_is_thin_stays_as_it_is() -> None:
    thin = enlarged(bend(1), 3)
    np.testing.assert_array_equal(smooth_steps(thin, 3), thin)


def test_only_the_default_smooths_and_only_what_was_enlarged() -> None:
    steps, config = enlarged(bend(6), 3), CleaningConfig()
    plain, smoothed = clean(steps, config), clean(steps, config, enlarged=True)
    assert not np.array_equal(plain.pixels, smoothed.pixels)
    drawn = bend(18, (600, 900))
    np.testing.assert_array_equal(clean(drawn, config).pixels, clean(drawn, config, enlarged=True).pixels)
    paper = Config.paper()
    assert clean(steps, paper.cleaning).pixels.sum() == pytest.approx(steps.sum(), rel=0.01)
