"""Detections to tracks: identity and direction held by continuity between frames (paper: tracking).

`tracker` has the order of the steps and all memory. `association`, `partial_match` and `alignment` tell which track a
detection shows, and which stretch of it; `routing` takes known tracks through a frame, with `sample_graph`, `extension`
and `localization`; `track_model` holds the state of a track; `occlusion` tells hidden stretches from absent ones;
`fusion` and `reconstruction` make a whole curve of what is seen and the shape that is remembered; `loop_start` places
the start of a loop; `motion_filter` smooths.
"""

from dloftbs.tracking.track_model import Prediction
from dloftbs.tracking.tracker import Tracker

__all__ = ["Prediction", "Tracker"]
