"""Stamping: every pixel against every disc is the slow twin."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dloftbs_lab.synthetic.kernels.stamping import stamp_discs

SIZE = (30, 44)


@given(st.integers(0, 1000), st.integers(0, 12), st.sampled_from((0.5, 1.0 / 3.0, 1e-9)))
def test_it_is_every_pixel_against_every_disc(seed, count, grid):
    rng = np.random.default_rng(seed)
    # On a grid many pixels lie just on a disc's border; some discs lie partly or wholly outside of the image.
    centres = np.rint(rng.uniform(-15.0, 60.0, (count, 2)) / grid) * grid
    radii = np.rint(rng.uniform(0.0, 9.0, count) / grid) * grid
    mask = np.zeros(SIZE, np.bool_)
    stamp_discs(centres, radii, mask)
    rows, columns = np.indices(SIZE)
    slow = np.zeros(SIZE, np.bool_)
    for (x, y), radius in zip(centres, radii, strict=True):
        slow |= (rows - y) ** 2 + (columns - x) ** 2 <= radius**2
    np.testing.assert_array_equal(mask, slow)


def test_what_is_set_stays():
    mask = np.zeros(SIZE, np.bool_)
    mask[3, 4] = True
    stamp_discs(np.array([(20.0, 20.0)]), np.array([0.0]), mask)
    assert np.argwhere(mask).tolist() == [[3, 4], [20, 20]]
