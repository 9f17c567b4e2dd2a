"""What a whole process costs: starting the command, its help, the first compilation, and memory over a long stream.

Run it with ``python -m benchmarks.process [--quick]``.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import cv2
import numpy as np
import psutil

from benchmarks.scenes import SIZE, cables
from dloftbs import Config, Frame, Pipeline

MEGABYTE = 2**20


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer starts and a shorter stream, to see that it runs")
    quick = parser.parse_args().quick
    with tempfile.TemporaryDirectory() as folder:
        start_up(Path(folder), starts=3 if quick else 11)
    memory(frames=1_000 if quick else 10_000)


def start_up(folder: Path, starts: int) -> None:
    """Time whole processes, from the shell's point of view."""
    mask = folder / "mask.png"
    cv2.imwrite(str(mask), cables(1))
    command = [sys.executable, "-m", "dloftbs"]
    cold = dict(os.environ, NUMBA_CACHE_DIR=str(folder / "cache"))
    print(f"{'whole process':<34}{'median s':>9}{'worst s':>9}")
    report("  python -c pass", [sys.executable, "-c", "pass"], starts)
    report("  dloftbs --help", [*command, "--help"], starts)
    report("  dloftbs detect mask.png, compiling", [*command, "detect", str(mask)], 1, cold)
    report("  dloftbs detect mask.png, cached", [*command, "detect", str(mask)], starts, cold)
    print()


def report(name: str, command: list[str], starts: int, environment: dict[str, str] | None = None) -> None:
    """Run a command several times and print how long it took."""
    seconds = []
    for _ in range(starts):
        start = perf_counter()
        subprocess.run(command, check=True, capture_output=True, env=environment)
        seconds.append(perf_counter() - start)
    print(f"{name:<34}{np.median(seconds):>9.3f}{max(seconds):>9.3f}")


def memory(frames: int) -> None:
    """Print the resident memory after 100 frames and after many."""
    process, pipeline = psutil.Process(), Pipeline(Config.paper())
    masks = [np.roll(cables(2), 40 * shift, axis=1) for shift in range(8)]
    masks.append(np.zeros(SIZE, dtype=np.uint8))
    after = {}
    for index in range(1, frames + 1):
        pipeline.process(Frame(mask=masks[index % len(masks)], index=index))
        if index in (100, frames):
            after[index] = process.memory_info().rss / MEGABYTE
    print(f"{'resident memory':<34}{'MiB':>9}")
    for index, megabytes in after.items():
        print(f"{f'  after {index} frames':<34}{megabytes:>9.1f}")


if __name__ == "__main__":
    main()
