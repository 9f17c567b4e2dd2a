"""The page of the architecture: every path and type that it names is there, and its picture has the stages in order."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import numpy as np
import pytest
from drawings import draw_cable, wave

import dloftbs

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "dloftbs"
LAB = ROOT / "src" / "dloftbs_lab"
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
PICTURE = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)[0]
PATH = re.compile(r"[\w/]*(?:\w\.py\b|\w/(?![\w/]))")
CHANGES = 10
"""Typical changes that the page has to tell the file of, at least."""


def paths_in(text: str) -> list[str]:
    return sorted(set(PATH.findall(text)))


def python_in(folder: str) -> list[Path]:
    return sorted((ROOT / folder).rglob("*.py"))


def rows_below(heading: str) -> list[list[str]]:
    """Return the cells of the table whose head begins with a heading."""
    table = PAGE[PAGE.index(f"| {heading} |") :].partition("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table]


def test_every_path_of_the_page_exists():
    tops = (PACKAGE, PACKAGE / "pipeline", LAB, ROOT)
    assert [path for path in paths_in(PAGE) if not any((top / path).exists() for top in tops)] == []


def test_every_file_of_code_that_a_page_names_exists():
    files = [f"/{file.relative_to(ROOT)}" for top in ("src", "tests", "benchmarks", "ros2") for file in python_in(top)]
    for page in sorted((ROOT / "docs").glob("*.md")):
        code = [path for path in paths_in(page.read_text(encoding="utf-8")) if path.endswith(".py")]
        assert [path for path in code if not any(file.endswith(f"/{path}") for file in files)] == [], page.name


def test_paths_are_found_in_text():
    text = "`sinks/` in [x](docs/x.md), `kernels/shared/cubics.py`, stages.py: 2 px / frame, `cli/`."
    assert paths_in(text) == ["cli/", "kernels/shared/cubics.py", "sinks/", "stages.py"]


def test_every_type_stands_in_its_file():
    for names, file, *_ in rows_below("type"):
        (path,) = [top / file.strip("`") for top in (PACKAGE, LAB) if (top / file.strip("`")).is_file()]
        tree = ast.parse(path.read_text(encoding="utf-8"))
        defined = {node.name for node in tree.body if isinstance(node, ast.ClassDef)}
        assert set(re.findall(r"`(\w+)`", names)) <= defined


def test_the_page_names_a_file_for_every_typical_change():
    rows = rows_below("change")
    assert len(rows) >= CHANGES
    assert all(any((top / row[1].strip("`")).is_file() for top in (PACKAGE, LAB)) for row in rows)


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("measure_roundness", "skeleton/kernels/branch_ends.py"),
        ("make_tracker", "pipeline/pipeline.py"),
        ("detect", "api.py"),
        ("track", "api.py"),
    ],
)
def test_every_function_that_the_page_names_stands_in_its_file(name, file):
    assert f"`{name}`" in PAGE
    assert f"\ndef {name}(" in (PACKAGE / file).read_text(encoding="utf-8")


def test_the_picture_has_the_stages_in_the_order_in_which_they_run():
    mask = draw_cable(wave((240, 400)), 9, (240, 400))
    ran = dloftbs.Pipeline().process(dloftbs.Frame(mask=np.asarray(mask))).stage_ms
    rooms = re.findall(r"^ (?:fitting/(?=crossings))?(\w+)/ ", PICTURE, re.MULTILINE)
    assert rooms == ["sources", *(stage for stage in ran if stage != "segments")]
