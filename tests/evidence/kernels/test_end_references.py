"""Colours before ends, against a slow twin."""

from __future__ import annotations

import numpy as np
from gap_scenes import Scene, literal_references, literal_spread
from hypothesis import given
from hypothesis import strategies as st

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
