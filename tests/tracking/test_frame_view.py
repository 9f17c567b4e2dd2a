"""What a frame is asked beyond the ends of curves."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.tracking.frame_view import places_beyond

_DISTANCES = np.array([0.5, 1.0, 1.5])


@given(st.integers(0, 10_000))
def test_they_lie_straight_on_at_their_distances(seed: int) -> None:
    points = np.random.default_rng(seed).uniform(0.0, 100.0, (7, 2))
    places = places_beyond(points[::-1], 12.0).reshape(2, 3, 2)
    for side, (end, before) in enumerate(((points[6], points[5]), (points[0], points[1]))):
        direction = (end - before) / np.linalg.norm(end - before)
        np.testing.assert_allclose(places[side], end + 12.0 * _DISTANCES[:, None] * direction, atol=1e-9)


def test_an_end_without_a_direction_stands_for_what_is_beyond_it() -> None:
    points = np.array([(3.0, 4.0), (3.0, 4.0), (9.0, 4.0)])
    places = places_beyond(points, 10.0)
    np.testing.assert_allclose(places, [(3, 4)] * 3 + [(14, 4), (19, 4), (24, 4)])
