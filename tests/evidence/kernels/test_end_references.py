"""Colours before ends, against a slow twin."""

from __future__ import annotations

import numpy as np
from gap_scenes import COLOURS, Scene, literal_references, literal_spread
from hypothesis import given
from hypothesis import strategies as st

seeds = st.integers(0, 2**31)


@given(seeds)
def test_references_are_the_colours_before_the_ends_and_beside_them(seed: int) -> None:
    scene = Scene(seed)
    ground, grounds, cable, cables, spread = scene.references()
    for e, end in enumerate(scene.ends.tolist()):
        expected_ground, expected_cable = literal_references(scene, end)
        np.testing.assert_allclose(ground[e, : grounds[e]], expected_ground)
        np.testing.assert_allclose(cable[e, : cables[e]], expected_cable)
        np.testing.assert_allclose(spread[e], [literal_spread(expected_ground), literal_spread(expected_cable)])


def test_what_lies_on_one_side_of_a_cable_alone_is_no_ground() -> None:
    """It may be what hides the cable, and lie along it before it does."""
    scene = Scene(0)
    scene.image[:] = COLOURS[0]
    scene.mask[:], scene.width = 0, 6.0
    scene.mask[42:48, 10:100] = 1
    scene.points, scene.spans = np.column_stack((np.arange(10.0, 100.0), np.full(90, 44.5))), np.array([[0, 90]])
    scene.ends = np.array([0, 1])
    scene.image[:42, 80:] = COLOURS[2]  # a cover that comes up to the cable's end from one side
    ground, grounds, *_ = scene.references()
    assert grounds.min() >= 6
    assert (np.concatenate([own[:count] for own, count in zip(ground, grounds, strict=True)]) == COLOURS[0]).all()
