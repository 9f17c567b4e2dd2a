"""Frames of a source in any order, and a sample of all of them, in bounded memory."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Container, Iterator
from threading import Condition, Lock, Thread

from dloftbs.data.frame import Frame
from dloftbs.errors import DloftbsError, SourceError
from dloftbs.sources import Source

MAX_SAMPLES = 120
"""Number of frames that stand for the whole source.

Source: by hand; a bar of the strip is then some ten pixels wide.
"""
BUDGET_BYTES = 256 << 20
"""Memory for the sample, bytes; and as much again for frames that were looked at.

Source: by hand; 97 frames of HD.
"""
_PATIENCE_S = 2.0  # for a camera that is read while the store is closed


class FrameStore:
    """Reads a source once in the background, and keeps frames that are evenly spread over it.

    Of a recording any frame can be had: what is not kept is read again. Of a camera only what was kept, and the newest.

    Parameters
    ----------
    source : Source
        Closed with the store.
    budget_bytes : int

    Attributes
    ----------
    live : bool
        Whether it is as with a camera: also where a source can be read only once.
    """

    def __init__(self, source: Source, budget_bytes: int = BUDGET_BYTES) -> None:
        self.source = source
        self.live = source.live or source.single_pass
        self._budget = budget_bytes
        self._samples: list[Frame] = []
        self._every = 1
        self._newest: Frame | None = None
        self._kept: OrderedDict[int, Frame] = OrderedDict()
        self._pinned: dict[int, Frame] = {}
        self._reader: Iterator[Frame] | None = None
        self._next = 0
        self._at_source = Lock()  # a file has one place at which it is read
        self._seeking = Lock()
        self._changed = Condition()
        self._ended = self._closed = False
        self._error: DloftbsError | None = None
        self._last = -1
        self._thread = Thread(target=self._read_all, name="dloftbs-sampling", daemon=True)

    def start(self) -> None:
        """Begin to read in the background."""
        self._thread.start()

    def stop(self) -> None:
        """Let nobody wait for a frame any more."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def close(self) -> None:
        """Stop reading and close the source."""
        self.stop()
        if self._thread.is_alive():
            self._thread.join(_PATIENCE_S)
        self.source.close()

    @property
    def length(self) -> int | None:
        """Number of frames; None while it is not known."""
        if self._ended or self.live:
            return self._last + 1
        return self.source.length

    @property
    def ended(self) -> bool:
        """True once the whole source was read."""
        return self._ended

    def samples(self) -> tuple[Frame, ...]:
        """Return the sample as far as it is read, in order."""
        with self._changed:
            return tuple(self._samples)

    def wait_for_samples(self, more_than: int, timeout_s: float) -> None:
        """Wait until the sample has grown beyond a number, all is read, or time is over."""
        with self._changed:
            self._changed.wait_for(
                lambda: len(self._samples) > more_than or self._ended or self._closed, timeout=timeout_s
            )

    def frame(self, index: int | None) -> Frame:
        """Return a frame, or the next one that can be read; None is the newest of a camera, and the first of others.

        Raises
        ------
        SourceError
            If nothing can be read there.
        """
        if self.live:
            return self._live_frame(index)
        return self._recorded_frame(index or 0)

    def _live_frame(self, index: int | None) -> Frame:
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None or self._ended or self._closed)
            if self._newest is None:
                raise self._error or SourceError(f"{self.source.name}: no frame could be read")
            if index is None:
                return self._newest
            return min(self._known(), key=lambda frame: abs(frame.index - index))

    def _known(self) -> list[Frame]:
        newest = () if self._newest is None else (self._newest,)
        return [*self._pinned.values(), *self._kept.values(), *self._samples, *newest]

    def pin(self, index: int) -> None:
        """Keep a camera's frame that somebody draws on, whatever the budget: its colours are counted again and again.

        Raises
        ------
        SourceError
            If it is no longer kept.
        """
        if not self.live:
            return
        with self._changed:
            found = next((frame for frame in self._known() if frame.index == index), None)
            if found is None:
                name = self.source.name
                raise SourceError(f"{name}: frame {index} is no longer kept; draw on the frame that is shown")
            self._pinned[index] = found

    def unpin_others(self, used: Container[int]) -> None:
        """Let go of a camera's frames on which nothing is drawn any more."""
        with self._changed:
            self._pinned = {index: frame for index, frame in self._pinned.items() if index in used}

    def keep(self, frame: Frame) -> None:
        """Keep a frame that somebody looks at."""
        with self._changed:
            self._kept[frame.index] = frame
            self._kept.move_to_end(frame.index)
            while len(self._kept) > max(2, self._budget // _bytes_of(frame)):
                self._kept.popitem(last=False)

    def _recorded_frame(self, index: int) -> Frame:
        with self._seeking:
            with self._changed:
                known = self._kept.get(index) or next((f for f in self._samples if f.index == index), None)
            if known is not None:
                return known
            if self._reader is None or index < self._next:
                self._reader, self._next = iter(self.source), 0
            for frame in self._steps(self._reader):
                self._next = frame.index + 1
                self.keep(frame)
                if frame.index >= index:
                    return frame
            self._reader = None
            with self._changed:
                seen = [*self._samples, *self._kept.values()]
            if not seen:
                raise SourceError(f"{self.source.name}: no frame could be read")
            return max(seen, key=lambda frame: frame.index)

    def _steps(self, frames: Iterator[Frame]) -> Iterator[Frame]:
        while True:
            with self._at_source:
                frame = next(frames, None)
            if frame is None:
                return
            yield frame

    def _read_all(self) -> None:
        try:
            with self._at_source:
                frames = iter(self.source)
            for frame in self._steps(frames):
                with self._changed:
                    if self._closed:
                        return
                    self._newest, self._last = frame, frame.index
                    if frame.index % self._stride(frame) == 0:
                        self._samples.append(frame)
                        self._thin_out(frame)
                    self._changed.notify_all()
        except DloftbsError as error:
            self._error = error
        finally:
            with self._changed:
                self._ended = True
                self._changed.notify_all()

    def _stride(self, frame: Frame) -> int:
        if not self._samples and self.source.length is not None:
            self._every = max(1, -(-self.source.length // self._most(frame)))
        return self._every

    def _thin_out(self, frame: Frame) -> None:
        """Keep every other frame where there are too many: of a stream nobody knows how long it will be."""
        if len(self._samples) > self._most(frame):
            self._every *= 2
            self._samples = [kept for kept in self._samples if kept.index % self._every == 0]

    def _most(self, frame: Frame) -> int:
        return max(2, min(MAX_SAMPLES, self._budget // _bytes_of(frame)))


def _bytes_of(frame: Frame) -> int:
    arrays = (frame.image, frame.mask, frame.depth, frame.occluders, frame.instances)
    return max(1, sum(array.nbytes for array in arrays if array is not None))
