"""Loops side by side give what one loop gives: the same items, the same order, the same errors."""

from __future__ import annotations

import threading
import time
import weakref

import pytest

from dloftbs.support import overlap
from dloftbs.support.overlap import WAITING, Ahead, Behind, in_order

PATIENCE_S = 10.0


@pytest.fixture(autouse=True)
def _several_cores(monkeypatch):
    monkeypatch.setattr(overlap, "cores", lambda: 2)


def counted(most, seen, error=None):
    """Yield 0, 1, ... and note each; then fail, if there is an error, and note the end and in which thread it came."""
    try:
        for number in range(most):
            seen.append(number)
            yield number
        if error is not None:
            raise error
    finally:
        seen.append(threading.current_thread().name)


def until(true):
    """Wait until something is so; a failure if it never is."""
    deadline = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.001)


def no_threads_left():
    until(lambda: not [thread for thread in threading.enumerate() if thread.name.startswith("dloftbs-")])


def test_items_come_in_order_from_a_thread_that_closes_them():
    seen = []
    with Ahead(counted(50, seen)) as ahead:
        assert list(ahead) == list(range(50))
    assert seen == [*range(50), "dloftbs-ahead"]
    assert ahead.missed == 0
    no_threads_left()


def test_reading_ahead_is_bounded():
    seen = []
    with Ahead(counted(100, seen)) as ahead:
        items = iter(ahead)
        assert next(items) == 0
        until(lambda: len(seen) == WAITING + 2)  # the one taken, those that wait, and one in its hand
        time.sleep(0.02)
        assert len(seen) == WAITING + 2
    no_threads_left()
    assert seen == [*range(WAITING + 2), "dloftbs-ahead"]


def test_an_error_of_the_items_comes_after_them():
    error = OSError("the disk is gone")
    done = []

    def work():
        with Ahead(counted(3, [], error)) as ahead:
            for item in ahead:
                done.append(item)

    with pytest.raises(OSError, match="the disk is gone") as caught:
        work()
    assert caught.value is error
    assert done == [0, 1, 2]
    no_threads_left()


def test_an_error_that_was_never_reached_is_not_raised():
    with Ahead(counted(3, [], OSError("beyond"))) as ahead:
        assert next(iter(ahead)) == 0
    no_threads_left()


def test_an_interrupt_in_the_block_ends_the_reading():
    seen = []

    def work():
        with Ahead(counted(1000, seen)) as ahead:
            for item in ahead:
                if item == 5:
                    raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work()
    no_threads_left()
    assert seen[-1] == "dloftbs-ahead"
    assert len(seen) < 20


def test_what_never_comes_back_from_reading_is_left_behind(monkeypatch):
    monkeypatch.setattr(overlap, "_PATIENCE_S", 0.05)
    release, closed = threading.Event(), []

    def camera():
        try:
            yield 0
            release.wait()
            yield 1
        finally:
            closed.append(True)

    since = time.monotonic()
    with Ahead(camera()) as ahead:
        assert next(iter(ahead)) == 0
    assert time.monotonic() - since < PATIENCE_S
    assert not closed
    release.set()
    no_threads_left()
    assert closed


def test_of_a_camera_the_newest_item_is_kept_and_the_others_are_counted():
    read = threading.Semaphore(0)

    def camera():
        for number in range(100):
            read.acquire()
            yield number

    with Ahead(camera(), newest=True) as ahead:
        items = iter(ahead)
        read.release()
        assert next(items) == 0
        read.release(98)
        until(lambda: ahead.missed == 97)
        assert next(items) == 98
        read.release()
        assert list(items) == [99]
        assert ahead.missed == 97
    no_threads_left()


def test_items_are_written_in_order_before_the_block_ends():
    done = []

    def slowly(item):
        time.sleep(0.001)
        done.append((item, threading.current_thread().name))

    with Behind(slowly) as behind:
        for number in range(30):
            behind.put(number)
    assert done == [(number, "dloftbs-behind") for number in range(30)]
    no_threads_left()


def test_writing_behind_is_bounded():
    held, put = threading.Event(), []

    def hold(item):
        held.wait()

    def many(behind):
        for number in range(20):
            behind.put(number)
            put.append(number)

    with Behind(hold) as behind:
        thread = threading.Thread(target=many, args=(behind,))
        thread.start()
        until(lambda: len(put) == WAITING + 1)
        time.sleep(0.02)
        assert len(put) == WAITING + 1
        held.set()
        thread.join()
    no_threads_left()


