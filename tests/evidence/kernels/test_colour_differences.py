"""Colours of different objects, against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.evidence.kernels.colour_differences import compare_pairs

DARK, COSINE, RATIO, AGREE = 30.0, 0.966, 2.5, 6


def literal(own: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Return the same of single colours by vectors of channels, which black's noise does not turn."""
    own, found = own + DARK, found + DARK
    lengths = np.linalg.norm(own, axis=1)[:, None], np.linalg.norm(found, axis=1)[None]
    other_hue = own @ found.T < COSINE * lengths[0] * lengths[1]
    return other_hue | (np.maximum(*lengths) > RATIO * np.minimum(*lengths))


def laid_out(objects: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return medians, samples and offsets of objects, each with the samples (k, 3) along it."""
    medians = np.array([np.median(one, axis=0) if len(one) else (np.nan,) * 3 for one in objects]).reshape(-1, 3)
    return medians, np.concatenate([np.zeros((0, 3)), *objects]), np.cumsum([0, *map(len, objects)])


def compared(own: list[np.ndarray], found: list[np.ndarray]) -> np.ndarray:
    pairs = np.indices((len(own), len(found))).reshape(2, -1).T + np.array([0, len(own)])
    return compare_pairs(*laid_out([*own, *found]), pairs).reshape(len(own), len(found))


@given(st.integers(0, 2**31), st.integers(0, 4), st.integers(0, 4))
def test_it_agrees_with_the_literal_twin(seed: int, tracks: int, observations: int) -> None:
    rng = np.random.default_rng(seed)
    own, found = (
        [rng.uniform(0.0, 255.0, 3) + rng.normal(0.0, 30.0, (rng.integers(0, 9), 3)) for _ in range(count)]
        for count in (tracks, observations)
    )
    expected = literal(laid_out(own)[0], laid_out(found)[0])
    for t, mine in enumerate(own):
        for d, theirs in enumerate(found):
            for median, samples in ((laid_out([mine])[0], theirs), (laid_out([theirs])[0], mine)):
                alike = np.count_nonzero(~literal(median, samples))
                expected[t, d] &= AGREE * alike <= len(samples)
    np.testing.assert_array_equal(compared(own, found), expected)


@pytest.mark.parametrize(
    ("other", "differs"),
    [((0, 0, 200), False), ((0, 0, 120), False), ((0, 40, 200), False), ((0, 120, 200), True), ((200, 0, 0), True),
     ((0, 0, 40), True), ((np.nan,) * 3, False)],
)  # fmt: skip
def test_less_light_is_no_other_colour_but_another_hue_is(other: tuple[float, ...], differs: bool) -> None:
    ((told,),) = compared([np.array([[0.0, 0.0, 200.0]])], [np.array([other], dtype=np.float64)])
    assert told == differs


def test_the_shift_of_a_black_cable_in_coded_video_is_no_other_colour() -> None:
    ((told,),) = compared([np.array([[28.0, 29.0, 37.0]])], [np.array([[34.0, 25.0, 18.0]])])
    assert not told


@pytest.mark.parametrize(("like", "differs"), [(0, True), (4, True), (5, False), (10, False)])
def test_a_part_with_the_colour_of_a_part_is_no_other_object(like: int, differs: bool) -> None:
    brown, blue = np.array([20.0, 60.0, 120.0]), np.array([120.0, 60.0, 20.0])
    striped = np.tile(brown, (24, 1))
    striped[:like] = blue
    assert compared([striped], [np.tile(blue, (8, 1))]).tolist() == [[differs]]
    assert compared([np.tile(blue, (8, 1))], [striped]).tolist() == [[differs]]
