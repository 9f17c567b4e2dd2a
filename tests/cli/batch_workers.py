"""Work for processes in tests: a module of its own, which they import."""

from __future__ import annotations

import os
import time


def square(job: int) -> int:
    """Return the square; die of 3, and take a while for 10 and more."""
    if job == 3:
        os._exit(7)
    if job >= 10:
        time.sleep(60.0)
    return job * job


def died(job: int, exit_code: int | None) -> int:
    return -1000 * job - (exit_code or 0)
