"""What all tests share: the same hypothesis examples on every run, and the data that lies beside the checkout."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("dloftbs", derandomize=True, deadline=None, max_examples=200, database=None)
settings.load_profile("dloftbs")


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
