"""Base of all layouts of labelled data on disk."""

from __future__ import annotations

import os
from abc import abstractmethod
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SourceError, source_errors
from dloftbs.sources.image_files import natural_key
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.truth import Truth

T = TypeVar("T")
SHOWN = 5
"""Number of names that a message lists."""
LONGEST_SHOWN = 100
"""Characters of each."""


@dataclass(frozen=True)
class Layout:
    """One way in which labelled data lies on disk.

    Parameters
    ----------
    name : str
    tree : str
        Picture of a right folder, for messages.
    fits : callable
        Whether a folder looks like it, at a glance: names and first lines.
    open : callable
        The sequence in a folder; raises `SourceError` where it is not whole.
    """

    name: str
    tree: str
    fits: Callable[[Path], bool]
    open: Callable[[Path], KnownSequence]


class RecordedSequence(KnownSequence):
    """A labelled sequence on disk: a subclass gives `_frame` and `_truth`, which need not check the index.

    Parameters
    ----------
    folder : Path
    length : int
    fps : float, optional
    """

    folder: Path

    def __init__(self, folder: Path, length: int, fps: float | None = None) -> None:
        self.name = str(folder)
        self.folder = folder
        self.length = length
        self.fps = fps

    def frame(self, index: int) -> Frame:
        """Return one frame.

        Raises
        ------
        InputError
            If there is no such frame.
        SourceError
            If it cannot be read, or the sequence is closed.
        """
        return self._read(self._frame, index)

    def truth(self, index: int) -> Truth:
        """Return the truth of a frame.

        Raises
        ------
        InputError
            If there is no such frame.
        SourceError
            If it cannot be read, or the sequence is closed.
        """
        return self._read(self._truth, index)

    @abstractmethod
    def _frame(self, index: int) -> Frame: ...

    @abstractmethod
    def _truth(self, index: int) -> Truth: ...

    def _read(self, read: Callable[[int], T], index: int) -> T:
        if self._closed:
            raise SourceError(f"{self.folder} is closed")
        if not isinstance(index, (int, np.integer)) or not 0 <= index < len(self):
            raise InputError(f"{self.folder} has the frames 0 to {len(self) - 1}, got {index!r}")
        with source_errors(f"{self.folder}, frame {index}", InputError):
            return read(int(index))


def files_in(folder: Path) -> list[Path]:
    """Return the files of a folder that are not hidden, in natural order.

    Raises
    ------
    SourceError
        If the folder cannot be read.
    """
    return sorted((path for path in _entries(folder) if os.path.isfile(path)), key=natural_key)


def folders_in(folder: Path) -> list[Path]:
    """Return the folders in a folder that are not hidden, in natural order.

    Raises
    ------
    SourceError
        If the folder cannot be read.
    """
    return sorted((path for path in _entries(folder) if os.path.isdir(path)), key=natural_key)


def content_of(folder: Path) -> str:
    """Say what a folder holds: its folders by name, its files by kind."""
    folders = [f"{path.name}/" for path in folders_in(folder)]
    kinds = Counter("".join(path.suffixes[-2:]) or path.name for path in files_in(folder))
    found = [listed(folders)] if folders else []
    found += [f"{count} {kind}" for kind, count in kinds.most_common(SHOWN)]
    return ", ".join(found) or "nothing"


def listed(names: list[str]) -> str:
    """Return the first few names, long ones cut, and how many more there are."""
    more = len(names) - SHOWN
    first = [name if len(name) <= LONGEST_SHOWN else f"{name[:LONGEST_SHOWN]}..." for name in names[:SHOWN]]
    return ", ".join(first) + (f" and {more} more" if more > 0 else "")


def _entries(folder: Path) -> list[Path]:
    try:
        return [path for path in folder.iterdir() if not path.name.startswith(".")]
    except OSError as error:
        raise SourceError(f"the folder {str(folder)!r} cannot be read: {error.strerror or error}") from error
