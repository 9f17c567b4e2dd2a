"""Files that an earlier run left in a folder of results."""

from __future__ import annotations

import os
from pathlib import Path

from dloftbs.sinks.sink import logger
from dloftbs.support.safe_files import sink_errors


class EarlierFiles:
    """Files of a folder that were there before this run, and that it does not replace.

    They stay, since labels may have been corrected by hand; but nobody sees which run they are of.

    Parameters
    ----------
    folder : Path
        May be missing.
    *endings : str
        Of the names of files like those of this run.

    Raises
    ------
    SinkError
        If the folder cannot be read.
    """

    def __init__(self, folder: Path, *endings: str) -> None:
        self._folder = folder
        with sink_errors(folder):
            found = os.listdir(folder) if folder.is_dir() else []
        names = [name for name in found if name.endswith(endings) and not name.startswith(".")]
        self._names = {name.casefold(): name for name in names}  # some file systems take a.png for A.png
        self._has_written = False

    def replaced_by(self, *names: str) -> None:
        """Take note of files that this run writes."""
        self._has_written = True
        for name in names:
            self._names.pop(name.casefold(), None)

    def warn(self) -> None:
        """Say in the log how many are left, if this run wrote any."""
        if self._has_written and self._names:
            logger.warning(
                "%s: files from before stay in this folder, %d in all, such as %s; if they are of an earlier run, "
                "remove them, or choose another folder",
                self._folder,
                len(self._names),
                min(self._names.values()),
            )
