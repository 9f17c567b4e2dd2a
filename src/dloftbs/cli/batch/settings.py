"""Settings that all inputs of a batch have in common, and the digest that distinguishes them from others."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from dloftbs._version import code_version
from dloftbs.cli.followed_stream import StreamOptions
from dloftbs.support.json_text import encode

_CHANGES_NO_RESULT = ("cli/", "ui/", "viz/")


def _digest_of(file: str) -> str:
    """Return the digest of a file that the settings name; empty where it cannot be read, which reading it says."""
    try:
        return hashlib.sha256(Path(os.path.expanduser(file)).read_bytes()).hexdigest()
    except OSError:
        return ""


@dataclass(frozen=True)
class BatchSettings:
    """Settings of a batch.

    Parameters
    ----------
    options : StreamOptions
    suffix : str
        Of the results, which says their format.
    retry_failed : bool
        Do again what failed, or gave a part only.
    """

    options: StreamOptions
    suffix: str = ".jsonl"
    retry_failed: bool = False

    @cached_property
    def digest(self) -> str:
        """Digest of all that changes results, the inputs and the code aside."""
        options = self.options
        given = [options.config.to_dict(), options.inputs, options.fps, options.every, options.limit, self.suffix]
        segmentation = options.config.segmentation
        named = [one for one in (segmentation.background, segmentation.onnx) if one is not None]
        files = [one if isinstance(one, str) else one.file for one in named]
        return hashlib.sha256(encode([*given, *map(_digest_of, files)])).hexdigest()

    @property
    def version(self) -> str:
        """Version of the code that makes results."""
        return code_version(_CHANGES_NO_RESULT)
