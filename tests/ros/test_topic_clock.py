"""Times of a topic ascend by one clock, whatever single headers say."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from dloftbs.ros.message_fields import NS_PER_S
from dloftbs.ros.topic_clock import TopicClock

MS = 1_000_000
HOURS = 3600 * NS_PER_S


def times(messages, offset_ms=0):
    """Return the times in ms, and which deviate, of pairs of the times in headers and in the recording, in ms."""
    clock = TopicClock(None if offset_ms is None else offset_ms * MS)
    found = [
        (clock.time_ns(None if header is None else header * MS, log * MS) // MS, clock.deviates)
        for header, log in messages
    ]
    return [time for time, _ in found], [i for i, (_, deviates) in enumerate(found) if deviates]


def test_headers_that_go_on_are_taken_as_they_are():
    assert times([(100, 5000), (133, 5001), (150, 5090), (9000, 13_900)], -4900) == ([100, 133, 150, 9000], [])


def test_a_header_without_a_time_goes_on_by_the_recording():
    assert times([(100, 5000), (None, 5033), (None, 5066), (200, 5100)], -4900) == ([100, 133, 166, 200], [1, 2])


def test_the_first_headers_may_have_no_time():
    assert times([(None, 5000), (133, 5033)], -4900) == ([100, 133], [0])


def test_without_any_time_in_headers_it_is_that_of_the_recording():
    assert times([(None, 5000), (None, 5033), (7, 5066)], None) == ([5000, 5033, 5066], [])


def test_headers_that_jump_back_go_on_by_the_recording_from_there():
    messages = [(1000, 0), (1033, 33), (33, 66), (66, 99), (99, 132)]
    assert times(messages, 1000) == ([1000, 1033, 1066, 1099, 1132], [2, 3, 4])


def test_one_header_of_another_clock_changes_nothing():
    for odd in (5, 10**9):
        assert times([(1000, 0), (odd, 33), (1066, 66)], 1000) == ([1000, 1033, 1066], [1])


def test_slow_recordings_and_those_that_were_converted_keep_their_times():
    assert times([(0, 7), (50_000, 7), (100_000, 7)]) == ([0, 50_000, 100_000], [])  # all recorded at once
    assert times([(0, 0), (10**7, 10**7)]) == ([0, 10**7], [])


@given(st.lists(st.tuples(st.none() | st.integers(1, 10**6), st.integers(0, 10**6)), max_size=20), st.booleans())
def test_times_never_go_back(messages, is_sorted):
    messages = [(header, log) for (header, _), log in zip(messages, sorted(log for _, log in messages), strict=True)]
    found, _ = times(messages)
    assert found == sorted(found)
    assert found == times(messages)[0]
