"""Functions by which results show and write themselves; the rooms of pictures and files provide them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Outputs(NamedTuple):
    """The functions; they know the types of results, which know them.

    Parameters
    ----------
    result_png, trace_png : callable
        Draw a `FrameResult` over its frame, or a `StageTrace`, as PNG.
    save : callable
        As `FrameResult.save` says.
    points_table : callable
        As `FrameResult.to_dataframe` says.
    supervision_detections : callable
        As `FrameResult.to_supervision` says.
    plot : callable
        As `FrameResult.plot` says.
    """

    result_png: Callable[[Any], bytes]
    trace_png: Callable[[Any], bytes]
    save: Callable[[Any, Any, Any], None]
    points_table: Callable[[Any, int], Any]
    supervision_detections: Callable[[Any], Any]
    plot: Callable[[Any, Any], Any]


_load: list[Callable[[], Outputs]] = []


def register_outputs(load: Callable[[], Outputs]) -> None:
    """Say where the functions are; they are loaded when a result is first shown."""
    _load[:] = [load]


def outputs() -> Outputs:
    """Return the functions."""
    return _load[0]()
