"""Digests of files, by which results that were made with other contents are told apart."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path


def file_digest(file: str | Path) -> str:
    """Return the digest of a file's bytes; empty where it cannot be read, which whoever reads the file says."""
    try:
        return hashlib.sha256(Path(os.path.expanduser(file)).read_bytes()).hexdigest()
    except OSError:
        return ""
