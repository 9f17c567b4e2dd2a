"""Time of a stream: what a frame takes, and how much of that had no frames."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import pytest

from dloftbs.tracking.stream_clock import Step, StreamClock

FRAME_S = 1.0 / 30.0


def clock_after(stamps: Iterable[float | None]) -> StreamClock:
    clock = StreamClock(FRAME_S)
    for stamp in stamps:
        clock.advance(stamp)
    return clock


@pytest.mark.parametrize("rate", [1000.0, 60.0, 30.0, 29.97, 7.5, 4.0])
@pytest.mark.parametrize("start", [0.0, 1.7e9])
def test_no_frame_is_missing_at_a_regular_rate(rate: float, start: float) -> None:
    clock = StreamClock(FRAME_S)
    stamps = [start + k / rate for k in range(100)]
    steps = [clock.advance(stamp) for stamp in stamps]
    assert [step.seconds for step in steps[1:]] == [after - before for before, after in pairwise(stamps)]
    assert {step.frameless_s for step in steps} == {0.0}


@pytest.mark.parametrize("rate", [30.0, 7.5, 0.5])
def test_frames_that_were_due_and_did_not_come_are_missing(rate: float) -> None:
    clock = clock_after(k / rate for k in range(10))
    assert clock.step_to(11.0 / rate).frameless_s == pytest.approx(1.0 / rate)
    assert clock.step_to(9.0 / rate + 3600.0).frameless_s == pytest.approx(3600.0 - 1.0 / rate)


def test_the_second_of_two_pauses_is_one_too() -> None:
    clock = clock_after([*(k / 30.0 for k in range(6)), 100.0])
    assert clock.advance(200.0).frameless_s == pytest.approx(100.0 - FRAME_S)
    assert clock.advance(200.0 + FRAME_S).frameless_s == 0.0


def test_the_first_step_shows_how_long_a_frame_takes_and_is_no_pause() -> None:
    assert clock_after([0.0]).step_to(7200.0) == Step(7200.0, 0.0)


def test_the_rate_may_change() -> None:
    clock = clock_after([*(k / 30.0 for k in range(10)), *range(1, 6)])
    assert clock.advance(6.0) == Step(1.0, 0.0)


@pytest.mark.parametrize("frame_s", [FRAME_S, 5.0])
def test_a_slow_stream_has_no_pause_at_the_start(frame_s: float) -> None:
    clock = StreamClock(frame_s)
    assert [clock.advance(stamp) for stamp in (0.0, 5.0, 10.0)] == [Step(frame_s, 0.0), *[Step(5.0, 0.0)] * 2]


def test_the_time_of_frames_without_a_stamp_is_counted_once() -> None:
    clock = clock_after([0.0, None, None])
    assert clock.step_to(0.2).seconds == pytest.approx(0.2 - 2.0 * FRAME_S)
    assert clock.advance(0.2).seconds == pytest.approx(0.2 - 2.0 * FRAME_S)
    assert clock.advance(0.3).seconds == pytest.approx(0.1)


def test_frames_without_a_stamp_that_took_less_than_assumed_leave_no_time_but_some() -> None:
    clock = clock_after([0.0, None, None])
    assert 0.0 < clock.step_to(0.05).seconds <= 1e-6
    assert clock.step_to(0.0) == Step(0.0, 0.0)
    assert clock.step_to(-0.01).seconds == -0.01


def test_a_repetition_and_an_earlier_stamp_take_no_time() -> None:
    clock = clock_after([0.0, 1.0])
    assert clock.advance(1.0 + 1e-7) == Step(0.0, 0.0)
    assert clock.stamp == 1.0
    assert clock.step_to(0.5).seconds < 0.0
