"""Python code that runs in a process of its own, with a limit to its time and its memory."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SECONDS = 120
"""Many times what any of it takes, even where kernels are compiled first."""

_LIMITED = """\
import resource
held = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (held + {extra}, held + {extra}))
"""


def run_bounded(code: str, *arguments: object, first: str = "", extra_bytes: int | None = None) -> str:
    """Return what code prints; fails where it does not end in time, or ends badly.

    With `extra_bytes` (Linux), it may take so much more address space than it has after the code that comes `first`,
    such as imports.
    """
    limits = "" if extra_bytes is None else _LIMITED.format(extra=extra_bytes)
    command = [sys.executable, "-c", f"{first}\n{limits}\n{code}", *map(str, arguments)]
    paths = {"cwd": Path(__file__).parent}
    done = subprocess.run(command, **paths, capture_output=True, text=True, timeout=SECONDS, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout
