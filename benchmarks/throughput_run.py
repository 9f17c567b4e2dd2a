"""The part of `benchmarks.throughput` that runs in a process of its own, on a given number of cores."""

from __future__ import annotations

import os
import sys

if __name__ == "__main__":  # before anything starts its threads
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: int(sys.argv[2])])

import itertools
from collections.abc import Callable, Generator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from time import sleep

from benchmarks.throughput import PICTURES, RECORDING, VIDEO
from benchmarks.timing import interleaved
from dloftbs import Config, Frame, Pipeline, sinks, sources
from dloftbs.config import SegmentationConfig
from dloftbs.data.frame_result import FrameResult
from dloftbs.sinks import MultiSink, Sink
from dloftbs.sources import Source
from dloftbs.support.overlap import Ahead, Behind, cores, in_order
from dloftbs_lab.synthetic import DemoSequence


class Stream:
    """A stream on its way from a file into others.

    Parameters
    ----------
    where : Path
    outs : tuple of str
        Suffixes of what is written.
    folder : Path
        Where that goes.
    """

    def __init__(self, where: Path, outs: tuple[str, ...], folder: Path) -> None:
        self._where, self._outs, self._folder = where, outs, folder
        self._config = Config(segmentation=SegmentationConfig(hsv=DemoSequence().hsv))
        self._frames = list(self._open())
        self._results = [*map(Pipeline(self._config).process, self._frames)]
        self._number = itertools.count()

    def read(self) -> None:
        """Read all frames, and do nothing with them."""
        for _ in self._open():
            pass

    def track(self) -> None:
        """Track the frames, which are in memory."""
        pipeline = Pipeline(self._config)
        for frame in self._frames:
            pipeline.process(frame)

    def write(self) -> None:
        """Write the results, which are in memory."""
        with self._sink() as sink:
            for frame, result in zip(self._frames, self._results, strict=True):
                sink.write(frame, result)

    def in_turn(self) -> None:
        """Do all three for one frame after the other."""
        pipeline = Pipeline(self._config)
        with self._sink() as sink:
            for frame in self._open(jobs=1):
                sink.write(frame, pipeline.process(frame))

    def aside(self) -> None:
        """Do all three side by side, as ``dloftbs track``."""
        pipeline = Pipeline(self._config)

        def write(done: tuple[Frame, FrameResult]) -> None:
            sink.write(*done)

        with ExitStack() as stack:
            read = stack.enter_context(Ahead(_frames(self._open())))
            sink = stack.enter_context(self._sink())
            written = stack.enter_context(Behind(write))
            for frame in read:
                written.put((frame, pipeline.process(frame)))

    def batch(self, jobs: int) -> None:
        """Detect in each frame by itself, as ``dloftbs detect --jobs``."""
        pipelines = [Pipeline(self._config) for _ in range(jobs)]  # detecting leaves no trace in them
        turn = itertools.cycle(pipelines)
        with Ahead(_frames(self._open(jobs))) as read, self._sink() as sink:
            for frame, result in in_order(lambda frame: (frame, next(turn).detect(frame)), read, jobs):
                sink.write(frame, result)

    def __len__(self) -> int:
        return len(self._frames)

    def _open(self, jobs: int | None = None) -> Source:
        return sources.open(self._where, jobs=jobs or cores())

    def _sink(self) -> Sink:
        stem = f"{next(self._number)}"
        return MultiSink([sinks.open(self._folder / f"{stem}{suffix}") for suffix in self._outs])


class Waits:
    """Reading, tracking and writing that are nothing but waits of 5 ms each: what is left is what the loops cost.

    Parameters
    ----------
    frames : int
    """

    def __init__(self, frames: int) -> None:
        self._count = frames

    def _wait(self, item: int = 0) -> None:
        sleep(0.005)

    def read(self) -> None:
        """Wait once for each frame."""
        for _ in range(self._count):
            self._wait()

    track = write = read

    def in_turn(self) -> None:
        """Wait three times for each frame."""
        for _ in range(3):
            self.read()

    def aside(self) -> None:
        """Wait three times for each frame, side by side."""
        with Ahead(self._numbers()) as read, Behind(self._wait) as written:
            for number in read:
                self._wait()
                written.put(number)

    def __len__(self) -> int:
        return self._count

    def _numbers(self) -> Generator[int, None, None]:
        for number in range(self._count):
            self._wait()
            yield number


def _frames(source: Source) -> Generator[Frame, None, None]:
    with source:
        yield from source


_LOOPS = ("reading", "tracking", "writing", "in turn", "aside")


def main(folder: Path, count: int, rounds: int) -> None:
    """Print the rows of this number of cores."""
    video, pictures = folder / VIDEO / "images.mp4", folder / PICTURES / "images"
    files = {
        "video to curves": Stream(video, (".jsonl",), folder),
        "MCAP to curves": Stream(folder / RECORDING, (".jsonl",), folder),
        "video to curves, overlay": Stream(video, (".jsonl", ".mp4"), folder),
        "PNG files to curves": Stream(pictures, (".jsonl",), folder),
    }
    streams: dict[str, Stream | Waits] = {**files, "waits of 5 ms": Waits(len(files["video to curves"]))}
    title = f"track, {count} core{'s' * (count > 1)}"
    print(f"{title:<27}{''.join(f'{loop:>9}' for loop in _LOOPS)}{'/ slowest':>11}{'/ in turn':>11}")
    for name, stream in streams.items():
        loops: dict[str, Callable[[], object]] = {
            "reading": stream.read,
            "tracking": stream.track,
            "writing": stream.write,
            "in turn": stream.in_turn,
            "aside": stream.aside,
        }
        ms = {loop: float(times.min()) for loop, times in interleaved(loops, rounds).items()}
        rates = "".join(f"{1e3 * len(stream) / ms[loop]:>9.0f}" for loop in _LOOPS)
        slowest = max(ms[loop] for loop in _LOOPS[:3])
        print(f"{f'  {name}':<27}{rates}{ms['aside'] / slowest:>11.2f}{ms['aside'] / ms['in turn']:>11.2f}", flush=True)
    jobs = {f"{number}": partial(files["PNG files to curves"].batch, number) for number in (1, 2)[:count]}
    for number, times in interleaved(jobs, rounds).items():
        print(f"{f'  detect --jobs {number}, PNG files':<27}{1e3 * len(stream) / times.min():>45.0f}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
