"""Correctness of found joints: a right one joins two places that follow each other on a true curve.

A probe is a place on the centre line a little before and a little after the joint, since at its very ends the middle of
the mask may be that of a junction. A joint is right if some true curve passes both probes in the direction in which
the centre line runs, and is about as long between them as the found curve: what jumps to another object, goes back, or
skips a loop is wrong.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dloftbs.data.centerline import Segment
from dloftbs.data.detection import Detection
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.evaluation.runner.finished_parts import JointRow
from dloftbs_lab.evaluation.runner.found import samples
from dloftbs_lab.truth import Truth

MIN_GATE = 1.0 / 256.0
"""Of the image's longer side: within this of a true curve, or a width if that is more, a place is on it; 5 px in HD."""

_SLACK_WIDTHS = 0.5  # a curve that is further away than the nearest one by more is not the one that was followed
_COS_ALONG = math.cos(math.radians(50.0))
_MIN_CHORD_PX = 3.0  # of which the direction says something
_LENGTH_WIDTHS, _LENGTH_SHARE = 2.0, 0.3
_PIECES = 32  # of a joint whose length is measured


@dataclass(frozen=True, eq=False)
class _Known:
    """A true curve: points (n, 2) px, at most about 1 px apart, unit tangents (n, 2), arc length (n,) px."""

    points: FloatArray
    tangents: FloatArray
    arc: FloatArray
    closed: bool


@dataclass(frozen=True, eq=False)
class _Probe:
    """A place on a found centre line.

    Parameters
    ----------
    point : numpy.ndarray, shape (2,)
    direction : numpy.ndarray, shape (2,), or None
        Unit vector along the centre line; None where the segment is too short to have one.
    reach_px : float
        Along the segment, from its end at the joint.
    """

    point: FloatArray
    direction: FloatArray | None
    reach_px: float


@dataclass(frozen=True)
class _Place:
    """A place on a true curve: its number, the arc length px, and in which directions, 1 or -1, it may be passed."""

    curve: int
    arc: float
    ways: tuple[int, ...]


def judge_joints(index: int, detections: Sequence[Detection], truth: Truth, size: tuple[int, int]) -> list[JointRow]:
    """Return every joint of a frame, with whether it is right; none where the true curves are not known.

    Parameters
    ----------
    index : int
        Of the frame.
    detections : sequence of Detection
    truth : Truth
    size : (int, int)
        ``(H, W)`` of the frame, px.
    """
    if not truth.curves or not any(detection.joints for detection in detections):
        return []
    known = [_known(samples(curve), curve.closed) for curve in truth.curves]
    gate_px = MIN_GATE * max(size)
    return [
        JointRow(index, joint.kind, joint.confidence, _is_right(detection, number, known, gate_px))
        for detection in detections
        for number, joint in enumerate(detection.joints)
    ]


def _known(points: FloatArray, closed: bool) -> _Known:
    tangents = np.gradient(points, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True).clip(min=1e-12)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return _Known(points, tangents, np.concatenate(([0.0], np.cumsum(steps))), closed)


def _is_right(detection: Detection, number: int, known: Sequence[_Known], least_gate_px: float) -> bool:
    line, width = detection.centerline, detection.width_px
    before, after = line.segments[number : number + 2]
    start, end = _probe(before.reversed(), width, -1.0), _probe(after, width, 1.0)
    first = sum(len(segment.points) for segment in line.segments[: number + 1])
    # From segment to segment: the joint's own span ends where the mask does, half a width nearer.
    across = detection.curve.spline(np.linspace(line.u[first - 1], line.u[first], _PIECES + 1))
    length = start.reach_px + float(np.linalg.norm(np.diff(across, axis=0), axis=1).sum()) + end.reach_px
    tolerance = _LENGTH_WIDTHS * width + _LENGTH_SHARE * length
    gate_px = max(width, least_gate_px)
    ends = list(_places(end, known, gate_px, width))
    return any(
        abs(way_px - length) <= tolerance
        for a in _places(start, known, gate_px, width)
        for b in ends
        if a.curve == b.curve
        for way in set(a.ways) & set(b.ways)
        for way_px in _ways_px(known[a.curve], way * (b.arc - a.arc))
    )


def _ways_px(curve: _Known, way_px: float) -> tuple[float, ...]:
    """Return how far it is, forward; on a loop the way round counts, too."""
    return (way_px, way_px + float(curve.arc[-1])) if curve.closed else (way_px,)


def _probe(segment: Segment, width: float, along: float) -> _Probe:
    """Return the place a width off the first end of a segment, or halfway along a short one; `along` turns it round."""
    points = segment.points
    arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    reach = min(width, float(arc[-1]) / 2.0)
    point, far = (np.array([np.interp(s, arc, axis) for axis in points.T]) for s in (reach, 2.0 * reach))
    chord = along * (far - points[0])
    length = float(np.linalg.norm(chord))
    return _Probe(point, chord / length if length >= _MIN_CHORD_PX else None, reach)


def _places(probe: _Probe, known: Sequence[_Known], gate_px: float, width: float) -> Iterator[_Place]:
    """Yield where true curves pass a probe along it: near a crossing it may be several places of one curve."""
    found = [
        (distance, _Place(number, arc, ways))
        for number, curve in enumerate(known)
        for distance, arc, ways in _passes(probe, curve, gate_px)
    ]
    nearest = min((distance for distance, _ in found), default=math.inf)
    return (place for distance, place in found if distance <= nearest + _SLACK_WIDTHS * width)


def _passes(probe: _Probe, curve: _Known, gate_px: float) -> Iterator[tuple[float, float, tuple[int, ...]]]:
    """Yield the distance, arc length and ways of each pass of a true curve by a probe."""
    distance = np.linalg.norm(curve.points - probe.point, axis=1)
    near = distance <= gate_px
    cosine = np.zeros(len(distance)) if probe.direction is None else curve.tangents @ probe.direction
    if probe.direction is not None:
        near &= np.abs(cosine) >= _COS_ALONG
    (inside,) = np.nonzero(near)
    if not len(inside):
        return
    for run in np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1):
        best = run[np.argmin(distance[run])]
        ways = (1, -1) if probe.direction is None else (1 if cosine[best] > 0.0 else -1,)
        yield float(distance[best]), float(curve.arc[best]), ways
