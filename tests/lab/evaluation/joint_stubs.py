"""Detections with joints of stated places and confidences."""

from __future__ import annotations

import numpy as np
from builders import curve_through

from dloftbs.data.centerline import Centerline, Joint, JointKind, Segment, arc_parameter
from dloftbs.data.detection import Detection
from dloftbs.data.frame_result import FrameResult

WIDTH = 6.0


def path(*corners):
    """Points along a polyline, a pixel apart."""
    pieces = []
    for a, b in zip(np.array(corners[:-1], float), np.array(corners[1:], float), strict=True):
        count = max(2, round(float(np.linalg.norm(b - a))) + 1)
        pieces.append(np.linspace(a, b, count)[bool(pieces) :])
    return np.concatenate(pieces)


def joined(*pieces, kind=JointKind.CROSSING, confidence=0.7):
    """The detection of pieces of a centre line, each (n, 2), one after the other."""
    points = np.concatenate(pieces)
    u = arc_parameter(points)
    stops = np.cumsum([len(piece) for piece in pieces])[:-1]
    joints = tuple(Joint(kind, (float(u[stop - 1]), float(u[stop])), 0.0, 1.0, confidence) for stop in stops)
    segments = tuple(Segment(piece, np.full(len(piece), WIDTH / 2.0)) for piece in pieces)
    return Detection(Centerline(segments, joints), curve_through(points))


def cut_bars(frame):
    """The bars of `runner_stubs`, each found with a gap; the second one ends on the first bar."""
    first, second = (np.array(row + frame.index, float) for row in (30, 70))
    right = joined(path((20, first), (90, first)), path((96, first), (180, first)), kind=JointKind.GAP, confidence=0.9)
    wrong = joined(path((20, second), (90, second)), path((96, first), (180, first)), confidence=0.2)
    return FrameResult((right, wrong), (), None, frame.size)


def sure_and_off(frame):
    """Curves without joints: one on the first bar, one 9 px off the second, and one where there is none."""
    rows = (30.0 + frame.index, 79.0 + frame.index, 100.0)
    return FrameResult(tuple(joined(path((20, row), (180, row))) for row in rows), (), None, frame.size)
