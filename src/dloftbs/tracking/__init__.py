"""Tracking: from detections to tracks, whose identity and direction are kept from frame to frame (paper: tracking).

`tracker` has the order of the steps and owns the tracks; `track_model` is the state of one, with `sight`,
`length_record`, `track_motion` and `belief`, what frames say for its shape and against it, as its parts. `association`
lays tracks, where they are predicted, through observations: span by span by `routing`, with `sample_graph` and
`localization`, and as a whole by `assignment`; `readings` decides between that and the frame's own reading, by
`reading_features` and `reading_weights`. `frame_view` shows what may hide a cable, `resolution` hidden spans from
absent ones, and `separation` that an object was cut.
`track_update`, with `reconstruction` and `curve_in_space`, makes whole curves of visible parts and the last shape;
`publication` says what is published, and `motion_filter` smooths it. `branch_roles` tells the branches of
an object apart, and `harness_ids` names objects that branch.
"""

from dloftbs.tracking.harness_ids import HarnessIds
from dloftbs.tracking.tracker import Tracker

__all__ = ["HarnessIds", "Tracker"]
