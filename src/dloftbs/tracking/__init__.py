"""Detections to tracks: identity and direction held by continuity between frames (paper: tracking).

`tracker` has the order of things and all memory; `seeing`: what a frame shows; `routing`: the ways of known tracks
through it, with `scene`, `leading` and `laying`; `matching`: which track a detection shows as a whole; `pieces`,
`placing`: and which stretch of it; `memory`: what is known of a track; `believing`: what of a track is hidden, and what
is not there; `joining`, `assembling`: a whole curve from what is seen and the shape that is remembered; `loops`: where
a loop starts; `smoothing`. `nearest`: the published way, which needs none of this.
"""

from dloftbs.config import NearestTrackingConfig, TrackingConfig
from dloftbs.tracking.memory import Prediction
from dloftbs.tracking.nearest import NearestTracker
from dloftbs.tracking.tracker import Tracker

__all__ = ["NearestTracker", "Prediction", "Tracker", "make_tracker"]


def make_tracker(config: TrackingConfig | NearestTrackingConfig) -> Tracker | NearestTracker:
    """Return the tracker that a configuration asks for."""
    return Tracker(config) if isinstance(config, TrackingConfig) else NearestTracker()
