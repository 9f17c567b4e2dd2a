"""The documents as a whole: every link leads somewhere, every page and every public name has its place."""

from __future__ import annotations

import importlib
import inspect
import re
import types
from pathlib import Path

import pytest
from benchmarks import page_pictures

import dloftbs
from dloftbs.cli import main

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted([*ROOT.glob("*.md"), *DOCS.rglob("*.md"), *(ROOT / "ros2").rglob("*.md")])
ROOMS = ("camera", "pipeline", "robot", "segmentation", "stereo", "tracking")
"""Rooms besides those that `dloftbs` itself names whose `__all__` is public."""

FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)


def prose(page: Path) -> str:
    """Return a page without its blocks of code."""
    return FENCE.sub("", page.read_text(encoding="utf-8"))


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as forges and the site make them."""
    plain = (re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading) for heading in HEADING.findall(prose(page)))
    return {re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in plain}


def broken(page: Path) -> list[str]:
    """Return the links of a page that lead nowhere; those to the network are not followed."""
    found = []
    for link in LINK.findall(re.sub(r"`[^`\n]*`", "", prose(page))):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            found.append(link)
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_somewhere(page):
    assert broken(page) == []


def test_a_broken_link_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# Here it is\n[a](#here-it-is) [b](page.md#here-it-is) [c](#there) [d](gone.md) `[e](code.md)`\n")
    assert broken(page) == ["#there", "gone.md"]


def test_every_picture_is_on_a_page():
    links = {(page.parent / link).resolve() for page in PAGES for link in LINK.findall(prose(page))}
    pictures = {path for path in (DOCS / "images").rglob("*") if path.is_file()}
    assert sorted(str(path.relative_to(DOCS)) for path in pictures - links) == []
    assert {DOCS / "images" / f"{name}.png" for name in page_pictures.PICTURES} <= pictures


def test_every_page_is_on_the_first_one():
    """The list of index.md is the table of contents of the site."""
    listed = [link for link in LINK.findall(prose(DOCS / "index.md")) if link.endswith(".md")]
    assert len(set(listed)) == len(listed)
    pages = {str(page.relative_to(DOCS)) for page in DOCS.rglob("*.md")}
    wanted = {page for page in pages if not page.startswith("results/")} - {"index.md"}
    assert wanted - set(listed) == set(), "name them in docs/index.md"


def is_documented(name: str, value: object) -> bool:
    """Return whether a value is a class or a function under its own name, and no alias of a type."""
    return (inspect.isclass(value) or inspect.isroutine(value)) and value.__name__ == name.rpartition(".")[2]


def test_every_public_name_is_in_the_reference_once():
    listed = [
        name
        for page in (DOCS / "reference").glob("*.md")
        for name in re.findall(r"^- `(dloftbs\.[\w.]+)`$", page.read_text(encoding="utf-8"), re.MULTILINE)
    ]
    assert len(set(listed)) == len(listed)
    values = {}
    for name in listed:
        module, _, last = name.rpartition(".")
        values[name] = getattr(importlib.import_module(module), last)
    rooms = [
        dloftbs,
        *(value for name in dloftbs.__all__ if isinstance(value := getattr(dloftbs, name), types.ModuleType)),
    ]
    rooms += [importlib.import_module(f"dloftbs.{room}") for room in ROOMS]
    public = {f"{room.__name__}.{name}": getattr(room, name) for room in rooms for name in room.__all__}
    documented = {name: value for name, value in public.items() if is_documented(name, value)}
    missing = [name for name, value in documented.items() if not any(value is one for one in values.values())]
    assert missing == [], "add them to a page of docs/reference, as a line `- `NAME``"
    assert set(listed) <= public.keys()


def test_every_command_is_in_the_reference():
    page = (DOCS / "reference" / "commands.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^- `dloftbs (\w+)`$", page, re.MULTILINE)) == set(main.commands)
