"""A partly seen track in space: its whole curve there, and where that puts its parts in the image.

In metres a cable keeps its length, however it tilts, comes nearer or goes away; in pixels it does not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_samples import sample_curve
from dloftbs.kernels.polyline_lengths import arc_lengths
from dloftbs.support.arrays import FloatArray
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels.interpolation import interpolate
from dloftbs.tracking.partial_match import PartialMatch, hidden_before
from dloftbs.tracking.reconstruction import CURVE_SAMPLES, EVEN_U, VisiblePart, reconstruct


def reconstruct_in_space(
    before: BSplineCurve | None, scope: tuple[float, float], metres: float, matches: Sequence[PartialMatch], view: View
) -> tuple[BSplineCurve | None, list[VisiblePart]]:
    """Return the whole curve in space, so many metres long, and its visible parts there.

    The distance of each from the nearer end, in metres, is that of its place in the image. There is no curve if it was
    never known, if the length is not, or if no match has one there.
    """
    parts: list[VisiblePart] = []
    if before is None or math.isnan(metres):
        return None, parts
    for match, gap in zip(matches, hidden_before(matches), strict=False):
        curve = match.observation.curve_3d
        if curve is None:
            continue
        seen = view.span_in_space(curve, match.curve_span)
        share = min(sample_curve(curve, *seen)[1] / metres, 1.0)
        low, high = match.track_span
        rest = 1.0 - (high - low)
        start = low / rest * (1.0 - share) if rest > 0.0 else 0.0
        if parts:
            start = max(start if gap > 0.0 else 0.0, parts[-1].track_span[1])
        if start < 1.0:
            parts.append(VisiblePart(curve, (start, min(start + share, 1.0)), seen))
    if not parts:
        return None, parts
    return reconstruct(sample_curve(before, *view.span_in_space(before, scope), CURVE_SAMPLES)[0], parts, metres), parts


def place_by_space(
    curve_3d: BSplineCurve, metres: float, matches: Sequence[PartialMatch], parts: Sequence[VisiblePart], view: View
) -> tuple[list[PartialMatch], FloatArray, float] | None:
    """Return the parts of a track placed by its whole curve in space; None without a camera that sees all of it.

    With them come points (CURVE_SAMPLES, 2) along the whole track as the camera sees it, and the scale of the view,
    px a metre.

    Parameters
    ----------
    curve_3d : BSplineCurve
    metres : float
        Its length.
    matches : sequence of PartialMatch
    parts : sequence of VisiblePart
        The same in space; fewer if not all are known there.
    view : View
    """
    spans = [part.track_span for part in parts]
    points_m, _ = sample_curve(curve_3d, count=CURVE_SAMPLES)
    points = view.project(points_m)
    if points is None or len(spans) < len(matches):
        return None
    along, along_m = arc_lengths(points), arc_lengths(points_m)
    edges = [0.0, *(edge for span in spans for edge in span), 1.0]
    at_px, at_m = (np.interp(edges, EVEN_U, lengths) for lengths in (along, along_m))
    hidden_px, hidden_m = ((at[1::2] - at[::2]).tolist() for at in (at_px, at_m))
    gaps = zip(hidden_before(matches), edges[::2], edges[1::2], strict=True)
    shares = [high - low if gap > 0.0 else 0.0 for gap, low, high in gaps]
    # Where parts are farther apart than the track is long, nothing makes it longer.
    hidden = [
        min(metres * share / m, 1.0) * px if share * m > 0.0 else 0.0
        for share, px, m in zip(shares, hidden_px, hidden_m, strict=True)
    ]
    seen = [match.observation.length for match in matches]
    length = sum(seen) + sum(hidden)
    ends = [px / length for px in accumulate(px for pair in zip(hidden, seen, strict=False) for px in pair)]
    ends[-1] = ends[-1] if hidden[-1] else 1.0  # not by a rounding error before it
    on_track = zip(ends[::2], ends[1::2], strict=True)
    placed = [PartialMatch(one.observation, span, one.curve_span) for one, span in zip(matches, on_track, strict=True)]
    evenly = interpolate(points, np.interp(EVEN_U * along[-1], along, EVEN_U))
    covered = sum(high - low for low, high in spans) + sum(shares)  # less than all if the parts are too short
    return placed, evenly, length / (covered * metres)
