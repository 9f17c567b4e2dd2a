"""Writes to a sink of each name given: until a file is too large for the limit, or until its input ends."""

from __future__ import annotations

import sys

import sink_examples as examples

from dloftbs import sinks
from dloftbs.errors import SinkError


def fill(name: str) -> tuple[int, str]:
    """Return how many frames were written, and the error that ended it."""
    count = 0
    try:
        with examples.open_sink(name) as sink:
            for i in range(examples.MAX_FRAMES):
                sink.write(examples.frame(i), examples.detected(i, in_space=True))
                count += 1
    except SinkError as error:
        return count, str(error)
    return count, ""


def main(limit: int, names: list[str]) -> None:
    if limit:
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        for name in names:
            sys.stdout.write("{} {}\n".format(*fill(name)))
        return
    with sinks.MultiSink([examples.open_sink(name) for name in names]) as sink:
        for i in range(2):
            sink.write(examples.frame(i), examples.detected(i, in_space=True))
        sys.stdout.write("writing\n")
        sys.stdout.flush()
        sys.stdin.read()


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
