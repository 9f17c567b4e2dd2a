"""Results in a region of interest are the same in the whole image's pixels."""

from __future__ import annotations

from dataclasses import fields

import pytest

from dloftbs.data.centerline import BranchEnd, Centerline, Joint, NearJoint, Segment
from dloftbs.data.detection import Crossing, Detection
from dloftbs.data.dropped import Dropped
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.harness import BranchPoint, Harness
from dloftbs.data.stage_trace import StageTrace
from dloftbs.data.tracks import Track

MOVED = {
    Segment: {"points"},
    Joint: {"alternatives"},
    NearJoint: {"point"},
    Centerline: {"segments", "joints", "near_joints", "branch_ends"},
    BranchEnd: {"point"},
    BranchPoint: {"position"},
    Harness: {"detections", "branch_points"},
    Detection: {"centerline", "curve", "camera"},
    Crossing: {"position"},
    Track: {"curve", "detection", "camera"},
    StageTrace: {
        *("frame", "mask", "cleaned", "skeleton", "endpoints", "branch_points"),
        *("segments", "short_segments", "result"),
    },
    Dropped: {"centerline"},
    FrameResult: {"detections", "tracks", "size", "crossings", "dropped", "frame", "roi", "branch_points", "harnesses"},
}
STAYS = {
    Segment: {"radius"},
    NearJoint: {"u", "confidence"},
    Joint: {"kind", "u", "cost", "margin", "confidence"},
    Centerline: {"closed", "course_confidence", "existence"},
    Dropped: {"reason", "probability"},
    Detection: {"curve_3d", "no_3d_reason", "inferred_3d"},
    Crossing: {"passes", "top", "confidence"},
    Track: {
        *("id", "state", "curve_3d", "hits", "misses", "inferred", "confidence", "width_px", "ends"),
        *("velocity", "velocity_3d"),
    },
    BranchEnd: {"confidence"},
    BranchPoint: {"members", "confidence", "position_3d", "id"},
    Harness: {"branches", "index", "id"},
    StageTrace: set(),
    FrameResult: {"reason", "stage_ms", "index", "stamp", "name", "diagnosis"},
}


@pytest.mark.parametrize("kind", MOVED, ids=lambda kind: kind.__name__)
def test_each_field_moves_or_stays(kind):
    """A new field is named here once `WholeImage` moves it, if it is in pixels of the image."""
    assert {field.name for field in fields(kind)} == MOVED[kind] | STAYS[kind]
