"""Many recordings of raw images, in turn and two at a time: ``dloftbs batch`` with one process and with two.

Run it with ``python -m benchmarks.batch [--quick] [--docs PAGE]``. Sixteen names of one file of frames are sixteen
recordings, so that all are read from memory; both runs may use two cores, and take turns. Times are of the whole
command, from its start to its end, imports and the loading of kernels included. "CPU s" is the time of all its
processes together, which tells what two of them cost each other, and "load" that of the machine meanwhile.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np

from benchmarks.docs import arguments, published
from dloftbs_lab.synthetic import DemoSequence

RECORDINGS = 16
HSV = "170:10,80:255,60:255"
_DIFFERENT = 24
"""Number of frames that differ; a recording has them again and again, there and back."""


def main() -> None:
    """Print the table."""
    given = arguments(__doc__, "few recordings and frames and one round, to see that it runs").parse_args()
    recordings, frames, rounds = (4, 2, 1) if given.quick else (RECORDINGS, 240, 3)
    with published("batch", given.docs), tempfile.TemporaryDirectory() as folder:
        make_recordings(Path(folder) / "recordings", recordings, frames)
        print(f"{recordings} recordings of {frames} raw frames of 1280 x 720, two cores, fastest of {rounds} rounds")
        print(f"{'':14}{'seconds':>9}{'CPU s':>9}{'frames/s':>10}{'as fast':>9}{'load':>7}")
        runs: dict[int, list[tuple[float, float, float]]] = {1: [], 2: []}
        for number in range(rounds):
            for jobs, times in runs.items():
                times.append(run(Path(folder), jobs, f"{jobs}-{number}"))
        check_same(Path(folder), [f"{jobs}-{number}" for jobs in runs for number in range(rounds)])
        slowest = min(runs[1])[0]
        for jobs, times in runs.items():
            seconds, cpu, load = min(times)
            name = "one process" if jobs == 1 else "two processes"
            rate = recordings * frames / seconds
            print(f"{name:14}{seconds:>9.1f}{cpu:>9.1f}{rate:>10.1f}{slowest / seconds:>9.2f}{load:>7.1f}", flush=True)


def make_recordings(folder: Path, count: int, frames: int) -> None:
    """Write the frames of the demo into one file with the names of all recordings."""
    folder.mkdir()
    sequence = DemoSequence(frames=_DIFFERENT)
    images = [image for i in range(min(frames, _DIFFERENT)) if (image := sequence.frame(i).image) is not None]
    there_and_back = [*images, *images[::-1]]
    first = folder / "00.npy"
    shape = (frames, *images[0].shape)
    stack = np.lib.format.open_memmap(first, mode="w+", dtype=np.uint8, shape=shape)
    for i in range(frames):
        stack[i] = there_and_back[i % len(there_and_back)]
    stack.flush()
    for number in range(1, count):
        os.link(first, folder / f"{number:02d}.npy")


def run(folder: Path, jobs: int, name: str) -> tuple[float, float, float]:
    """Run the command, and return its seconds, those of its processes, and the load of the machine."""
    command = [sys.executable, "-m", "dloftbs", "batch", f"{folder}/recordings/*.npy", "--hsv", HSV]
    cores = sorted(os.sched_getaffinity(0))[:2]
    before, since = _cpu_seconds(), perf_counter()
    subprocess.run(
        [*command, "--out", str(folder / name), "--jobs", str(jobs)],
        check=True,
        capture_output=True,
        preexec_fn=lambda: os.sched_setaffinity(0, cores),
    )
    return perf_counter() - since, _cpu_seconds() - before, os.getloadavg()[0]


def check_same(folder: Path, names: list[str]) -> None:
    """Find out whether all runs gave the same results.

    Raises
    ------
    ValueError
        If two differ.
    """
    results = {b"".join(path.read_bytes() for path in sorted((folder / name).glob("*.jsonl"))) for name in names}
    if len(results) != 1:
        raise ValueError("two runs gave different results")


def _cpu_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
