"""What a whole process costs: starting the command, what it imports, the first compilation, and memory over a stream.

Run it with ``python -m benchmarks.process [--quick] [--docs PAGE]``.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from fractions import Fraction
from pathlib import Path
from time import perf_counter

import cv2
import numpy as np
import psutil

from benchmarks.docs import arguments, published
from benchmarks.scenes import SIZE, cables
from dloftbs import Config, Frame, Pipeline
from dloftbs.sinks._mp4 import H264Mp4
from dloftbs.support.safe_files import AppendFile

MEGABYTE = 2**20
COMMAND = [sys.executable, "-m", "dloftbs"]
_IMPORT = re.compile(r"^import time:\s+(\d+) \|\s+\d+ \|\s*(\S+)$", re.MULTILINE)
_MAX_PACKAGES = 8
_VIDEO_SIZE = (360, 640)


def main() -> None:
    """Print the tables."""
    given = arguments(__doc__, "fewer starts, shorter streams, and no compilation, to see that it runs").parse_args()
    starts = 1 if given.quick else 11
    with published("process", given.docs), tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        mask = folder / "mask.png"
        cv2.imwrite(str(mask), cables(1))
        cached = dict(os.environ) if given.quick else dict(os.environ, NUMBA_CACHE_DIR=str(folder / "cache"))
        start_up(mask, cached, starts, compiling=not given.quick)
        imports(mask, cached, starts)
        memory(frames=200 if given.quick else 10_000)
        command_memory(folder, (20, 60) if given.quick else (100, 2_000))


def start_up(mask: Path, cached: dict[str, str], starts: int, *, compiling: bool) -> None:
    """Time whole processes, from the shell's point of view; with `compiling`, the cache is still empty."""
    print(f"{'whole process':<38}{'median s':>9}{'worst s':>9}")
    report("  python -c pass", [sys.executable, "-c", "pass"], starts)
    report("  dloftbs --help", [*COMMAND, "--help"], starts)
    if compiling:
        report("  dloftbs detect mask.png, compiling", [*COMMAND, "detect", str(mask)], 1, cached)
    report("  dloftbs detect mask.png, cached", [*COMMAND, "detect", str(mask)], starts, cached)
    print()


def report(name: str, command: list[str], starts: int, environment: dict[str, str] | None = None) -> None:
    """Run a command several times and print how long it took."""
    seconds = []
    for _ in range(starts):
        start = perf_counter()
        subprocess.run(command, check=True, capture_output=True, env=environment)
        seconds.append(perf_counter() - start)
    print(f"{name:<38}{np.median(seconds):>9.3f}{max(seconds):>9.3f}", flush=True)


def imports(mask: Path, cached: dict[str, str], starts: int) -> None:
    """Print what of ``dloftbs detect`` goes into imports, by package, without what each imports in its turn."""
    command = [sys.executable, "-X", "importtime", "-m", "dloftbs", "detect", str(mask)]
    runs = []
    for _ in range(starts):
        text = subprocess.run(command, check=True, capture_output=True, text=True, env=cached).stderr
        runs.append(seconds_by_package(text))
    median = {name: float(np.median([run.get(name, 0.0) for run in runs])) for name in {*runs[0]}}
    total = sum(median.values())
    print(f"{'imports of dloftbs detect':<38}{'median s':>9}{'share':>9}")
    for name in sorted(median, key=lambda name: -median[name])[:_MAX_PACKAGES]:
        print(f"  {name:<36}{median[name]:>9.3f}{100.0 * median[name] / total:>7.1f} %")
    print(f"  {'all':<36}{total:>9.3f}\n", flush=True)


def seconds_by_package(text: str) -> dict[str, float]:
    """Sum up what ``-X importtime`` says; loading the kernels from the cache is apart, the standard library one."""
    seconds: dict[str, float] = defaultdict(float)
    for microseconds, module in _IMPORT.findall(text):
        top = module.partition(".")[0]
        if top in sys.stdlib_module_names or top.startswith("_"):
            top = "Python itself"
        elif top == "dloftbs" and "kernels" in module.split("."):
            top = "dloftbs, kernels from the cache"
        seconds[top] += 1e-6 * int(microseconds)
    return dict(seconds)


def memory(frames: int) -> None:
    """Print the resident memory of a pipeline after 100 frames and after many."""
    process, pipeline = psutil.Process(), Pipeline(Config.paper())
    masks = [np.roll(cables(2), 40 * shift, axis=1) for shift in range(8)]
    masks.append(np.zeros(SIZE, dtype=np.uint8))
    print(f"{'resident memory':<38}{'MiB':>9}")
    for index in range(1, frames + 1):
        pipeline.process(Frame(mask=masks[index % len(masks)], index=index))
        if index in (100, frames):
            print(f"{f'  pipeline, after {index} frames':<38}{process.memory_info().rss / MEGABYTE:>9.1f}", flush=True)


def command_memory(folder: Path, lengths: tuple[int, int]) -> None:
    """Print the most that ``dloftbs track`` ever had, with curves and overlay, on a short video and on a long one."""
    for length in lengths:
        video = folder / f"{length}.mp4"
        write_video(video, length)
        out = ["--out", str(folder / "curves.jsonl"), "--overlay", str(folder / "overlay.mp4")]
        # The shell's own peak is not counted: this one waits for no other child.
        process = subprocess.Popen(
            [*COMMAND, "track", str(video), "--kind", "mask", *out],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        assert process.returncode == 0
        name = f"  dloftbs track, {length} frames, peak"
        print(f"{name:<38}{usage.ru_maxrss * 1024 / MEGABYTE:>9.1f}", flush=True)


def write_video(path: Path, length: int) -> None:
    """Write a mask that moves as a video."""
    mask = cv2.resize(cables(2), _VIDEO_SIZE[::-1], interpolation=cv2.INTER_NEAREST)
    file = AppendFile(path)
    video = H264Mp4(file, _VIDEO_SIZE, Fraction(30), "mp4")
    for index in range(length):
        video.add(cv2.cvtColor(np.roll(mask, index % 40, axis=0), cv2.COLOR_GRAY2BGR))
    video.finish()
    file.close()


if __name__ == "__main__":
    main()
