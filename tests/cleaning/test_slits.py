"""Slits between cables of a bundle."""

from __future__ import annotations

import numpy as np
import pytest
from linking_examples import draw

from dloftbs.cleaning import clean
from dloftbs.cleaning.slits import close_slits
from dloftbs.config import CleaningConfig


def bundle() -> np.ndarray:
    """Two cables of 10 px side by side, with a slit of 3 px between them over a part of their length."""
    mask = np.zeros((80, 300), np.uint8)
    mask[30:53, 20:280] = 1
    mask[40:43, 80:220] = 0
    return mask


def test_a_slit_is_closed_and_what_is_around_stays():
    framed = np.pad(bundle()[30:53, 20:280], 1)
    before = framed.copy()
    closed = close_slits(framed)
    assert (framed == before).all()
    assert closed[1:-1, 1:-1].all()
    assert not closed[[0, -1]].any()


def test_ground_that_is_wider_than_a_cable_stays():
    mask = np.zeros((62, 102), np.uint8)
    mask[1:11, 1:-1] = mask[41:51, 1:-1] = 1
    assert (close_slits(mask)[:60] == mask[:60]).all()


def test_only_where_objects_branch():
    mask = bundle()
    mask[40:43] = 0  # two cables
    mask[40:43, 20:40] = mask[40:43, 260:280] = 1
    config = CleaningConfig()
    plain, branched = clean(mask, config), clean(mask, config, branched=True)
    assert plain is not None
    assert branched is not None
    assert int(branched.pixels.sum()) == 23 * 260
    assert int(plain.pixels.sum()) <= int(branched.pixels.sum())


@pytest.mark.parametrize("width", [6.0, 7.0, 8.0, 11.0])
def test_a_wedge_is_closed_alike_however_it_lies(width):
    mask = draw([(20, 60), (380, 90)], [(20, 68), (380, 160)], width=width)
    rows, columns = np.nonzero(mask)
    framed = np.pad(mask[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1], 1)
    closed = close_slits(framed)
    assert (closed != framed).any()
    for turned in (np.transpose, np.flipud, np.fliplr):
        assert (close_slits(np.ascontiguousarray(turned(framed))) == turned(closed)).all()
