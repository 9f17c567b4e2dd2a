"""A batch of recordings in one process and in two, against each other.

Run it with ``python -m benchmarks.batch [--quick] [--docs PAGE]``. It writes recordings of raw images, and takes all of
them through ``dloftbs batch --jobs 1`` and ``--jobs 2`` in turn, start to end; "/ jobs 2" is how many times as fast two
processes are, on as many cores.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

from benchmarks.docs import arguments, published
from benchmarks.recordings import make_recordings
from benchmarks.timing import Table, interleaved
from dloftbs import Config
from dloftbs.config import SegmentationConfig
from dloftbs.synthetic import DemoSequence


def main() -> None:
    """Print the table."""
    given = arguments(__doc__, "few recordings and frames, to see that it runs").parse_args()
    recordings, frames, rounds = (2, 4, 1) if given.quick else (16, 60, 3)
    with published("batch", given.docs), tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "recordings").mkdir()
        first = make_recordings(folder, frames)["MCAP"]
        for i in range(recordings):
            shutil.copy(first, folder / "recordings" / f"{i}.mcap")
        config = Config(segmentation=SegmentationConfig(hsv=DemoSequence(frames=1).hsv))
        (folder / "cables.yaml").write_text(config.to_yaml(), encoding="utf-8")
        print(f"{recordings} recordings of {frames} frames of 1280 x 720, bgr8, ms for all of them")
        functions = {f"jobs {jobs}": partial(run, folder, jobs) for jobs in (1, 2)}
        times = interleaved(functions, rounds)
        table = Table("dloftbs batch", {"jobs 2": times["jobs 2"]})
        for jobs, ms in times.items():
            table.row(f"  {jobs}", ms)
        table.end()


def run(folder: Path, jobs: int) -> None:
    """Take all recordings through a number of processes."""
    out = folder / "results"
    shutil.rmtree(out, ignore_errors=True)
    command = [sys.executable, "-m", "dloftbs", "batch", str(folder / "recordings" / "*.mcap")]
    options = ["--config", str(folder / "cables.yaml"), "--out", str(out), "--jobs", str(jobs)]
    subprocess.run([*command, *options], check=True, stderr=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
