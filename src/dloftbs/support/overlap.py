"""Loops side by side: reading ahead, working in a pool, writing behind, in the order and with the results of one loop.

A stream is read, worked on and written. One after the other, these times add up; in threads of their own, the slowest
of the three sets the rate, since kernels, codecs and files do their work without the GIL::

    with Ahead(frames) as read, Behind(write) as written:
        for frame in read:
            written.put(pipeline.process(frame))

Between two loops a few items wait, never more: memory is bounded. An error in any of the loops is raised, as it is,
where one loop would have raised it, and whatever came before it is worked on and written. On a single core there is
nothing to be won, and all is done in turn.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from threading import Condition, Thread
from types import TracebackType
from typing import Generic, TypeVar

WAITING = 4
"""Items that wait between two loops, at most: enough to even out that they take now more time, now less."""
_PATIENCE_S = 2.0  # a camera that has gone silent may not come back from reading

T = TypeVar("T")
R = TypeVar("R")


def cores() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Ahead(Generic[T]):
    """Runs a generator in a thread of its own, ahead of whoever iterates over this.

    Parameters
    ----------
    items : generator
        Closed by the thread that runs it, once it is through or the block ends: a source that it opened is never closed
        while it reads.
    newest : bool
        Never wait for whoever iterates: keep the newest item alone. For cameras, whose frames grow old.
    in_turn : bool
        Run it in the thread that iterates, item by item, where all cores are busy with other work of the same kind.
    """

    def __init__(self, items: Generator[T, None, None], *, newest: bool = False, in_turn: bool = False) -> None:
        self._items = items
        self._in_turn = not newest and (in_turn or cores() == 1)
        self._channel: _Channel[T] = _Channel(1 if newest else WAITING, newest)
        self._error: BaseException | None = None
        self._thread = Thread(target=self._run, name="dloftbs-ahead", daemon=True)

    @property
    def missed(self) -> int:
        """Items that made room for newer ones."""
        return self._channel.dropped

    def __enter__(self) -> Ahead[T]:
        if not self._in_turn:
            self._thread.start()
        return self

    def __iter__(self) -> Iterator[T]:
        """Yield the items, then raise what ended the generator, if anything did."""
        if self._in_turn:
            yield from self._items
            return
        yield from self._channel
        self._thread.join()
        if self._error is not None:
            raise self._error

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._in_turn:
            self._items.close()
            return
        self._channel.close()
        self._thread.join(_PATIENCE_S)

    def _run(self) -> None:
        try:
            try:
                for item in self._items:
                    if not self._channel.put(item):
                        break
            finally:
                self._items.close()
        except BaseException as error:  # noqa: BLE001 - it is raised in the thread that iterates
            self._error = error
        self._channel.end()


class Behind(Generic[T]):
    """Calls a function for each item in a thread of its own, in their order, while whoever puts them goes on.

    The block ends when all items are done. A second Ctrl-C meanwhile gives up those that wait, but not the one at hand.

    Parameters
    ----------
    function : callable
        Its exception is raised by `put` or at the end of the block, and no further item is taken.
    in_turn : bool
        Call it in the thread that puts, as `Ahead` does.
    """

    def __init__(self, function: Callable[[T], None], *, in_turn: bool = False) -> None:
        self._function = function
        self._in_turn = in_turn or cores() == 1
        self._channel: _Channel[T] = _Channel(WAITING)
        self._error: BaseException | None = None
        self._thread = Thread(target=self._run, name="dloftbs-behind", daemon=True)

    def __enter__(self) -> Behind[T]:
        if not self._in_turn:
            self._thread.start()
        return self

    def put(self, item: T) -> None:
        """Hand an item over; waits while too many are before it."""
        if self._in_turn:
            self._function(item)
        elif not self._channel.put(item):
            assert self._error is not None  # nothing else closes the channel before the block ends
            raise self._error

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._in_turn:
            return
        self._channel.end()
        try:
            self._thread.join()
        except BaseException:
            self._channel.close()
            self._thread.join()
            raise
        if self._error is not None and self._error is not error:
            raise self._error  # it came first: what the block raises is about a later item

    def _run(self) -> None:
        try:
            for item in self._channel:
                self._function(item)
        except BaseException as error:  # noqa: BLE001 - it is raised in the thread that puts
            self._error = error
            self._channel.close()


def in_order(function: Callable[[T], R], items: Iterable[T], jobs: int) -> Generator[R, None, None]:
    """Call a function for all items, several at the same time, and yield its results in the order of the items.

    What it raises, or the items do, is raised in its turn. At most twice as many items as jobs are taken ahead.
    """
    waiting: deque[Future[R]] = deque()
    iterator = iter(items)
    with ThreadPoolExecutor(jobs, "dloftbs-job") as pool:
        try:
            while True:
                try:
                    waiting.append(pool.submit(function, next(iterator)))
                except StopIteration:
                    break
                except Exception as error:  # noqa: BLE001 - it is raised when its turn has come
                    waiting.append(Future())
                    waiting[-1].set_exception(error)
                    break
                if len(waiting) > 2 * jobs:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


class _Channel(Generic[T]):
    """A queue between two threads that either can end.

    Parameters
    ----------
    most : int
        Items in it.
    newest : bool
        Drop the oldest item where there is no room, and do not wait.
    """

    def __init__(self, most: int, newest: bool = False) -> None:
        self.dropped = 0
        self._most = most
        self._newest = newest
        self._items: deque[T] = deque()
        self._ended = self._closed = False
        self._changed = Condition()

    def put(self, item: T) -> bool:
        """Add an item when there is room; False if nobody takes it any more."""
        with self._changed:
            if self._newest and len(self._items) >= self._most:
                self._items.popleft()
                self.dropped += 1
            self._changed.wait_for(lambda: self._closed or len(self._items) < self._most)
            if self._closed:
                return False
            self._items.append(item)
            self._changed.notify_all()
            return True

    def __iter__(self) -> Iterator[T]:
        """Take the items as they come, until there will be no more."""
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._ended or len(self._items) > 0)
                if not self._items:
                    return
                item = self._items.popleft()
                self._changed.notify_all()
            yield item

    def end(self) -> None:
        """Put no more; the items in it can still be taken."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def close(self) -> None:
        """Take no more, and let go of the items in it."""
        with self._changed:
            self._closed = True
            self._items.clear()
            self._changed.notify_all()
