"""Topology of cables: knots, links, their codes, and what is left to untangle (not in the paper).

From a frame's result::

    diagram = topology.Diagram.from_result(result)
    diagram.is_knotted, diagram.gauss_code, diagram.next_move

`diagram` is what users ask; `result_passes` reads frames for it, and `crossing_passes` curves in space. `planar_map`
holds a diagram as a graph in the plane, `reidemeister` simplifies that, and `knot_type` says what it is, by polynomials
and the `knot_table`.
"""

from __future__ import annotations

from typing import Any

from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.support.values import check_type
from dloftbs.topology.diagram import Diagram, Simplified
from dloftbs.topology.end_moves import EndMove
from dloftbs.topology.reidemeister import Move

__all__ = ["Diagram", "EndMove", "Move", "Simplified", "describe"]


def describe(result: FrameResult) -> dict[str, Any]:
    """Return what is known of the topology of a frame's detections, as plain values, ready for JSON.

    Returns
    -------
    dict
        As `Diagram.to_dict` gives it, with a `reason` of None; where the crossings fit no curves in the plane, the
        `reason` alone.

    Raises
    ------
    InputError
        If it is no result.
    """
    check_type("result", result, FrameResult)
    try:
        return {"reason": None, **Diagram.from_result(result).to_dict()}
    except InputError as error:
        return {"reason": str(error)}


def __dir__() -> list[str]:
    return sorted(__all__)
