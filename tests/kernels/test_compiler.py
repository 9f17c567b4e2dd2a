"""Kernels in the cache on disk, and what makes them be compiled again."""

from __future__ import annotations

import gc
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from numba import float64, njit

from dloftbs.kernels import cache_places, compiler, helper_code, kernel_cache

PROBE = """
from numba import int64
from dloftbs.kernels.compiler import kernel
from dloftbs.kernels.shared.numbers import number
from dloftbs.room.tens import ten

@kernel(int64)
def probe(x):
    return ten() * number() + x
"""


@pytest.fixture
def package(tmp_path):
    """Return a package with the compiler, a shared helper, and a folder with a helper and a kernel that calls both."""
    shared, room = tmp_path / "dloftbs" / "kernels" / "shared", tmp_path / "dloftbs" / "room"
    shared.mkdir(parents=True)
    room.mkdir()
    for folder in (tmp_path / "dloftbs", shared.parent, shared, room):
        (folder / "__init__.py").touch()
    for module in (cache_places, compiler, helper_code, kernel_cache):
        shutil.copy(module.__file__, shared.parent)
    (room / "probe.py").write_text(PROBE)
    write_helper(shared / "numbers.py", "number", 1)
    write_helper(room / "tens.py", "ten", 10)
    return tmp_path


def write_helper(path: Path, name: str, number: int) -> None:
    """Write a helper, which returns a number."""
    path.write_text(f"from dloftbs.kernels.compiler import helper\n\n@helper\ndef {name}():\n    return {number}\n")


