"""The parts that need no ROS."""

from __future__ import annotations

import threading

import pytest
from dloftbs_ros.newest import Newest
from dloftbs_ros.parameters import as_type
from dloftbs_ros.publishers import Publisher, choose, silence_text

from dloftbs.errors import ConfigError

IMAGE, JPEG = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"


def test_of_a_burst_each_item_is_answered():
    newest: Newest[int] = Newest()
    for item in range(3):
        newest.put(item, 1.0 + 0.001 * item)
    assert [newest.take(1.0 + 0.005 * turn) for turn in range(1, 4)] == [0, 1, 2]
    assert (newest.dropped, newest.skipped) == (0, 0)


def test_an_item_that_waited_for_long_gives_way_to_newer_ones():
    newest: Newest[int] = Newest()
    for item in range(4):
        newest.put(item, 1.0 + 0.008 * item)
    assert newest.dropped == 1  # the first, when the last came
    assert (newest.take(1.045), newest.dropped) == (3, 3)


def test_the_newest_item_waits_for_as_long_as_it_takes():
    newest: Newest[int] = Newest()
    newest.put(7, 1.0)
    assert (newest.take(9.0), newest.dropped) == (7, 0)


def test_beside_computing_that_is_too_slow_few_items_wait():
    newest: Newest[int] = Newest()
    for item in range(1000):
        newest.put(item, item / 30)
        assert item + 1 - newest.dropped <= 2
    assert (newest.take(1000 / 30), newest.dropped) == (999, 999)


@pytest.mark.parametrize(("rate", "taken"), [(0.0, 300), (10.0, 100), (20.0, 200), (29.0, 290), (60.0, 300)])
def test_a_rate_is_kept_on_the_whole(rate, taken):
    newest: Newest[int] = Newest(rate)
    for item in range(300):
        newest.put(item, 1000.0 + item / 30)
    assert abs(300 - newest.skipped - taken) <= 1


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
