"""Curves and detections built by hand, of which everything is known in advance."""

from __future__ import annotations

import itertools
import json
import math
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from dloftbs.data.centerline import Centerline, Joint, Segment
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection

NOT_SPANS = [
    ((0.5, 0.2),),
    ((-1e-9, 0.1),),
    ((0.9, 1.0 + 1e-9),),
    ((0.5, 0.6), (0.1, 0.2)),
    ((0.1,),),
    (0.1, 0.2),
    None,
    ((math.nan, 1.0),),
    (("0", "1"),),
]
"""Values that are no ascending intervals of ``u`` in 0..1."""


def curve_through(points: np.ndarray, closed: bool = False) -> BSplineCurve:
    """Interpolate points (n, d); a closed curve comes back from the last one to the first."""
    points = np.asarray(points, dtype=np.float64)
    if closed:
        points = np.vstack((points, points[:1]))
    u = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    spline = make_interp_spline(u / u[-1], points, k=3, bc_type="periodic" if closed else None)
    return BSplineCurve(spline.t, spline.c, 3, closed=closed)


def line(start: tuple[float, ...], end: tuple[float, ...]) -> BSplineCurve:
    """Return a straight curve, in as many dimensions as its ends have."""
    return curve_through(np.linspace(start, end, 12))


def arc(radius: float, angle: float, centre: tuple[float, float] = (0.0, 0.0)) -> BSplineCurve:
    """Return a circle's arc from the x axis on, counted from x to y."""
    return curve_through(_on_circle(radius, np.linspace(0.0, angle, 80), centre))


def loop(radius: float, centre: tuple[float, float] = (0.0, 0.0), start: float = 0.0) -> BSplineCurve:
    """Return a whole circle, closed, whose seam lies at the angle `start`."""
    return curve_through(_on_circle(radius, start + 2 * np.pi * np.arange(80) / 80, centre), closed=True)


def wave(shift: tuple[float, float] = (0.0, 0.0), phase: float = 0.0) -> BSplineCurve:
    """Return an open cable of about 550 px, from left to right."""
    x = np.linspace(0.0, 500.0, 60)
    return curve_through(np.stack((x, 50.0 * np.sin(x / 80.0 + phase)), axis=1) + shift)


def bent(*corners: tuple[float, float]) -> BSplineCurve:
    """Return a curve along the sides between corners."""
    sides = [np.linspace(a, b, 30, endpoint=False) for a, b in itertools.pairwise(corners)]
    return curve_through(np.vstack([*sides, corners[-1:]]))


def part(curve: BSplineCurve, start: float, stop: float) -> BSplineCurve:
    """Return what is seen of a curve when all but `start` <= u <= `stop` is hidden."""
    return curve_through(curve(np.linspace(start, stop, 40)))


def random_curve(seed: int, ndim: int = 2, closed: bool = False, degree: int = 3) -> BSplineCurve:
    """Return a curve with arbitrary control points and unevenly spaced knots."""
    rng = np.random.default_rng(seed)
    breaks = np.concatenate(([0.0], np.cumsum(rng.uniform(0.2, 1.0, int(rng.integers(degree + 2, 15))))))
    breaks /= breaks[-1]
    if closed:
        control = rng.normal(0.0, 100.0, (len(breaks) - 1, ndim))
        knots = np.concatenate((breaks[-1 - degree : -1] - 1.0, breaks, breaks[1 : degree + 1] + 1.0))
        return BSplineCurve(knots, np.vstack((control, control[:degree])), degree, closed=True)
    control = rng.normal(0.0, 100.0, (len(breaks) + degree - 1, ndim))
    return BSplineCurve(np.concatenate((np.zeros(degree), breaks, np.ones(degree))), control, degree)


def detection_of(
    curve: BSplineCurve, curve_3d: BSplineCurve | None = None, joints: tuple[Joint, ...] = (), radius: float = 3.0
) -> Detection:
    """Return the detection of a curve, cut into equal segments where there are joints."""
    pieces = np.array_split(curve.sample(60), len(joints) + 1)
    segments = tuple(Segment(piece, np.full(len(piece), radius)) for piece in pieces)
    return Detection(Centerline(segments, joints, closed=curve.closed), curve, curve_3d)


def through_json(value: Any) -> Any:
    """Write a value as strict JSON, which knows neither NaN nor infinity, and read it back."""
    return json.loads(json.dumps(value, allow_nan=False))


def _on_circle(radius: float, angle: np.ndarray, centre: tuple[float, float]) -> np.ndarray:
    return np.stack((np.cos(angle), np.sin(angle)), axis=1) * radius + centre
