"""What all tests share: the same hypothesis examples on every run, and the data that lies beside the checkout."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings

# Few are for kernels as plain Python, which take a hundred times as long.
for profile, examples in (("few", 10), ("dloftbs", 50), ("thorough", 500)):
    settings.register_profile(profile, derandomize=True, deadline=None, max_examples=examples, database=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "dloftbs"))


PLAIN_CASES = 2
"""Most cases of a test with kernels as plain Python: these few show an index out of bounds as well as all do."""


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the tests of hostile input, and leave out cases where kernels are plain Python."""
    fuzz = Path(__file__).parent / "fuzz"
    for item in items:
        if item.path.is_relative_to(fuzz):
            item.add_marker(pytest.mark.fuzz)
    if os.environ.get("NUMBA_DISABLE_JIT") == "1":
        cases: dict[str, list[pytest.Item]] = {}
        for item in items:
            cases.setdefault(item.nodeid.partition("[")[0], []).append(item)
        kept = {item for alike in cases.values() for item in alike[:: -(-len(alike) // PLAIN_CASES)]}
        config.hook.pytest_deselected(items=[item for item in items if item not in kept])
        items[:] = [item for item in items if item in kept]


def pytest_runtest_setup() -> None:
    """Let numba know the helpers, which tests compile by themselves; kernels from the cache do without."""
    compiler = sys.modules.get("dloftbs.kernels.compiler")
    if compiler is not None:
        compiler.install_helpers()


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of masks and photographs, or skip the test where it is absent."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("needs ../shared/data")
    return folder
