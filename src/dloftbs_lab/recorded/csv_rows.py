"""CSV files, read so that an error names file and line."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from dloftbs.errors import SourceError
from dloftbs.support.values import MAX_WHOLE
from dloftbs_lab.recorded.layout import listed


def header_of(path: Path) -> list[str]:
    """Return the names of the columns; none where the file is no text.

    Raises
    ------
    SourceError
        If the file cannot be read.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            return [name.strip() for name in next(csv.reader(file), [])]
    except (UnicodeDecodeError, csv.Error):
        return []
    except OSError as error:
        raise SourceError(f"{path}: cannot be read: {error.strerror or error}") from error


def rows_of(path: Path, columns: Sequence[str]) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield the rows with their line numbers.

    Raises
    ------
    SourceError
        If the file cannot be read, lacks a column, or a row is shorter or longer than the header.
    """
    names = header_of(path)
    missing = [name for name in columns if name not in names]
    if missing:
        columns_of = f"column{'s' * (len(missing) > 1)} {', '.join(missing)}"
        raise SourceError(f"{path}: lacks the {columns_of}; found {listed(names) or 'none'}")
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            next(reader)
            for row in reader:
                if row and len(row) != len(names):
                    raise SourceError(f"{path}, line {reader.line_num}: has {len(row)} fields instead of {len(names)}")
                if row:
                    yield reader.line_num, dict(zip(names, row, strict=True))
    except SourceError:  # which is an OSError, too
        raise
    except (UnicodeDecodeError, csv.Error) as error:
        raise SourceError(f"{path}: {error}") from error
    except OSError as error:
        raise SourceError(f"{path}: cannot be read: {error.strerror or error}") from error


def number(path: Path, line: int, row: dict[str, str], name: str) -> float:
    """Return a field as a finite number.

    Raises
    ------
    SourceError
        If it is none.
    """
    try:
        value = float(row[name])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise SourceError(f"{path}, line {line}: {name} must be a number, got {row[name]!r}")
    return value


def whole(path: Path, line: int, row: dict[str, str], name: str) -> int:
    """Return a field as a whole number.

    Raises
    ------
    SourceError
        If it is none.
    """
    value = number(path, line, row, name)
    if value != int(value) or abs(value) > MAX_WHOLE:
        raise SourceError(f"{path}, line {line}: {name} must be a whole number, got {row[name]!r}")
    return int(value)
