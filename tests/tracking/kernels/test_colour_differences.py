"""Colours of different objects, against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.tracking.kernels.colour_differences import compare_colours

DARK, COSINE, RATIO = 10.0, 0.966, 2.5


def literal(own: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Return the same by vectors of channels, which black's noise does not turn."""
    own, found = own + DARK, found + DARK
    lengths = np.linalg.norm(own, axis=1)[:, None], np.linalg.norm(found, axis=1)[None]
    other_hue = own @ found.T < COSINE * lengths[0] * lengths[1]
    return other_hue | (np.maximum(*lengths) > RATIO * np.minimum(*lengths))


@given(st.integers(0, 2**31), st.integers(0, 4), st.integers(0, 4))
def test_it_agrees_with_the_literal_twin(seed: int, tracks: int, observations: int) -> None:
    rng = np.random.default_rng(seed)
    own, found = rng.uniform(0.0, 255.0, (tracks, 3)), rng.uniform(0.0, 255.0, (observations, 3))
    own[rng.random(tracks) < 0.2] = np.nan
    np.testing.assert_array_equal(compare_colours(own, found), literal(own, found))


@pytest.mark.parametrize(
    ("other", "differs"),
    [((0, 0, 200), False), ((0, 0, 120), False), ((0, 40, 200), False), ((0, 120, 200), True), ((200, 0, 0), True),
     ((0, 0, 60), True), ((np.nan,) * 3, False)],
)  # fmt: skip
def test_less_light_is_no_other_colour_but_another_hue_is(other: tuple[float, ...], differs: bool) -> None:
    ((told,),) = compare_colours(np.array([[0.0, 0.0, 200.0]]), np.array([other], dtype=np.float64))
    assert told == differs
