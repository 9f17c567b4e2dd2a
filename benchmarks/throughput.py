"""Frames per second of whole streams: reading, tracking and writing alone, one after the other, and side by side.

Run it with ``python -m benchmarks.throughput [--quick] [--docs PAGE]``. It makes a video, a folder and an MCAP file of
the demo's frames, and takes them through the loops of ``dloftbs track`` and ``dloftbs detect --jobs``, once in a
process that may use one core and once in one that may use two (as ``taskset`` does). "/ slowest" is the time side by
side as a ratio to that of the slowest of the three alone. On one core nothing is side by side; on two, what the three
take together stands in the way of 1.00 where it is more than twice the slowest. The last stream only waits: what the
loops themselves cost.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.docs import arguments, published
from benchmarks.recordings import make_recordings
from dloftbs_lab import write_sequence
from dloftbs_lab.synthetic import DemoSequence

VIDEO, PICTURES, RECORDING = "video", "pictures", "MCAP.mcap"


def main() -> None:
    """Print the tables."""
    given = arguments(__doc__, "few frames and rounds, to see that it runs").parse_args()
    frames, rounds = (2, 1) if given.quick else (48, 7)
    with published("throughput", given.docs), tempfile.TemporaryDirectory() as folder:
        make_inputs(Path(folder), frames)
        print(f"frames/s, {frames} frames of 1280 x 720, two cables by colour, the fastest of {rounds} rounds")
        counts = (1, 2)[: len(os.sched_getaffinity(0))]
        for cores in counts[-1:] if given.quick else counts:
            command = [sys.executable, "-m", "benchmarks.throughput_run", folder, str(cores), str(rounds)]
            print()
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
                assert process.stdout is not None
                for line in process.stdout:
                    print(line, end="")
            if process.returncode:
                raise subprocess.CalledProcessError(process.returncode, command)


def make_inputs(folder: Path, frames: int) -> None:
    """Write the demo's sequence as a video, as pictures and as a recording of ROS."""
    sequence = DemoSequence(frames=frames)
    write_sequence(sequence, folder / VIDEO, video=True)
    write_sequence(sequence, folder / PICTURES)
    assert make_recordings(folder, frames)["MCAP"] == folder / RECORDING


if __name__ == "__main__":
    main()
