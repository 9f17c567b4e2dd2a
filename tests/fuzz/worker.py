"""Runs cases in a process of its own: what hangs is ended by a limit of CPU time, and says where it hung.

Reads lines of JSON with ``family``, ``seed``, ``number`` and ``folder``, and answers each with a line: the type of the
error, or null, its text, and the CPU time it took.
"""

from __future__ import annotations

import faulthandler
import json
import os
import re
import resource
import signal
import sys
import time
import traceback
import warnings
from pathlib import Path
from typing import Any

import numpy as np

CASE_CPU_S = 30
"""CPU time that a case may take at most; a case holds up to some dozens of frames or a few runs of the command."""
ADDRESS_SPACE = 8 << 30
"""Bytes of address space, libraries included: what promises more is to be refused, not tried."""
RESIDENT = 2 << 30
"""Bytes of memory in use at most, after a case."""


def main() -> None:
    """Answer lines until there are no more."""
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what the cases print goes to the log
    _warm_up()
    faulthandler.enable()
    faulthandler.register(signal.SIGXCPU, all_threads=True, chain=True)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, resource.getrlimit(resource.RLIMIT_AS)[1]))
    warnings.simplefilter("error")
    for line in sys.stdin:
        request = json.loads(line)
        answers.write(json.dumps(_answer(**request)) + "\n")


def _warm_up() -> None:
    """Load the kernels, which compiles those that are new: that is no case's time."""
    import dloftbs

    mask = np.zeros((40, 90), np.uint8)
    mask[18:23, 5:85] = mask[2:38, 40:45] = 1
    camera = dloftbs.PinholeCamera(100.0, 100.0, 45.0, 20.0)
    frame = dloftbs.Frame(mask=mask, depth=np.full(mask.shape, 0.7), camera=camera)
    for config in (dloftbs.Config(), dloftbs.Config.paper()):
        pipeline = dloftbs.Pipeline(config)
        for _ in range(3):
            pipeline.process(frame)


def _answer(family: str, seed: int, number: int, folder: str) -> dict[str, Any]:
    from fuzz.families import FAMILIES

    since = time.process_time()
    resource.setrlimit(resource.RLIMIT_CPU, (int(_cpu_s()) + CASE_CPU_S, resource.getrlimit(resource.RLIMIT_CPU)[1]))
    case, error, text = None, None, ""
    try:
        case = FAMILIES[family].case(seed, number)
        FAMILIES[family].check(case, Path(folder))
        used = peak_resident()
        assert used < RESIDENT, f"{used >> 20} MiB of memory in use"
    except Exception as caught:  # noqa: BLE001 - whatever it is, it is a finding
        error, text = type(caught).__name__, traceback.format_exc()
        _keep(case, Path(folder))
    return {"error": error, "text": text, "cpu_s": time.process_time() - since}


def peak_resident() -> int:
    """Bytes of memory that this process had in use at most since it was started.

    ``ru_maxrss`` is no measure of it on Linux: it begins with what the parent had in use at the time of the fork.
    """
    status = Path("/proc/self/status")
    if status.exists():
        peak = re.search(r"^VmHWM:\s+(\d+) kB$", status.read_text(encoding="ascii"), re.MULTILINE)
        assert peak is not None, "the kernel names no peak of the resident memory"
        return int(peak.group(1)) << 10
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used if sys.platform == "darwin" else used << 10


def _cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _keep(case: Any, folder: Path) -> None:
    """Write a case down beside what it left."""
    if isinstance(case, np.ndarray) and not case.dtype.hasobject:
        np.save(folder / "case.npy", case)
    else:
        (folder / "case.txt").write_text(repr(case)[:1_000_000], encoding="utf-8", errors="backslashreplace")


if __name__ == "__main__":
    main()
