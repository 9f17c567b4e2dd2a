"""On what all was measured."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version
from pathlib import Path

_LIBRARIES = ("numpy", "scipy", "numba", "opencv-python-headless")


def machine() -> str:
    """Return the processor and the versions, in two lines."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    model = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    libraries = ", ".join(f"{name} {version(name)}" for name in _LIBRARIES)
    return f"{model or platform.machine()}, {os.cpu_count()} cores\nPython {platform.python_version()}, {libraries}"
