"""Depth, or a mask, goes to the image of its moment, in order and in bounded memory."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.ros.stamp_pairing import (
    MASK_TOLERANCE_S,
    MOST_RECORDED,
    RECORDED_S,
    WAITING,
    WAITING_FOR_MASKS,
    StampPairing,
)

MS = 1_000_000
STAMPS = st.lists(st.integers(0, 400), max_size=12, unique=True).map(sorted)


def paired(arrivals):
    """Return the pairs of (is_image, stamp in ms) that arrive in this order."""
    pairing: StampPairing[int, int] = StampPairing(0.02)
    found = []
    for is_image, stamp in arrivals:
        found += (pairing.add_image if is_image else pairing.add_partner)(stamp * MS, stamp)
    return [*found, *pairing.rest()]


def nearest(image, depths):
    best = min(depths, key=lambda depth: abs(depth - image), default=None)
    return None if best is None or abs(best - image) > 20 else abs(best - image)


@given(STAMPS, STAMPS, st.integers(0, 60))
def test_each_image_has_the_nearest_depth_while_arrivals_are_late_by_little(images, depths, late):
    arrivals = sorted([(at, True, at) for at in images] + [(at + late, False, at) for at in depths])
    found = paired([(is_image, stamp) for _, is_image, stamp in arrivals])
    assert [image for image, _ in found] == images
    if len(images) <= WAITING:
        assert [None if depth is None else abs(depth - image) for image, depth in found] == [
            nearest(image, depths) for image in images
        ]


def test_images_do_not_wait_for_ever():
    pairing: StampPairing[int, int] = StampPairing(0.02)
    out = [len(list(pairing.add_image(i * MS, i))) for i in range(3 * WAITING)]
    assert out == [0] * WAITING + [1] * (2 * WAITING)
    assert list(pairing.rest()) == [(i, None) for i in range(2 * WAITING, 3 * WAITING)]


def test_depth_without_images_is_forgotten():
    pairing: StampPairing[int, int] = StampPairing(0.02)
    for i in range(10_000):
        assert not list(pairing.add_partner(i * MS, i))
    assert list(pairing.add_image(5 * MS, -1)) == [(-1, None)]


def test_after_time_went_back_images_get_the_partners_of_their_time_again():
    pairing: StampPairing[int, int] = StampPairing(MASK_TOLERANCE_S, WAITING_FOR_MASKS)
    found = []
    for start in (0, 0, 50_000, 0):  # a recording of 10 s in a loop, and the reset of a simulator
        for at in range(start, start + 10_000, 100):
            found += pairing.add_image(at * MS, at)
            found += pairing.add_partner(at * MS, at)
    assert len(found) == 400
    assert all(image == mask for image, mask in found)


def test_what_waits_where_time_goes_back_comes_out_and_partners_that_came_first_are_kept():
    pairing: StampPairing[int, int] = StampPairing(0.02)
    assert not [*pairing.add_image(9000 * MS, 9000), *pairing.add_image(9033 * MS, 9033)]
    assert not list(pairing.add_partner(10 * MS, 10))
    assert list(pairing.add_image(5 * MS, 5)) == [(9000, None), (9033, None), (5, 10)]


def test_images_that_overtake_each_other_do_not_begin_anew():
    pairing: StampPairing[int, int] = StampPairing(0.02)
    assert not list(pairing.add_image(1000 * MS, 1000))
    assert not list(pairing.add_image(100 * MS, 100))
    assert list(pairing.add_partner(1000 * MS, 1000)) == [(1000, 1000), (100, None)]


@pytest.mark.parametrize(("rate", "late_ms"), [(30, 900), (90, 900), (90, -900), (2, 3500)])
def test_images_wait_for_a_time_where_one_is_asked_for(rate, late_ms):
    pairing: StampPairing[int, int] = StampPairing(0.02, waiting_s=RECORDED_S, most=MOST_RECORDED)
    stamps = [1000 * i // rate for i in range(300)]
    arrivals = sorted([(at, True, at) for at in stamps] + [(at + late_ms, False, at) for at in stamps])
    found = []
    for _, is_image, at in arrivals:
        found += (pairing.add_image if is_image else pairing.add_partner)(at * MS, at)
    assert [*found, *pairing.rest()] == [(at, at) for at in stamps]
    assert pairing.missed == 0


@pytest.mark.parametrize("is_late", [True, False])
def test_what_waits_for_a_time_is_bounded_in_number_and_what_misses_it_is_counted(is_late):
    pairing: StampPairing[int, int] = StampPairing(0.0, waiting_s=RECORDED_S, most=MOST_RECORDED)
    add_first, add_then = (pairing.add_image, pairing.add_partner)[:: 1 if is_late else -1]
    found = [pair for at in range(500) for pair in add_first(at * MS, at)]
    found += [pair for at in range(500) for pair in add_then(at * MS, at)]
    found += pairing.rest()
    assert sorted(found) == [(at, None) for at in range(500 - MOST_RECORDED)] + [
        (at, at) for at in range(500 - MOST_RECORDED, 500)
    ]
    assert pairing.missed == 500 - MOST_RECORDED


def test_images_that_have_no_partner_anywhere_miss_none():
    pairing: StampPairing[int, int] = StampPairing(0.02)
    for at in range(0, 3000, 33):
        assert all(depth is None for _, depth in pairing.add_image(at * MS, at))
    for at in range(3100, 6000, 33):
        assert all(depth is None for _, depth in pairing.add_partner(at * MS, at))
    assert pairing.missed == 0


def test_half_the_rate_of_depth_leaves_every_other_image_without():
    found = paired([(kind, at) for at in range(0, 330, 33) for kind in ((False, True) if at % 66 == 0 else (True,))])
    assert [depth is not None for _, depth in found] == [True, False] * 5
