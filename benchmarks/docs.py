"""Where the figures go: to standard output, and between two marks of a page where one is named."""

from __future__ import annotations

import argparse
import io
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path


def arguments(description: str | None, quick: str) -> argparse.ArgumentParser:
    """Return a parser of the options that all benchmarks have: ``--quick`` and ``--docs PAGE``."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help=quick)
    parser.add_argument("--docs", type=Path, metavar="PAGE", help="put what is printed into this page, too")
    return parser


@contextmanager
def published(name: str, page: Path | None) -> Iterator[None]:
    """Print what the block prints, and put it between ``<!-- made: NAME -->`` and ``<!-- end -->`` of the page.

    Raises
    ------
    ValueError
        If the page has no such marks; then nothing has been measured yet.
    """
    if page is None:
        yield
        return
    block = re.compile(rf"(<!-- made: {re.escape(name)} -->\n).*?(<!-- end -->)", re.DOTALL)
    if not block.search(page.read_text("utf-8")):
        raise ValueError(f"{page} has no place for the figures of {name!r}")
    text = io.StringIO()
    with redirect_stdout(_Both(text)):
        yield
    # Read again: another benchmark may have written its own block meanwhile.
    made = block.sub(lambda old: f"{old[1]}```text\n{text.getvalue().strip()}\n```\n{old[2]}", page.read_text("utf-8"))
    page.write_text(made, "utf-8")


class _Both(io.TextIOBase):
    """Writes to standard output as well as to a text that is kept."""

    def __init__(self, kept: io.StringIO) -> None:
        self._kept, self._shown = kept, sys.stdout

    def write(self, text: str) -> int:
        self._shown.write(text)
        self._shown.flush()
        return self._kept.write(text)
