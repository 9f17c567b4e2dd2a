"""Colours before ends, against a slow twin."""

from __future__ import annotations

import numpy as np
import pytest
from gap_scenes import Scene, literal_references, literal_spread
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.evidence.kernels.end_references import BACK_WIDTHS, REACH_WIDTHS, sample_cables

seeds = st.integers(0, 2**31)


@given(seeds)
def test_references_are_the_colours_before_the_ends_and_beside_them(seed: int) -> None:
    scene = Scene(seed)
    ground, grounds, cable, cables, middle, spread = scene.references()
    for e, end in enumerate(scene.ends.tolist()):
        expected_ground, expected_cable = literal_references(scene, end)
        np.testing.assert_allclose(ground[e, : grounds[e]], expected_ground)
        np.testing.assert_allclose(cable[e, : cables[e]], expected_cable)
        np.testing.assert_allclose(middle[e], np.median(expected_ground, axis=0) if grounds[e] else np.zeros(3))
        np.testing.assert_allclose(spread[e], literal_spread(expected_ground))


@pytest.mark.parametrize("length", [4, 25, 40, 80, 200])
@pytest.mark.parametrize("end", [0, 1])
def test_the_colour_of_a_cable_is_that_before_its_end_or_in_the_middle_of_a_short_one(length: int, end: int) -> None:
    """Levels of grey say how far along the cable a place is."""
    width = 10.0
    image = np.tile(np.arange(240, dtype=np.uint8)[None, :, None], (30, 1, 3))
    points = np.column_stack((np.arange(20.0, 220.0), np.full(200, 15.0)))
    colours, samples, offsets = sample_cables(image, points, np.array([(0, length)]), np.array([end]), width)
    assert offsets.tolist() == [0, len(samples)]
    away = samples[:, 0] - 20.0 if end == 0 else 20.0 + length - 1.0 - samples[:, 0]
    first = min(BACK_WIDTHS * width, 0.25 * length)
    assert np.isnan(colours).all() == (len(samples) < 3) == (length < 28)
    assert (away > first - 1.5).all()
    assert (away < min(REACH_WIDTHS * width, length)).all()
    if length > 28:
        np.testing.assert_allclose(colours[0], np.median(samples, axis=0))
        assert away.min() < first + 1.5
