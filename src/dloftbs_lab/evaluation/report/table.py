"""A table, and its forms: Markdown, CSV, and text for a terminal."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

Cell = str | int | float | None
NOTHING = "-"
LOW, HIGH = "low", "high"
"""Endings of the columns in files that hold the interval of the column before."""
RUN = "run"
"""Column in files of what a table is marked with."""


class Estimate(float):
    """A figure with the interval that it is known to lie in.

    Parameters
    ----------
    value, low, high : float
    """

    low: float
    high: float

    def __new__(cls, value: float, low: float, high: float) -> Estimate:
        """Return a number that is `value` in all arithmetic."""
        made = super().__new__(cls, value)
        made.low, made.high = low, high
        return made

    def __str__(self) -> str:
        """Return the three numbers with as many decimals each."""
        largest = max(abs(self), abs(self.low), abs(self.high))
        decimals = 1 if largest >= 10.0 else 2 if largest >= 1.0 or largest == 0.0 else 3
        return f"{float(self):.{decimals}f} [{self.low:.{decimals}f}, {self.high:.{decimals}f}]"


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
    mark : str
        What the figures must not be taken without, such as "quick run": in the title, and in a column of files.
    """

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""
    mark: str = ""

    @property
    def heading(self) -> str:
        """The title with the mark."""
        return f"{self.title} ({self.mark})" if self.mark else self.title

    @property
    def has_intervals(self) -> bool:
        """Whether a figure has an interval."""
        return any(isinstance(cell, Estimate) for row in self.rows for cell in row)

    def compact(self) -> Table:
        """Return the table without the columns in which there is nothing."""
        kept = [i for i in range(len(self.columns)) if any(row[i] is not None for row in self.rows)]
        rows = tuple(tuple(row[i] for i in kept) for row in self.rows)
        return replace(self, columns=tuple(self.columns[i] for i in kept), rows=rows)

    def markdown(self) -> str:
        """Return the table as Markdown, under a heading of the third level."""
        lines = [_bar(self.columns), _bar("---" if i < self._words else "---:" for i in range(len(self.columns)))]
        lines += [_bar(shown(cell) for cell in row) for row in self.rows]
        parts = [f"### {self.heading}", "\n".join(lines)] + ([self.note] if self.note else [])
        return "\n\n".join(parts) + "\n"

    def csv(self) -> str:
        """Return the table as CSV, with figures in full; after a column with intervals come two with their ends."""
        out = io.StringIO()
        writer = csv.DictWriter(out, tuple(self._file_columns()), lineterminator="\n")
        writer.writeheader()
        writer.writerows(self.records())
        return out.getvalue()

    def records(self) -> list[dict[str, Cell]]:
        """Return the rows by column, for files: plain figures, and the ends of intervals in columns of their own."""
        records = []
        for row in self.rows:
            record: dict[str, Cell] = {}
            for column, cell in zip(self.columns, row, strict=True):
                record[column] = float(cell) if isinstance(cell, Estimate) else cell
                if isinstance(cell, Estimate):
                    record |= {f"{column}: {LOW}": cell.low, f"{column}: {HIGH}": cell.high}
            records.append(record | ({RUN: self.mark} if self.mark else {}))
        return records

    def _file_columns(self) -> Iterator[str]:
        for i, column in enumerate(self.columns):
            yield column
            if any(isinstance(row[i], Estimate) for row in self.rows):
                yield from (f"{column}: {LOW}", f"{column}: {HIGH}")
        if self.mark:
            yield RUN

    def text(self) -> str:
        """Return the table as aligned text."""
        cells = [list(self.columns)] + [[shown(cell) for cell in row] for row in self.rows]
        widths = [max(len(row[i]) for row in cells) for i in range(len(self.columns))]
        lines = ["  ".join(self._aligned(i, cell, widths[i]) for i, cell in enumerate(row)).rstrip() for row in cells]
        return "\n".join([self.heading, *(f"  {line}" for line in lines)])

    @property
    def _words(self) -> int:
        """Number of columns from the left that hold words."""
        words = (all(isinstance(row[i], str) for row in self.rows) for i in range(len(self.columns)))
        return next((i for i, only_words in enumerate(words) if not only_words), len(self.columns))

    def _aligned(self, column: int, cell: str, width: int) -> str:
        return cell.ljust(width) if column < self._words else cell.rjust(width)


def shown(cell: Cell) -> str:
    """Return a cell as it is read: figures with two decimals, or three where they are below 1, or with an interval."""
    if cell is None or cell == "":
        return NOTHING
    if isinstance(cell, Estimate):
        return str(cell)
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
    """Return a share as a percentage, with its interval if it has one, if there is a share."""
    if isinstance(share, Estimate):
        return Estimate(100.0 * share, 100.0 * share.low, 100.0 * share.high)
    return None if share is None else 100.0 * share


def existing(values: Iterable[float | None]) -> list[float]:
    """Return the values that exist."""
    return [value for value in values if value is not None]


def _bar(cells: Iterable[str] | Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
