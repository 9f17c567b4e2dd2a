"""Record of a track's length: how far apart its visible parts may lie."""

from __future__ import annotations

import math

import pytest

from dloftbs.tracking.length_record import LengthRecord


def record_of(length: float, width: float = 6.0, frames: int = 5) -> LengthRecord:
    record = LengthRecord(length)
    for _ in range(frames):
        record.record_full(length, width, 11.0)
    return record


@pytest.mark.parametrize(("hidden", "expected"), [(80.0, False), (100.0, False), (104.0, True), (200.0, True)])
def test_parts_farther_apart_than_the_rest_of_the_length_are_torn(hidden, expected):
    assert record_of(400.0).is_torn(320.0, hidden, 6.0, 11.0) == expected


@pytest.mark.parametrize(("width", "expected"), [(6.0, True), (5.0, True), (9.0, False), (math.nan, True)])
def test_an_object_that_came_nearer_is_longer(width, expected):
    assert record_of(400.0).is_torn(480.0, 120.0, width, 11.0) == expected


def test_without_full_views_the_length_as_it_is_counts():
    assert not LengthRecord(400.0).is_torn(320.0, 100.0, 6.0, 11.0)
    assert LengthRecord(400.0).is_torn(320.0, 110.0, 6.0, 11.0)


def in_space(px_per_m: float = 500.0) -> LengthRecord:
    """Return the record of an object of 0.8 m that is seen as a whole."""
    record = LengthRecord(400.0, px_per_m=px_per_m)
    for noise in (0.0, 1.0, -1.0, 2.0, 0.0):
        record.record_full(400.0 + noise, 6.0, 11.0)
    return record


def test_the_length_in_space_is_the_median_over_full_views():
    assert in_space().metres == pytest.approx(0.8)
    assert LengthRecord(400.0, px_per_m=500.0).metres == pytest.approx(0.8)
    assert math.isnan(LengthRecord(400.0).metres)


def test_a_clearly_different_full_length_starts_it_anew():
    record = in_space()
    record.record_full(300.0, 6.0, 11.0)
    assert record.metres == pytest.approx(0.6)


def test_another_scale_changes_all_lengths_in_the_image_and_none_in_space():
    record = in_space()
    record.rescale(250.0, 3.0)
    assert (record.px, record.usual_px, record.full_width) == (200.0, 200.0, 3.0)
    assert record.metres == pytest.approx(0.8)


def test_an_unknown_scale_changes_nothing():
    record = in_space()
    record.rescale(math.nan, 3.0)
    record.rescale(250.0, 3.0)
    assert (record.px, record.usual_px, record.full_width) == (400.0, 400.0, 6.0)


def test_from_a_mask_alone_the_length_follows_the_width():
    record = record_of(400.0)
    for _ in range(30):
        record.follow_width(9.0)
    assert record.px == pytest.approx(600.0)
    assert record.usual_px == pytest.approx(600.0)
    record.follow_width(math.nan)
    assert record.px == pytest.approx(600.0)


def test_between_two_ends_in_sight_it_is_what_the_view_shows_but_no_more_than_of_the_whole():
    record = record_of(400.0)
    record.follow_tilt(250.0)
    assert record.px == 250.0
    record.follow_tilt(480.0)
    assert record.px == 400.0


def test_a_cut_off_part_is_so_much_shorter_in_space_as_well():
    record = in_space()
    record.cut(0.25)
    assert (record.px, record.metres) == (100.0, pytest.approx(0.2))


def test_another_object_has_no_full_views_yet():
    record = record_of(400.0)
    assert record.usual_px == 400.0
    record.forget_full()
    assert not record.full_px
    assert math.isnan(record.usual_px)
    assert not record.is_usual(400.0, 11.0)
