"""The English of docstrings, pages and help texts, as far as it can be counted."""

from __future__ import annotations

from pathlib import Path

import pytest
from benchmarks.english import MAX_WORDS, findings, help_pages, page_findings, sentences

import dloftbs

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "ros2").rglob("*.md")])
MAX_RELATIVE = 10
"""Docstrings that may open with a relative clause: fewer than this. A fragment can be right; a habit is not."""


def kinds(tmp_path: Path, source: str) -> list[str]:
    path = tmp_path / "module.py"
    path.write_text(source, encoding="utf-8")
    return [finding.kind for finding in findings(path)]


def kinds_of_page(page: str) -> list[str]:
    return [finding.kind for finding in page_findings(Path("page.md"), page)]


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


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_a_page_has_short_sentences_with_the_subject_first(page):
    assert [f"{found.line}: {found.kind}: {found.text}" for found in findings(page)] == []


@pytest.mark.parametrize(("name", "page"), [pytest.param(*one, id=str(one[0])) for one in help_pages()])
def test_so_has_the_help_of_a_command(name, page):
    assert [f"{found.kind}: {found.text}" for found in page_findings(name, page)] == []


def test_a_long_sentence_is_found_in_paragraphs_items_and_cells():
    words = "word " * (MAX_WORDS + 4)
    assert kinds_of_page(f"Short.\n\n{words.strip()}.\n") == ["long", "mean"]
    assert kinds_of_page(f"- {words}\n- Short.\n- Short.\n- Short.\n") == ["long"]
    assert kinds_of_page(f"| a | b |\n| --- | --- |\n| {words} | Short |\n") == ["long"]
    assert kinds_of_page(f"```text\n{words}\n```\n# {words}\n<!-- {words} -->\n") == []


def test_a_relative_clause_in_front_is_found_and_a_question_is_none():
    assert kinds_of_page("What it finds is printed. It ends. Where is it?\n") == ["relative"]
    assert kinds_of_page("**Ends.** Where it ends, it is cut.\n") == ["relative"]


def test_sentences_have_their_line_and_code_and_links_as_words():
    page = "# Title\n\nOne `a b c` and [a link](x.md),\ne.g. this. Two\nwords.\n\n| cell | other |\n"
    assert [(one.line, one.words, one.in_table) for one in sentences(page)] == [
        (3, 7, False),
        (3, 2, False),
        (7, 1, True),
        (7, 1, True),
    ]