def run_probe(package: Path) -> tuple[int, bool]:
    """Return what the kernel returns in a process of its own, and whether it came from the cache."""
    code = "from dloftbs.room.probe import probe; print(probe(0), sum(probe.stats.cache_hits.values()))"
    environment = dict(os.environ, PYTHONPATH=str(package), NUMBA_CACHE_DIR=str(package / "cache"))
    done = subprocess.run(
        [sys.executable, "-B", "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    found, hits = done.stdout.split()
    return int(found), hits == "1"


def test_a_kernel_notices_a_change_of_a_helper(package):
    assert run_probe(package) == (10, False)
    assert run_probe(package) == (10, True)
    write_helper(package / "dloftbs" / "kernels" / "shared" / "numbers.py", "number", 2)
    assert run_probe(package) == (20, False)
    write_helper(package / "dloftbs" / "room" / "tens.py", "ten", 20)
    assert run_probe(package) == (40, False)
    assert run_probe(package) == (40, True)


CALLERS = """
from numba import float64, int64
from dloftbs.kernels.compiler import kernel

@kernel(float64)
def half(x):
    return 0.5 * x

@kernel(int64)
def halves(n):
    return half(n) + half(half(n))
"""


def test_a_kernel_takes_in_one_that_came_from_the_cache(package):
    """As after a first start that was interrupted: the one is in the cache, and the other is not."""
    (package / "dloftbs" / "room" / "callers.py").write_text(CALLERS)
    code = (
        "from dloftbs.room.callers import half, halves\n"
        "print(half(6.0), halves(6), *(sum(one.stats.cache_hits.values()) for one in (half, halves)))"
    )
    environment = dict(os.environ, PYTHONPATH=str(package), NUMBA_CACHE_DIR=str(package / "cache"))

    def run() -> list[str]:
        command = [sys.executable, "-B", "-c", code]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()

    assert run() == ["3.0", "4.5", "0", "0"]
    for file in (package / "cache").glob("**/callers.halves-*"):
        file.unlink()
    assert run() == ["3.0", "4.5", "1", "0"]
    assert run() == ["3.0", "4.5", "1", "1"]


def test_a_kernel_from_the_cache_needs_no_helpers(package):
    code = (
        "from dloftbs.kernels import compiler\n"
        "from dloftbs.room.probe import probe\n"
        "print(probe(0), len(compiler._helpers))"
    )
    environment = dict(os.environ, PYTHONPATH=str(package), NUMBA_CACHE_DIR=str(package / "cache"))
    command = [sys.executable, "-B", "-c", code]
    found = [subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout for _ in "12"]
    assert found == ["10 2\n", "10 0\n"]


UNUSED = """
import numba.core.dispatcher
from dloftbs.room.callers import half, halves
assert half.signatures == halves.signatures == [], "importing compiles nothing"
assert half(6.0) == 3.0
assert halves.signatures == [], "what is not called is not compiled"
assert halves(6) == 4.5
assert list(map(str, halves.signatures)) == ["(int64,)"]
try:
    half("x")
except TypeError:
    print("as stated")
"""


def test_a_kernel_is_compiled_when_it_is_called_and_for_no_other_types(package):
    (package / "dloftbs" / "room" / "callers.py").write_text(CALLERS)
    environment = dict(os.environ, PYTHONPATH=str(package), NUMBA_CACHE_DIR=str(package / "cache"))
    command = [sys.executable, "-B", "-c", UNUSED]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "as stated\n"


def test_a_kernel_that_links_another_one_compiles_it_as_stated(package):
    (package / "dloftbs" / "room" / "callers.py").write_text(CALLERS)
    code = (
        "from dloftbs.room.callers import half, halves\n"
        "print(halves(6), *half.signatures)"  # called with an int64, too
    )
    environment = dict(os.environ, PYTHONPATH=str(package), NUMBA_CACHE_DIR=str(package / "cache"))
    command = [sys.executable, "-B", "-c", code]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "4.5 (float64,)\n"


TWO_THREADS = """
import threading
from dloftbs.room.callers import half, halves
gate, found = threading.Barrier(8), []

def call(function, value):
    gate.wait()
    found.append(function(value))

threads = [threading.Thread(target=call, args=(function, 6)) for function in (half, halves) * 4]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(*sorted(found))
"""


def test_threads_may_call_a_kernel_for_the_first_time_at_once(package):
    (package / "dloftbs" / "room" / "callers.py").write_text(CALLERS)
    environment = dict(os.environ, PYTHONPATH=str(package), NUMBA_CACHE_DIR=str(package / "cache"))
    command = [sys.executable, "-B", "-c", TWO_THREADS]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout == "3.0 3.0 3.0 3.0 4.5 4.5 4.5 4.5\n"


def test_compilation_is_announced_and_counted_every_few_seconds(monkeypatch, caplog):
    now = [100.0]
    monkeypatch.setattr(compiler, "monotonic", lambda: now[0])
    progress = compiler.Progress()
    for second in range(12):
        now[0] = 100.0 + second
        progress.begin()
        progress.add()
    announced, *counted = [(one.levelname, one.getMessage()) for one in caplog.records]
    assert announced[0] == "WARNING"
    assert announced[1].startswith("compiling kernels, once for this machine and version")
    assert counted == [("WARNING", "6 kernels compiled in 5 s"), ("WARNING", "11 kernels compiled in 10 s")]


def test_a_helper_is_python_s_own_function_and_part_of_a_kernel():
    @compiler.helper
    def twice(x):
        return 2 * x

    assert twice(2.5) == 5.0
    compiler.install_helpers()
    assert njit(lambda x: twice(x) + 1)(3) == 7


def test_no_machine_code_is_made_of_a_helper():
    @compiler.helper
    def halved(x):
        return x / 2

    compiler.install_helpers()
    compiler._helpers[-1].compile((float64,))
    library = compiler._helpers[-1].overloads[(float64,)].library
    assert isinstance(library, helper_code._LinkedCode)
    with pytest.raises(RuntimeError, match="no compiled object"):
        library._get_compiled_object()
    assert njit(lambda x: 2 * halved(x))(3.0) == 3.0


def test_what_a_helper_raises_is_raised_by_a_kernel():
    @compiler.helper
    def inverse(x):
        if x == 0:
            raise ValueError("none")
        return 1 / x

    compiler.install_helpers()
    with pytest.raises(ValueError, match="none"):
        njit(lambda x: 2 * inverse(x))(0.0)
    with pytest.raises(ZeroDivisionError):
        njit(lambda x: 1.0 / (inverse(x) - inverse(x)))(2.0)


def test_the_collection_of_garbage_goes_on_as_it_did():
    gc.disable()
    try:
        with compiler._no_collection():
            assert not gc.isenabled()
        assert not gc.isenabled()
    finally:
        gc.enable()
    with compiler._no_collection():
        assert not gc.isenabled()
    assert gc.isenabled()
