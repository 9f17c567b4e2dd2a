"""The site: `make docs`. The pages are plain Markdown, and three things are made of them here.

- The headings and lists of links of index.md become the table of contents.
- The lists of names and commands on the pages of the reference become their docstrings and help texts.
- Links to files outside of docs/ become their names, since the site does not have these files.
"""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import Any

import click
from sphinx.ext.napoleon.docstring import NumpyDocstring

import dloftbs
from dloftbs.cli import main

DOCS = Path(__file__).parent

project = "dloftbs"
author = "The dloftbs developers"
copyright = author
version = release = dloftbs.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
exclude_patterns = ["requirements.txt"]
default_role = "py:obj"
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]
autodoc_typehints = "none"  # docstrings have the types
autodoc_member_order = "bysource"
autoclass_content = "class"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
python_use_unqualified_type_names = True
html_theme = "furo"
html_title = f"dloftbs {release}"
html_static_path: list[str] = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False

NAME = re.compile(r"^- `(dloftbs[\w.]*)`$", re.MULTILINE)
COMMAND = re.compile(r"^- `dloftbs ([\w-]+)`$", re.MULTILINE)
LINK = re.compile(r"^- \[([^]]+)\]\(([\w./-]+\.md)\)", re.MULTILINE)
OUTSIDE = re.compile(r"(?<!!)\[([^]]+)\]\(((?:\.\./)+[\w./-]*)(?:#[\w-]+)?\)")


parse_sections = NumpyDocstring._parse


def parse_as_method(self: NumpyDocstring) -> None:
    """Read the docstring of a property as that of a method; else its first line, up to a colon, is taken for a type."""
    self._what = "method" if self._what == "property" else self._what
    parse_sections(self)


NumpyDocstring._parse = parse_as_method


def contents(index: str) -> str:
    """Return the tables of contents that the headings and links of the first page describe."""
    trees = []
    for section in re.split(r"^## ", index, flags=re.MULTILINE)[1:]:
        caption, _, text = section.partition("\n")
        pages = [f"{title} <{page}>" for title, page in LINK.findall(text)]
        trees.append("\n".join(["```{toctree}", ":hidden:", f":caption: {caption}", "", *pages, "```"]))
    return "\n\n".join([index, *trees])


def documented(name: str) -> str:
    """Return the directive that prints the docstring of a public name."""
    module, _, last = name.rpartition(".")
    value = getattr(importlib.import_module(module), last)
    kind, options = "data", "   :no-value:\n"
    if isinstance(value, type):
        kind, options = "class", "   :members:\n"
        if issubclass(value, BaseException):
            kind, options = "exception", ""
    elif callable(value):
        kind, options = "function", ""
    return f"```{{eval-rst}}\n.. auto{kind}:: {name}\n{options}```\n"


def help_of(name: str) -> str:
    """Return the block of text that ``dloftbs NAME --help`` prints."""
    context = click.Context(main, info_name="dloftbs", max_content_width=90, terminal_width=90)
    command = main.commands[name]
    return f"```text\n{command.get_help(click.Context(command, parent=context, info_name=name))}\n```\n"


def outside_as_text(page: Path, text: str) -> str:
    """Return a page on which links that leave the folder of the documents are names of files."""

    def replaced(link: re.Match[str]) -> str:
        target = (page.parent / link[2]).resolve()
        return link[0] if target.is_relative_to(DOCS) else f"{link[1]} (`{target.relative_to(DOCS.parent)}`)"

    return OUTSIDE.sub(replaced, text)


def on_source(app: Any, name: str, source: list[str]) -> None:
    """Turn the plain Markdown of a page into that of the site."""
    text = outside_as_text(DOCS / f"{name}.md", source[0])
    if name == "index":
        text = contents(text)
    if name == "results":
        text += "\n```{toctree}\n:hidden:\n:glob:\n\nresults/*\n```\n"
    if name.startswith("results/"):
        text = text.replace("\n### ", "\n## ")
    if name.startswith("reference/"):
        text = NAME.sub(lambda found: documented(found[1]), text)
        text = COMMAND.sub(lambda found: help_of(found[1]), text)
    source[0] = text


def setup(app: Any) -> None:
    """Connect to Sphinx."""
    app.connect("source-read", on_source)
