"""Record of a track's length: how far apart its visible parts may lie."""

from __future__ import annotations

import math

import pytest

from dloftbs.tracking.length_record import LengthRecord


def record_of(length: float, width: float = 6.0, frames: int = 5) -> LengthRecord:
    record = LengthRecord(length)
    for hits in range(frames):
        record.record_full(length, width, hits)
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
