"""From a frame's curves and crossings to the passes of a diagram."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from dloftbs.data.detection import Detection
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track
from dloftbs.errors import InputError
from dloftbs.support.values import check_integer, check_type, shown
from dloftbs.topology.crossing_passes import CrossingPasses, assemble_passes, cross_product

_HALF_WIDTHS = 64
"""Distance from a crossing up to which its two passes are followed until they part, half widths.

Source: bounds time; a longer stretch side by side is rare.
"""

_OFF_AXIS_WIDTHS = 0.12
"""Distance of a curve from the axis of its object, widths, from which on the look along it is another one's.

Source: measured on 250 drawings of ropes 2.5 to 4 widths apart, of other seeds than those of benchmarks.topology. Of
orders stated with more than 0.8, 18 of 1,079 are wrong; 17 of these are among the 100 at deviations above 0.1 widths.
With 0.1, one of 972 is wrong, with 0.12 one of 994, with 0.15 one of 1,006, and with 0.2 seven of 1,019.
"""


def passes_of_result(
    result: FrameResult, objects: Sequence[int | Track] | None, min_confidence: float
) -> dict[str, Any]:
    """Return the fields of a diagram of the objects in a frame.

    Raises
    ------
    InputError
        If an object is not in the frame, or a crossing lies on one that does not run there.
    """
    check_type("result", result, FrameResult)
    chosen = range(len(result.detections)) if objects is None else objects
    if not isinstance(chosen, Sequence):
        raise InputError(f"objects must be a sequence of indices of detections or of tracks, got {shown(objects)}")
    places = [_place_of(result, one) for one in chosen]
    strands = {detection: strand for strand, (detection, _) in enumerate(places)}
    if len(strands) < len(places):
        raise InputError(f"objects must differ, got {shown([detection for detection, _ in places])}")
    turns: list[tuple[int, tuple[tuple[int, float], tuple[int, float]], float]] = []
    for label, crossing in enumerate(result.crossings):
        if (last := max(detection for detection, _ in crossing.passes)) >= len(result.detections):
            raise InputError(f"crossing {label} is one of detection {last}, but there are {len(result.detections)}")
        if not all(detection in strands for detection, _ in crossing.passes):
            continue
        at, turned = [], 1.0
        for detection, u in crossing.passes:
            one = result.detections[detection]
            away = float(np.linalg.norm(one.curve(u) - np.asarray(crossing.position)))
            if away > max(one.width_px, 1.0):
                raise InputError(
                    f"crossing {label} lies {away:.3g} px from detection {detection} at u={u:.3g}, more than its width "
                    f"of {one.width_px:.3g} px: crossings and detections must be those of one frame"
                )
            backwards = places[strands[detection]][1]
            turned = -turned if backwards else turned
            at.append((strands[detection], 1.0 - u if backwards else u))
        (a, u_a), (b, u_b) = crossing.passes
        # The y axis of the image points down.
        cross = -turned * _turn(result.detections[a], u_a, result.detections[b], u_b)
        turns.append((label, (at[0], at[1]), cross))
    orders = _orders(result, [label for label, _, _ in turns])
    found = []
    for label, at_both, cross in turns:
        crossing = result.crossings[label]
        # An order that comes without a confidence is meant as it is.
        stated = orders[label] if crossing.confidence > 0.0 else float(crossing.top is not None)
        top = crossing.top if stated >= min_confidence else None
        found.append(CrossingPasses(at_both, cross, top, stated, label))
    chosen_ones = [result.detections[detection] for detection in strands]
    return {
        **assemble_passes([one.curve.closed for one in chosen_ones], found),
        "objects": tuple(strands),
        "strand_confidences": tuple([one.confidence for one in chosen_ones]),
    }


def _orders(result: FrameResult, labels: Sequence[int]) -> dict[int, float]:
    """Return the probabilities of the orders at crossings, in which confidences hold where both curves run right.

    An order is read from the look along both curves. Where strands nearly touch, curves leave their axes, and show what
    lies beside: then the order is a guess.
    """
    places: dict[int, list[tuple[int, float]]] = {}
    for label in labels:
        for detection, u in result.crossings[label].passes:
            places.setdefault(detection, []).append((label, u))
    sure = dict.fromkeys(labels, 1.0)
    for detection, own in places.items():
        one = result.detections[detection]
        std = one.curve_std([u for _, u in own]) / max(one.width_px, 1.0)
        for (label, _), off in zip(own, std.tolist(), strict=True):
            sure[label] *= math.erf(_OFF_AXIS_WIDTHS / (math.sqrt(2.0) * off)) if off > 0.0 else 1.0
    return {label: result.crossings[label].confidence * one + 0.5 * (1.0 - one) for label, one in sure.items()}


def _place_of(result: FrameResult, one: int | Track) -> tuple[int, bool]:
    """Return which detection an object is, and whether it is run backwards."""
    if not isinstance(one, Track):
        return check_integer("an object", one, 0, len(result.detections) - 1), False
    detection, backwards = result._place_of(one)
    if detection is None:
        raise InputError(f"track {one.id} has no detection in this frame, and no crossings: it is {one.state.value}")
    return detection, backwards


def _turn(a: Detection, u_a: float, b: Detection, u_b: float) -> float:
    """Return the sign of the turn from one pass to another one, as the image has it: of the sides where these part.

    Cables that run side by side for a while cross somewhere on that stretch, and their directions there say nothing.
    """
    width = max(0.5 * (a.width_px + b.width_px), 1.0)
    cosine = float(a.curve.tangent(u_a) @ b.curve.tangent(u_b))
    same = 1.0 if cosine >= 0.0 else -1.0
    sides = []
    for way in (-1.0, 1.0):
        for reach in (8, _HALF_WIDTHS):  # most part at once
            steps = way * 0.5 * width * np.arange(1, reach + 1)
            along = (a.curve, u_a + steps / a.curve.length), (b.curve, u_b + same * steps / b.curve.length)
            on_a, on_b = (curve(at if curve.closed else np.clip(at, 0.0, 1.0)) for curve, at in along)
            apart = np.flatnonzero(np.linalg.norm(on_b - on_a, axis=1) >= 0.5 * width)
            if len(apart):
                k = apart[0]
                sides.append(float(np.sign(cross_product(way * (on_a[k] - a.curve(u_a)), on_b[k] - on_a[k]))))
                break
    if len(sides) == 2 and sides[0] == -sides[1] != 0.0:
        return same * sides[1]
    return float(cross_product(a.curve.tangent(u_a), b.curve.tangent(u_b)))
