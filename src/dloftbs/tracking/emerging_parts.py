"""Emerging parts: observations that no track claims, where the hidden rest of the only track left can come out."""

from __future__ import annotations

import math
from collections.abc import Sequence

from dloftbs.observation import Observation
from dloftbs.tracking.appearance import colours_differ, widths_differ
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels.routing import MAX_BRIDGE
from dloftbs.tracking.partial_match import SAME_U, PartialMatch, TrackObservation, hidden_spans
from dloftbs.tracking.track_model import TrackModel

_MIN_WIDTHS = 3.0
"""Least length of a part, widths.

Source: by hand; shorter ones, as between two fingers, fit many places.
"""

_MIN_STRETCH = 0.5
"""Ratio of the chord to the hidden length from which a part may be the end of its track.

Source: by hand; more bent than a half circle, and the part is rather somewhere in between.
"""


def match_emerging(
    model: TrackModel, shown: TrackObservation, unassigned: Sequence[Observation], view: View
) -> tuple[TrackObservation, list[Observation]]:
    """Return what the frame shows of a track with emerging parts added, and the observations still unassigned.

    A part emerges where it is not longer than what is hidden of the track, and its way from the visible rest no longer
    than what is hidden then, wherever the rest was predicted.
    """
    rest = []
    for one in sorted(unassigned, key=lambda one: (-one.length, one.detection_index, one.curve_span)):
        match = _place(model, shown.matches, one, view)
        if match is None:
            rest.append(one)
        else:
            shown = shown._replace(matches=tuple(sorted((*shown.matches, match), key=lambda m: m.track_span)))
    return shown, rest


def _place(model: TrackModel, matches: Sequence[PartialMatch], one: Observation, view: View) -> PartialMatch | None:
    """Return where an observation emerges from what is hidden of a track, None if it does not."""
    if model.curve.closed or one.curve.closed or one.length < _MIN_WIDTHS * model.width_or_0:
        return None
    if widths_differ(model.width, one.width) or colours_differ([model], [one])[0, 0]:
        return None
    found = []
    for low, high in hidden_spans(matches):
        before = next((m for m in matches if abs(m.track_span[1] - low) < SAME_U), None)
        after = next((m for m in matches if abs(m.track_span[0] - high) < SAME_U), None)
        for oriented in (one, one.reversed()):
            placed = _place_between(model, (low, high), before, after, oriented, view)
            if placed is not None:
                found.append(placed)
    return min(found, key=lambda placed: placed[0])[1] if found else None


def _place_between(
    model: TrackModel,
    span: tuple[float, float],
    before: PartialMatch | None,
    after: PartialMatch | None,
    one: Observation,
    view: View,
) -> tuple[float, PartialMatch] | None:
    """Return the place of an observation within a hidden span, and its way from the visible parts; None if too far."""
    length = (span[1] - span[0]) * model.length
    hidden = max(length - one.length, 0.0)
    gaps = (
        0.0 if before is None else math.dist(before.observation.points[-1], one.points[0]),
        0.0 if after is None else math.dist(one.points[-1], after.observation.points[0]),
    )
    way, tolerance = sum(gaps), model.position_tolerance_px
    if one.length > length + tolerance or way > MAX_BRIDGE * hidden + tolerance:
        return None
    if before is not None and after is not None:
        start = hidden * gaps[0] / way if way > 0.0 else 0.0
    else:
        side = 0 if before is None else 1  # the end of the track
        is_end = not view.ends(one, model)[side].is_cut and way >= _MIN_STRETCH * hidden
        gap = hidden if is_end else min(way, hidden)
        start = gap if side else hidden - gap
    low = span[0] + start / model.length
    place = low, min(low + one.length / model.length, span[1])
    return way, PartialMatch(one, place, one.curve_span)
