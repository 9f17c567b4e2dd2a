"""The English of the docstrings, as far as it can be counted."""

from __future__ import annotations

from pathlib import Path

import pytest
from benchmarks.english import findings

import dloftbs

MAX_RELATIVE = 10
"""Docstrings that may open with a relative clause: fewer than this. A fragment can be right; a habit is not."""


def kinds(tmp_path: Path, source: str) -> list[str]:
    path = tmp_path / "module.py"
    path.write_text(source, encoding="utf-8")
    return [finding.kind for finding in findings(path)]


def test_few_docstrings_open_with_a_relative_clause():
    found = [finding for file in sorted(Path(dloftbs.__file__).parent.rglob("*.py")) for finding in findings(file)]
    openings = [f"{finding.path}:{finding.line}: {finding.text}" for finding in found if finding.kind == "openings"]
    assert len(openings) < MAX_RELATIVE, "\n".join(openings)


@pytest.mark.parametrize("opening", ["What is left", "Where it lies", "By which end", "Whether it is closed"])
@pytest.mark.parametrize("place", ['"""{} of a mask."""', 'def f():\n    """{} of a mask."""', 'A = 1\n"""{} here."""'])
def test_an_opening_is_found_in_modules_functions_and_constants(tmp_path, opening, place):
    assert "openings" in kinds(tmp_path, place.format(opening))


@pytest.mark.parametrize("opening", ["Masks that are clean", "Return what is left", "Somewhat longer lines"])
def test_a_subject_or_a_verb_in_front_is_no_finding(tmp_path, opening):
    assert "openings" not in kinds(tmp_path, f'"""{opening}."""')
