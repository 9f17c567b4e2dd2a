"""Files that an earlier run left in a folder of results."""

from __future__ import annotations

import os
from pathlib import Path

from dloftbs.sinks.sink import logger
from dloftbs.support.safe_files import sink_errors


class EarlierFiles:
    """Files of a folder that were there before this run, and are not replaced by it: nobody sees which run they are of.

    They stay, since labels may have been corrected by hand.

    Parameters
    ----------
    folder : Path
        May be missing.
    *endings : str
        Of the names of files like those of this run.
    """

    def __init__(self, folder: Path, *endings: str) -> None:
        self._folder = folder
        self._endings = endings
        self._names: set[str] | None = None

    def replaced_by(self, *names: str) -> None:
        """Take note of files that this run is about to write; call it first before any is.

        Raises
        ------
        SinkError
            If the folder cannot be read.
        """
        if self._names is None:
            with sink_errors(self._folder):
                found = os.listdir(self._folder) if self._folder.is_dir() else []
            self._names = {name for name in found if name.endswith(self._endings) and not name.startswith(".")}
        self._names.difference_update(names)

    def warn(self) -> None:
        """Say in the log how many are left."""
        if self._names:
            logger.warning(
                "%s: %d files of an earlier run stay beside those of this one, such as %s; for one run alone, choose "
                "another folder or remove them",
                self._folder,
                len(self._names),
                min(self._names),
            )
