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


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of hostile input, so that ``-m "not fuzz"`` leaves them out."""
    fuzz = Path(__file__).parent / "fuzz"
    for item in items:
        if item.path.is_relative_to(fuzz):
            item.add_marker(pytest.mark.fuzz)


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