@pytest.mark.parametrize("interrupt", [None, KeyboardInterrupt(), RuntimeError("later")])
def test_an_error_in_writing_is_raised_as_it_is_and_nothing_is_written_after_it(interrupt):
    error = OSError("disk full")
    done = []

    def write(item):
        if item == 3:
            raise error
        done.append(item)

    def work():
        with Behind(write) as behind:
            for number in range(4):
                behind.put(number)
            if interrupt is not None:
                raise interrupt
            while True:
                behind.put(4)

    with pytest.raises(OSError, match="disk full") as caught:
        work()
    assert caught.value is error
    assert done == [0, 1, 2]
    no_threads_left()


def test_what_was_put_before_an_interrupt_is_written():
    done = []

    def slowly(item):
        time.sleep(0.005)
        done.append(item)

    def work():
        with Behind(slowly) as behind:
            for number in range(3):
                behind.put(number)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == [0, 1, 2]


def test_a_second_interrupt_gives_up_what_waits_but_not_what_is_at_hand(monkeypatch):
    begun, release, done = threading.Event(), threading.Event(), []

    def hold(item):
        begun.set()
        release.wait()
        done.append(item)

    def work():
        with Behind(hold) as behind:
            for number in range(3):
                behind.put(number)
            begun.wait()
            join = behind._thread.join

            def interrupted():
                monkeypatch.setattr(behind._thread, "join", join)
                threading.Timer(0.1, release.set).start()
                raise KeyboardInterrupt

            monkeypatch.setattr(behind._thread, "join", interrupted)

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == [0]
    no_threads_left()


@pytest.mark.parametrize("jobs", [1, 2, 7])
def test_a_pool_keeps_the_order(jobs):
    def late(item):
        time.sleep(0.002 * (item % 3 == 0))
        return item * item

    assert list(in_order(late, range(40), jobs)) == [item * item for item in range(40)]
    no_threads_left()


def test_a_pool_takes_few_items_ahead():
    taken = []

    def items():
        for number in range(100):
            taken.append(number)
            yield number

    results = in_order(lambda item: item, items(), 3)
    assert next(results) == 0
    assert len(taken) == 7
    results.close()
    no_threads_left()


@pytest.mark.parametrize("jobs", [1, 4])
def test_a_pool_raises_in_turn_what_its_items_or_its_function_do(jobs):
    def fail(item):
        if item == 5:
            raise ValueError("five")
        return item

    for results in (in_order(fail, range(9), jobs), in_order(int, counted(5, [], ValueError("five")), jobs)):
        assert [next(results) for _ in range(5)] == [0, 1, 2, 3, 4]
        with pytest.raises(ValueError, match="five"):
            next(results)


def test_on_one_core_all_is_done_in_turn(monkeypatch):
    monkeypatch.setattr(overlap, "cores", lambda: 1)
    seen = []
    with Ahead(counted(3, seen)) as ahead, Behind(lambda item: seen.append(("done", item))) as behind:
        for item in ahead:
            behind.put(item)
            assert not [thread for thread in threading.enumerate() if thread.name.startswith("dloftbs-")]
    assert seen == [0, ("done", 0), 1, ("done", 1), 2, ("done", 2), "MainThread"]


def test_where_it_is_asked_for_all_is_done_in_turn(monkeypatch):
    monkeypatch.setattr(overlap, "cores", lambda: 2)
    done = []
    items = ((done.append(("read", i, threading.get_ident())), i)[1] for i in range(2))
    with Ahead(items, in_turn=True) as ahead, Behind(lambda i: done.append(("written", i)), in_turn=True) as written:
        for i in ahead:
            written.put(i)
    here = threading.get_ident()
    assert done == [("read", 0, here), ("written", 0), ("read", 1, here), ("written", 1)]


def test_on_one_core_a_block_that_ends_early_closes_the_items(monkeypatch):
    monkeypatch.setattr(overlap, "cores", lambda: 1)
    seen = []
    with Ahead(counted(3, seen)) as ahead:
        assert next(iter(ahead)) == 0
    assert seen == [0, "MainThread"]


def test_on_one_core_a_camera_still_has_a_thread_of_its_own(monkeypatch):
    monkeypatch.setattr(overlap, "cores", lambda: 1)
    seen = []
    with Ahead(counted(3, seen), newest=True) as ahead:
        assert list(ahead)[-1] == 2
    assert seen == [0, 1, 2, "dloftbs-ahead"]


def test_no_item_is_kept_alive():
    class Item:
        pass

    kept = []

    def items():
        for _ in range(30):
            item = Item()
            kept.append(weakref.ref(item))
            yield item

    with Ahead(items()) as ahead, Behind(lambda item: None) as behind:
        for item in ahead:
            behind.put(item)
            alive = sum(reference() is not None for reference in kept)
            assert alive <= 2 * WAITING + 5
    assert len(kept) == 30
