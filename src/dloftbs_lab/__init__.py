"""The laboratory of `dloftbs`: sequences whose truth is known, the scores of methods on them, and two commands.

::

    from dloftbs_lab import open_labelled, synthetic
    from dloftbs_lab.evaluation import match_curves

`synthetic` generates sequences, `open_labelled` reads those of others from disk, `write_sequence` writes one, and
`evaluation` scores any tracker's curves. The names load on first use.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dloftbs_lab import evaluation, synthetic
    from dloftbs_lab.known_sequence import KnownSequence
    from dloftbs_lab.recorded import open_labelled
    from dloftbs_lab.recorded.sequence_writer import write_sequence
    from dloftbs_lab.truth import Truth

_HOME = {
    "KnownSequence": "known_sequence",
    "Truth": "truth",
    "open_labelled": "recorded",
    "write_sequence": "recorded.sequence_writer",
}
_SUBMODULES = ("evaluation", "synthetic")

__all__ = ["KnownSequence", "Truth", "evaluation", "open_labelled", "synthetic", "write_sequence"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(importlib.import_module(f"dloftbs_lab.{_HOME[name]}"), name)
    elif name in _SUBMODULES:
        value = importlib.import_module(f"dloftbs_lab.{name}")
    else:
        raise AttributeError(f"module 'dloftbs_lab' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
