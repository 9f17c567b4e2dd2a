"""The page on Docker, clusters and read-only systems, and the Dockerfile that it leads to."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from dloftbs.cli import main
from dloftbs.kernels import cache_places

ROOT = Path(__file__).parents[1]
INSTRUCTIONS = [
    line.split(maxsplit=1)
    for line in (ROOT / "Dockerfile").read_text(encoding="utf-8").splitlines()
    if line and not line.startswith("#")
]
PAGE = (ROOT / "docs" / "deployment.md").read_text(encoding="utf-8")
PROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")


def index(*instruction):
    return INSTRUCTIONS.index(list(instruction))


def test_the_image_has_a_python_that_the_package_takes():
    (version,) = re.findall(r"^FROM python:3\.(\d+)-slim$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    (least,) = re.findall(r'requires-python = ">=3\.(\d+)"', PROJECT)
    assert int(version) >= int(least)


def test_the_extras_of_the_image_exist():
    (extras,) = re.findall(r'pip install --no-cache-dir "/src\[(.+)\]"', INSTRUCTIONS[2][1])
    assert all(f"\n{extra} = [" in PROJECT for extra in extras.split(","))


def test_kernels_are_compiled_by_root_for_any_processor_before_the_user_changes():
    processor, compiled, user = (
        index("ENV", "NUMBA_CPU_NAME=generic"),
        index("RUN", "dloftbs warmup"),
        index("USER", "nobody"),
    )
    assert processor < compiled < user
    assert "warmup" in main.commands


def test_the_image_starts_the_command():
    assert INSTRUCTIONS[-1] == ["ENTRYPOINT", '["dloftbs"]']
    (arguments,) = re.findall(r" dloftbs (\w+) mask\.png", PAGE)
    assert arguments in main.commands


def test_the_page_names_the_folders_in_their_order(monkeypatch):
    monkeypatch.setattr(cache_places.config, "CACHE_DIR", "")
    monkeypatch.setattr(cache_places, "_is_private", lambda folder: True)
    cache_places.list_places.cache_clear()
    own, user, temporary = cache_places.list_places(Path("source"))
    cache_places.list_places.cache_clear()
    assert (own.name, user.parent.name, temporary.parent.name.partition("-")[0]) == (
        "__pycache__",
        "dloftbs",
        "dloftbs",
    )
    assert PAGE.index("`__pycache__`") < PAGE.index("the user's cache") < PAGE.index("a private folder below the")


@pytest.mark.skipif(sys.platform == "win32", reason="the name of a processor's features differs")
def test_kernels_for_any_processor_have_files_of_their_own(tmp_path):
    nearest = "dloftbs_lab.evaluation.kernels.nearest_points"
    code = f"import {nearest}; from dloftbs.kernels import compiler; compiler.make_ready()"
    for name in ({}, {"NUMBA_CPU_NAME": "generic"}):
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), **name}
        subprocess.run([sys.executable, "-c", code], env=environment, check=True, timeout=120)
    assert len(list(tmp_path.glob("**/*.nbc"))) == 2
