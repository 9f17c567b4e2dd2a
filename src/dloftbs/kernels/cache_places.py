"""Folders for compiled kernels: where they are looked for, and where new ones are saved."""

from __future__ import annotations

import hashlib
import os
import tempfile
from functools import cache
from pathlib import Path

from numba import config
from numba.misc.appdirs import AppDirs


@cache
def list_places(folder: Path) -> tuple[Path, ...]:
    """List the folders that may hold the compiled kernels of a source folder, the preferred one first.

    ``NUMBA_CACHE_DIR``, if it is set and can be written, is the only one. Otherwise kernels lie beside their source, in
    the user's cache, or in a private folder below the temporary directory.
    """
    label = f"{folder.name}_{hashlib.sha256(os.fsencode(folder)).hexdigest()[:16]}"
    private = [place / label for place in _private_folders() if _is_private(place)]
    own = (folder / "__pycache__", *private)
    if not config.CACHE_DIR:
        return own
    given = Path(config.CACHE_DIR) / label
    return (given,) if can_write(given) else (given, *own)


def can_write(folder: Path) -> bool:
    """Return whether files can be made in a folder, which is made where it does not exist."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _private_folders() -> list[Path]:
    user = os.geteuid() if hasattr(os, "geteuid") else os.environ.get("USERNAME", "user")
    return [Path(AppDirs("dloftbs", appauthor=False).user_cache_dir), Path(tempfile.gettempdir()) / f"dloftbs-{user}"]


def _is_private(folder: Path) -> bool:
    """Return whether only this user can write a folder, which is made if need be.

    A cached kernel is code: one that another user could have put there is not loaded.
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return False
    return not hasattr(os, "geteuid") or (status.st_uid == os.geteuid() and not status.st_mode & 0o022)
