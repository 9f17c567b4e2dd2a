"""The examples in the docstrings do what they say."""

from __future__ import annotations

import doctest
import importlib
import pkgutil

import dloftbs

MODULES = [
    info.name for info in pkgutil.walk_packages(dloftbs.__path__, "dloftbs.") if not info.name.endswith("__main__")
]


def test_examples() -> None:
    results = {name: doctest.testmod(importlib.import_module(name)) for name in MODULES}
    assert [name for name, result in results.items() if result.failed] == []
    assert sum(result.attempted for result in results.values()) >= 8
