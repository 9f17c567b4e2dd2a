"""The parts that need no ROS."""

from __future__ import annotations

import threading

import pytest
from dloftbs_ros.newest import Newest
from dloftbs_ros.parameters import as_type
from dloftbs_ros.publishers import Publisher, choose, silence_text

from dloftbs.errors import ConfigError

IMAGE, JPEG = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"


def taken_every(busy_s: float) -> tuple[Newest[int], float]:
    """Return one from which an item was taken every so many seconds, and the time after that."""
    newest: Newest[int] = Newest()
    for turn in range(20):
        newest.put(-1, turn * busy_s)
        newest.take(turn * busy_s)
    return newest, 20 * busy_s


def test_at_first_the_newest_wins():
    newest: Newest[int] = Newest()
    for item in range(3):
        newest.put(item)
    assert (newest.take(), newest.dropped, newest.skipped) == (2, 2, 0)


def test_of_a_burst_each_item_is_answered_if_that_is_quickly_done():
    newest, now = taken_every(0.005)
    for item in range(4):
        newest.put(item, now)
    assert [newest.take(now + 0.005 * turn) for turn in range(4)] == [0, 1, 2, 3]
    assert newest.dropped == 0


def test_a_stall_is_not_taken_for_the_time_that_an_item_takes():
    newest, now = taken_every(0.005)
    now += 0.5
    for item in range(4):
        newest.put(item, now)
    assert [newest.take(now + 0.005 * turn) for turn in range(4)] == [0, 1, 2, 3]


@pytest.mark.parametrize(("busy_s", "waiting"), [(0.0001, 10), (0.0045, 10), (0.009, 5), (0.015, 3), (0.021, 0)])
def test_the_newest_waits_for_no_longer_than_it_may(busy_s, waiting):
    newest, now = taken_every(busy_s)
    for item in range(1000):
        newest.put(item, now)
    assert newest.take(now) == 999 - waiting
    assert newest.dropped == 999 - waiting


@pytest.mark.parametrize(("rate", "taken"), [(0.0, 300), (10.0, 100), (20.0, 200), (29.0, 290), (60.0, 300)])
def test_a_rate_is_kept_on_the_whole(rate, taken):
    newest: Newest[int] = Newest(rate)
    for item in range(300):
        newest.put(item, 1000.0 + item / 30)
    assert abs(300 - newest.skipped - taken) <= 1
    assert newest.dropped == 300 - newest.skipped - 1


def test_after_a_pause_no_burst_is_let_through():
    newest: Newest[int] = Newest(1.0)
    for now in (0.0, 100.0, 100.1, 100.2, 100.3):
        newest.put(0, now)
    assert newest.skipped == 2  # one comes early


def test_who_waits_goes_on_when_it_is_closed():
    newest: Newest[int] = Newest()
    got = []
    waiting = threading.Thread(target=lambda: got.append(newest.take()))
    waiting.start()
    newest.close()
    waiting.join(10)
    assert got == [None]


@pytest.mark.parametrize(
    ("offers", "reliability", "chosen", "said"),
    [
        ([], "auto", None, ""),
        ([(IMAGE, True)], "auto", (IMAGE, True), ""),
        ([(JPEG, False)], "auto", (JPEG, False), ""),
        ([(IMAGE, True), (IMAGE, False)], "auto", (IMAGE, False), ""),
        ([(IMAGE, True)], "best_effort", (IMAGE, False), ""),
        ([(IMAGE, False)], "reliable", (IMAGE, True), "best effort"),
        ([("std_msgs/msg/String", True)], "auto", None, "must be of type sensor_msgs/msg/Image"),
        ([("std_msgs/msg/String", True), (JPEG, True)], "auto", (JPEG, True), ""),
    ],
)
def test_type_and_reliability_are_those_of_who_publishes(offers, reliability, chosen, said):
    found, problem = choose([Publisher("/a", *offer) for offer in offers], (IMAGE, JPEG), reliability)
    assert found == chosen
    assert said in (problem or "") and bool(said) == (problem is not None)


@pytest.mark.parametrize(
    ("present", "said"),
    [
        ([], "nobody publishes images"),
        ([Publisher("/b", JPEG, False)], "one of: /b (sensor_msgs/msg/CompressedImage, best effort)"),
        ([Publisher("/a", IMAGE, True)], "though it is published"),
    ],
)
def test_silence_is_explained(present, said):
    text = silence_text("/a", 5.2, [*present, Publisher("/c", "std_msgs/msg/String", True)])
    assert text.startswith("no image on /a for 5 s")
    assert said in text and "/c" not in text


@pytest.mark.parametrize(("value", "default", "taken"), [(1, "", "1"), (5, 0.0, 5.0), (2, 0, 2), ("a", "", "a")])
def test_a_parameter_comes_in_the_type_of_its_default(value, default, taken):
    got = as_type("name", value, default)
    assert got == taken and type(got) is type(taken)


@pytest.mark.parametrize(("value", "default"), [("a", 0), (2.5, 0), (True, 0), ("5", 0.0), (["a"], ""), (None, "")])
def test_another_type_is_refused(value, default):
    with pytest.raises(ConfigError, match="the parameter name must be"):
        as_type("name", value, default)
