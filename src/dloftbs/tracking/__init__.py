"""Tracking: from detections to tracks, whose identity and direction are kept from frame to frame (paper: tracking).

`tracker` has the order of the steps and owns the tracks; `track_model` is the state of one. `association`, with
`partial_match` and `alignment`, assigns observations to tracks, span by span; `prediction` says where these are
expected, and `merged_tracks` finds those that share a detection; `routing`, with `sample_graph`,
`extension` and `localization`, leads well-known tracks through a frame. `occlusion` distinguishes hidden spans from
absent ones; `fusion` and `reconstruction` make a whole curve from visible parts and the last shape; `loop_start` moves
the start of a loop; `motion_filter` smooths published curves.
"""

from dloftbs.tracking.tracker import Tracker

__all__ = ["Tracker"]
