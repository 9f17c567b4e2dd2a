"""Curves that a tracker is shown, and what is asked of its tracks."""

from __future__ import annotations

import numpy as np
from builders import curve_through, detection_of, line, wave

from dloftbs.config import TrackingConfig
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.tracks import TrackState
from dloftbs.tracking import Tracker

TENTATIVE, CONFIRMED, HIDDEN = TrackState.TENTATIVE, TrackState.CONFIRMED, TrackState.HIDDEN
FRAME_S = TrackingConfig().frame_s
_T = np.linspace(0.0, 1.0, 80)[:, None]
OMEGA = np.hstack((np.cos(1.8 * np.pi * _T), np.sin(1.8 * np.pi * _T))) * 100.0
SPIRAL = np.hstack((np.cos(5.0 * np.pi * _T), np.sin(5.0 * np.pi * _T))) * (20.0 + 60.0 * _T)
HAIRPIN = np.vstack((np.linspace((0, 0), (400, 0), 40), [(415, 20)], np.linspace((400, 40), (0, 40), 40)))
SHAPES = {
    "wave": wave(),
    **{k: curve_through(v) for k, v in (("omega", OMEGA), ("spiral", SPIRAL), ("hairpin", HAIRPIN))},
}


def level(y: float, length: float = 500.0) -> BSplineCurve:
    """Return a straight cable at a height, so that two of them are exactly as far apart as their heights."""
    return line((0.0, y), (length, y))


def see(tracker: Tracker, *curves: BSplineCurve):
    """Show the tracker one frame and return its tracks."""
    return tracker.update([detection_of(curve) for curve in curves])


def doubtful(curve: BSplineCurve, existence: float) -> Detection:
    """Return the detection of a curve that may be none, and that is read in one of several ways."""
    written = detection_of(curve).to_dict()
    return Detection.from_dict(written | {"existence": existence, "confidence": 0.3 * existence})


def ids(tracks) -> list[int]:
    return [track.id for track in tracks]


def runs_like(curve: BSplineCurve, truth: BSplineCurve) -> bool:
    """Tell whether an open curve starts where the truth starts, a closed one whether it turns the same way."""
    if truth.closed:
        return turning(curve) * turning(truth) > 0
    return np.linalg.norm(curve(0.0) - truth(0.0)) < np.linalg.norm(curve(1.0) - truth(0.0))


def turning(curve: BSplineCurve) -> float:
    points = curve.sample(200)
    middle = points - points.mean(axis=0)
    return float((middle[:-1, 0] * middle[1:, 1] - middle[:-1, 1] * middle[1:, 0]).sum())


def shown_for(tracker: Tracker, frames: int, *curves: BSplineCurve):
    """Show the tracker the same curves for some frames, and return its tracks."""
    for _ in range(frames):
        tracks = see(tracker, *curves)
    return tracks


def error_px(found: BSplineCurve, true: BSplineCurve) -> float:
    """Return the mean distance of points at equal parameters."""
    u = np.linspace(0.0, 1.0, 101)
    return float(np.linalg.norm(found(u) - true(u), axis=1).mean())
