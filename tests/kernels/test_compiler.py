"""Kernels in the cache on disk, and what makes them be compiled again."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from dloftbs.kernels import compiler

PROBE = """
from numba import int64
from dloftbs.kernels.compiler import kernel
from dloftbs.kernels.shared.numbers import number

@kernel(int64)
def probe(x):
    return number() + x
"""


@pytest.fixture
def package(tmp_path):
    """Return a package with the compiler, one shared helper and one kernel that calls it."""
    shared = tmp_path / "dloftbs" / "kernels" / "shared"
    shared.mkdir(parents=True)
    for folder in (tmp_path / "dloftbs", shared.parent, shared):
        (folder / "__init__.py").touch()
    shutil.copy(compiler.__file__, shared.parent)
    (tmp_path / "dloftbs" / "probe.py").write_text(PROBE)
    write_helper(tmp_path, 1)
    return tmp_path


def write_helper(package: Path, number: int) -> None:
    """Write the helper, which returns a number."""
    (package / "dloftbs" / "kernels" / "shared" / "numbers.py").write_text(
        f"from dloftbs.kernels.compiler import helper\n\n@helper\ndef number():\n    return {number}\n"
    )


def run_probe(package: Path) -> tuple[int, bool]:
    """Return what the kernel returns in a process of its own, and whether it came from the cache."""
    code = "from dloftbs.probe import probe; print(probe(0), sum(probe.stats.cache_hits.values()))"
    environment = dict(os.environ, PYTHONPATH=str(package), NUMBA_CACHE_DIR=str(package / "cache"))
    done = subprocess.run(
        [sys.executable, "-B", "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    found, hits = done.stdout.split()
    return int(found), hits == "1"


def test_a_kernel_notices_a_change_of_a_shared_helper(package):
    assert run_probe(package) == (1, False)
    assert run_probe(package) == (1, True)
    write_helper(package, 2)
    assert run_probe(package) == (2, False)
    assert run_probe(package) == (2, True)
