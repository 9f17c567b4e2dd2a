"""Writes to one sink of each kind until it is killed; says after each frame how many there are."""

from __future__ import annotations

import itertools
import sys

import sink_examples as examples

from dloftbs import sinks

NAMES = ("a.jsonl", "a.npz", "a.csv", "a.ply", "a.usda", "a.xml", "a.json", "a.mp4", "pictures/", "b.labelme/")


def main(folder: str) -> None:
    opened = [examples.open_sink(f"{folder}/{name}") for name in NAMES]
    with sinks.MultiSink(opened) as sink:
        for i in itertools.count():
            sink.write(examples.frame(i), examples.detected(i, in_space=i % 2 == 0))
            sys.stdout.write(f"{i + 1}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1])
