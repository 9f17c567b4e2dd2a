"""The seen parts of the objects of a frame, from which labels are made."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from dloftbs.data.centerline import JointKind
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.spans import Spans, outside
from dloftbs.sinks._rows import ObjectRow, object_rows

CATEGORY = "cable"
"""Name of the class of all labels."""


@dataclass(frozen=True, eq=False)
class SeenObject:
    """An object that is seen, at least in parts.

    Parameters
    ----------
    row : ObjectRow
    curve : BSplineCurve
        In the image, px.
    width_px : float
    spans : tuple of (float, float)
        The intervals of the ``u`` of `curve` that the frame shows, ascending.
    """

    row: ObjectRow
    curve: BSplineCurve
    width_px: float
    spans: Spans


def seen_objects(result: FrameResult) -> Iterator[SeenObject]:
    """Yield the objects of a result whose width is known, without parts across gaps and parts that are remembered."""
    from dloftbs.viz.items import items_of
    from dloftbs.viz.style import Style

    for row, item in zip(object_rows(result), items_of(result, Style()), strict=True):
        gaps = [joint.u for joint in item.joints if joint.kind is JointKind.GAP]
        spans = outside([*gaps, *item.inferred])
        if spans and not item.hidden and item.width_px is not None:
            yield SeenObject(row, item.curve, item.width_px, spans)
