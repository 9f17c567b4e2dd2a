"""Times of a topic ascend by one clock, whatever single headers say."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ros import bag_examples as bags

import dloftbs
from dloftbs import sources
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


def read(path):
    with sources.open(path) as source:
        return list(source)


def test_single_headers_without_a_time_do_not_end_the_tracks(tmp_path, caplog):
    """Both clocks are seconds apart, so that one for the frame and the other for the next is an end of the stream."""
    entries = bags.entries(12, depth=False, info=False)
    for i in (0, 1, 4, 7, 8):
        entries[i][2].header.stamp.sec = entries[i][2].header.stamp.nanosec = 0
    path = bags.write_ros2(tmp_path / "run", [(topic, at + 10**12, message) for topic, at, message in entries])
    frames = read(path)
    np.testing.assert_allclose(
        [frame.stamp_ns for frame in frames], [bags.stamp_of(i) for i in range(12)], atol=1000, rtol=0
    )
    assert len(caplog.records) == 1
    assert f"{bags.COLOUR_TOPIC}: a header has no time; it is replaced by the time of the recording" in caplog.text
    assert {track.id for result in dloftbs.track(path, hsv="170:10") for track in result.tracks} == {1}


@pytest.mark.parametrize("back_s", [0.5, 100.0])
def test_headers_that_jump_back_do_not_end_the_tracks(back_s, tmp_path, caplog):
    entries = bags.entries(12, info=False)
    for i in range(5, 12):
        for entry in entries[2 * i : 2 * i + 2]:
            entry[2].header = bags.header(bags.MAKE2, bags.stamp_of(i) - round(back_s * 10**9))
    path = bags.write_ros2(tmp_path / "run", entries)
    frames = read(path)
    assert all(0 < b.stamp - a.stamp < 0.1 for a, b in pairwise(frames))
    assert frames[5].stamp_ns == bags.stamp_of(5) - round(back_s * 10**9)  # results carry on what the header says
    assert [frame.depth[0, 0] for frame in frames] == list(range(600, 612))
    assert len(caplog.records) == 2
    assert "the time of a header does not follow the previous one" in caplog.text
    assert {track.id for result in dloftbs.track(path, hsv="170:10") for track in result.tracks} == {1}


@pytest.mark.parametrize("zero", [False, True])
def test_images_and_depth_on_two_clocks_are_paired_by_the_time_of_recording(zero, tmp_path, caplog):
    entries = bags.entries(6, info=False)
    for i, (_, _, message) in enumerate(entries[1::2]):
        message.header = bags.header(bags.MAKE2, 0 if zero else 7 * 10**9 + i * bags.PERIOD_NS)
    path = bags.write_ros2(tmp_path / "run", entries)
    frames = read(path)
    assert [frame.depth[0, 0] for frame in frames] == list(range(600, 600 + 6))
    assert [frame.stamp_ns for frame in frames] == [bags.stamp_of(i) for i in range(6)]
    assert len(caplog.records) == (0 if zero else 1)  # depth without any time has that of the recording, as images have
    assert zero or "images and depth have two clocks" in caplog.text


def test_depth_that_goes_with_no_image_is_said(tmp_path, caplog):
    entries = bags.entries(6, info=False)
    for _, _, message in entries[1::2]:
        message.header.stamp.nanosec += 400_000_000
    frames = read(bags.write_ros2(tmp_path / "run", entries))
    assert [frame.depth for frame in frames] == [None] * 6
    assert len(caplog.records) == 1
    assert f"frames go without depth: {bags.DEPTH_TOPIC} is at least 0.23" in caplog.text


def test_clocks_that_are_a_second_apart_are_two(tmp_path, caplog):
    """Headers would pair images with the depth of other moments: both streams are longer than that."""
    given = bags.entries(45, info=False)
    for i, (_, _, message) in enumerate(given[1::2]):
        message.header = bags.header(bags.MAKE2, bags.stamp_of(i) + 10**9)
    frames = read(bags.write_ros2(tmp_path / "run", given))
    assert [frame.depth[0, 0] for frame in frames] == list(range(600, 645))
    assert "images and depth have two clocks, their headers are 1.0 s apart" in caplog.text
