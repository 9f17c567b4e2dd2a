"""Settings that all inputs of a batch have in common, and the digest that distinguishes them from others."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

from dloftbs._version import code_version
from dloftbs.cli.followed_stream import StreamOptions
from dloftbs.support.file_digest import file_digest
from dloftbs.support.json_text import encode

_CHANGES_NO_RESULT = ("cli/", "ui/", "viz/")


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
        return hashlib.sha256(encode([*given, *map(file_digest, options.config.segmentation.files)])).hexdigest()

    @property
    def version(self) -> str:
        """Version of the code that makes results."""
        return code_version(_CHANGES_NO_RESULT)
