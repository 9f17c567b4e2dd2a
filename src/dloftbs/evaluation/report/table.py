"""A table, and its forms: Markdown, CSV, and text for a terminal."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

Cell = str | int | float | None
NOTHING = "-"


@dataclass(frozen=True)
class Table:
    """Rows of figures under one title.

    Parameters
    ----------
    name : str
        For files.
    title : str
    columns : tuple of str
        With units.
    rows : tuple of tuple
        As many cells as there are columns; None is a figure that does not exist.
    note : str
        Notes that a reader needs to read the figures.
    """

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""

    def compact(self) -> Table:
        """Return the table without the columns in which there is nothing."""
        kept = [i for i in range(len(self.columns)) if any(row[i] is not None for row in self.rows)]
        rows = tuple(tuple(row[i] for i in kept) for row in self.rows)
        return replace(self, columns=tuple(self.columns[i] for i in kept), rows=rows)

    def markdown(self) -> str:
        """Return the table as Markdown, under a heading of the third level."""
        lines = [_bar(self.columns), _bar("---" if i < self._words else "---:" for i in range(len(self.columns)))]
        lines += [_bar(shown(cell) for cell in row) for row in self.rows]
        parts = [f"### {self.title}", "\n".join(lines)] + ([self.note] if self.note else [])
        return "\n\n".join(parts) + "\n"

    def csv(self) -> str:
        """Return the table as CSV, with figures in full."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows(self.rows)
        return out.getvalue()

    def text(self) -> str:
        """Return the table as aligned text."""
        cells = [list(self.columns)] + [[shown(cell) for cell in row] for row in self.rows]
        widths = [max(len(row[i]) for row in cells) for i in range(len(self.columns))]
        lines = ["  ".join(self._aligned(i, cell, widths[i]) for i, cell in enumerate(row)).rstrip() for row in cells]
        return "\n".join([self.title, *(f"  {line}" for line in lines)])

    @property
    def _words(self) -> int:
        """Number of columns from the left that hold words."""
        words = (all(isinstance(row[i], str) for row in self.rows) for i in range(len(self.columns)))
        return next((i for i, only_words in enumerate(words) if not only_words), len(self.columns))

    def _aligned(self, column: int, cell: str, width: int) -> str:
        return cell.ljust(width) if column < self._words else cell.rjust(width)


def shown(cell: Cell) -> str:
    """Return a cell as it is read: figures with two decimals, or three where they are below 1."""
    if cell is None or cell == "":
        return NOTHING
    if isinstance(cell, float):
        return f"{cell:.2f}" if abs(cell) >= 1.0 or cell == 0.0 else f"{cell:.3f}"
    return str(cell)


def mean(values: Iterable[float | None]) -> float | None:
    """Return the mean of those that exist, or None."""
    known = existing(values)
    return sum(known) / len(known) if known else None


def median(values: Iterable[float | None], share: float = 0.5) -> float | None:
    """Return the value below which a share of those that exist lies, or None."""
    known = sorted(existing(values))
    return known[min(int(share * len(known)), len(known) - 1)] if known else None


def percent(share: float | None) -> float | None:
    """Return a share as a percentage, if there is one."""
    return None if share is None else 100.0 * share


def existing(values: Iterable[float | None]) -> list[float]:
    """Return the values that exist."""
    return [value for value in values if value is not None]


def _bar(cells: Iterable[str] | Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
