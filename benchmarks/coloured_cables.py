"""Cables of several colours: how many are read right by the mask alone, and with the image.

Run it in the repository with ``python -m benchmarks.coloured_cables FOLDER``; the folder holds ``motion/cable_*.npz``,
recorded motion of real cables. It prints the table of docs/linking-rules.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import numpy.typing as npt

from dloftbs import Frame, Pipeline
from dloftbs_lab.evaluation.runner.found import Found
from dloftbs_lab.evaluation.runner.frame_scores import score
from dloftbs_lab.evaluation.runner.known_frame import KnownFrame
from dloftbs_lab.synthetic import RealMotionSequence

_CABLES = (2, 3, 4)
_STEP = 15  # from one frame that counts to the next

_Counts = npt.NDArray[np.int64]


def count(sequence: RealMotionSequence, step: int = _STEP) -> _Counts:
    """Return the number of cables in some frames, of those that are right by the mask, and of those with the image."""
    counts = np.zeros(3, np.int64)
    for i in range(0, len(sequence), step):
        frame = sequence.frame(i)
        known = KnownFrame(frame, sequence.truth(i))
        counts[0] += len(known.truth.curves)
        for k, given in enumerate((Frame(mask=frame.mask), Frame(mask=frame.mask, image=frame.image)), start=1):
            curves = tuple(detection.curve for detection in Pipeline().process(given))
            counts[k] += score(Found(curves, (None,) * len(curves)), known).right
    return counts


def _count(folder: Path, cables: int, number: int, seed: int) -> _Counts:
    return count(RealMotionSequence(folder / "motion", cables, "coloured image", number, seed=seed))


def make_table(counts: dict[int, _Counts]) -> str:
    """Return the table of what is right for each number of cables, in Markdown."""
    lines = [
        "| cables of different colours | objects | right by the mask | with the image |",
        "| ---: | ---: | ---: | ---: |",
    ]
    lines += [f"| {cables} | {' | '.join(map(str, own.tolist()))} |" for cables, own in counts.items()]
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Count, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--number", type=int, default=12, help="sequences of each number of cables; 12 by default")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2, help="processes; 2 by default")
    options = parser.parse_args(arguments)
    with ProcessPoolExecutor(options.jobs) as pool:
        runs = {
            cables: [pool.submit(_count, options.folder, cables, k, options.seed) for k in range(options.number)]
            for cables in _CABLES
        }
        print(make_table({cables: np.sum([run.result() for run in own], axis=0) for cables, own in runs.items()}))


if __name__ == "__main__":
    main()
