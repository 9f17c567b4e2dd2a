"""A fixed number of cases of each family, about a minute of CPU time; ``make fuzz`` runs others until it is stopped."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from fuzz.families import FAMILIES
from fuzz.family import SUITE_SEED
from fuzz.runner import Runner

if sys.platform == "win32":
    pytest.skip("limits of CPU time and memory are those of POSIX", allow_module_level=True)

MIN_CASES = {
    "noise": 20,
    "labyrinths": 20,
    "combs": 20,
    "rings": 20,
    "spirals": 20,
    "fractals": 20,
    "letters": 20,
    "stars": 20,
    "tangles": 20,
    "bars": 20,
    "grids": 20,
    "pixels": 20,
    "borders": 20,
    "thickness": 20,
    "zigzags": 20,
    "real": 20,
    "border-blobs": 20,
    "cables-seen": 100,
    "border-blobs-seen": 104,
    "tangles-seen": 100,
    "anything-seen": 107,
    "mask-layouts": 100,
    "wrong-arrays": 128,
    "depth": 46,
    "colours": 20,
    "moving": 20,
    "changing": 30,
    "crowds": 3,
    "come-and-go": 11,
    "long-streams": 1,
    "bare-curves": 40,
    "cameras": 8,
    "frames": 9,
    "settings": 8,
    "dictionaries": 10,
    "colour-ranges": 3,
    "curves": 4,
    "calibrations": 104,
    "images": 68,
    "videos": 40,
    "stacks": 103,
    "lines": 26,
    "calls": 67,
    "over-inputs": 52,
    "kills": 3,
    "full-disks": 24,
    "two-writers": 3,
    "names": 28,
    "endings": 8,
}
"""Cases of each family in the suite: families and counts only grow."""


@pytest.fixture(scope="module")
def runner() -> Iterator[Runner]:
    with Runner() as runner:
        yield runner


@pytest.mark.parametrize("name", FAMILIES)
def test_nothing_is_found(name: str, runner: Runner) -> None:
    family = FAMILIES[name]
    outcomes = [runner.run(family, SUITE_SEED, number) for number in range(family.suite_cases)]
    found = [outcome for outcome in outcomes if outcome.error is not None]
    text = "\n".join(str(outcome) for outcome in found)
    assert not found, text


_PARENT = """
import subprocess, sys
held = b"x" * (500 << 20)
child = "from fuzz.worker import peak_resident; print(peak_resident())"
subprocess.run([sys.executable, "-c", child], check=True)
"""


def test_a_workers_memory_is_its_own_and_not_its_parents() -> None:
    tests = Path(__file__).parents[1]
    answer = subprocess.run([sys.executable, "-c", _PARENT], cwd=tests, capture_output=True, text=True, check=True)
    assert 1 << 20 < int(answer.stdout) < 400 << 20


def test_families_and_cases_only_grow() -> None:
    assert {name: family.suite_cases for name, family in FAMILIES.items()} == MIN_CASES


def test_a_case_depends_on_its_seed_and_number_alone() -> None:
    family = FAMILIES["tangles"]
    assert (family.case(7, 3) == family.case(7, 3)).all()
    assert family.case(7, 3).tobytes() != family.case(7, 4).tobytes()
    assert family.case(7, 3).tobytes() != family.case(8, 3).tobytes()
