"""Every public type that has `to_dict`: plain values, one form, whatever kind of numbers it was made of."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders import curve_through, detection_of, line, loop, wave
from hypothesis import given
from hypothesis import strategies as st
from properties import few_examples

import dloftbs
from dloftbs.camera import PinholeCamera
from dloftbs.config import Config, FittingConfig, LinkingConfig, TrackingConfig
from dloftbs.data.branch_point import BranchPoint
from dloftbs.data.centerline import Joint, JointKind, NearJoint
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Crossing, Detection
from dloftbs.data.dropped import Dropped
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.harness import Harness, Route
from dloftbs.data.tracks import Track, TrackState
from dloftbs.pipeline import Pipeline
from dloftbs.stereo import CameraRig, RigObject, RigResult, RigTrack
from dloftbs.support.json_text import encode, encode_line
from dloftbs_lab.truth import Truth


def moved_by(apart_m: float) -> np.ndarray:
    """Return a pose beside the origin."""
    pose = np.eye(4)
    pose[0, 3] = apart_m
    return pose


FLOATS = (float, np.float64, np.float32, np.float16, np.longdouble)
INTEGERS = (int, np.int64, np.uint8, np.int16)
SHARES = st.builds(lambda kind, value: kind(value), st.sampled_from(FLOATS), st.floats(0.0, 1.0))
SMALL = st.builds(lambda kind, value: kind(value), st.sampled_from((*FLOATS, *INTEGERS)), st.integers(1, 100))
COUNTS = st.builds(lambda kind, value: kind(value), st.sampled_from(INTEGERS), st.integers(1, 100))
TEXT = st.text(max_size=5) | st.builds(np.str_, st.text(max_size=5))
SPANS = st.tuples(SHARES, SHARES).map(lambda pair: tuple(sorted(pair, key=float)))
SPAN_LISTS = st.lists(SPANS, max_size=2).map(lambda spans: tuple(sorted(spans, key=lambda span: float(span[0]))))
POINTS = st.tuples(SMALL, SMALL)
STAMPS = st.none() | SHARES | SMALL

CURVES = st.sampled_from([wave(), loop(20.0), line((0, 0), (9, 9))])
CURVES_3D = st.none() | st.just(curve_through(np.random.default_rng(3).normal(0.0, 1.0, (9, 3))))
JOINTS = st.builds(
    Joint,
    st.sampled_from(JointKind),
    SPANS,
    cost=SMALL,
    margin=SMALL | st.just(math.inf) | st.just(np.float64(math.inf)),
    confidence=SHARES,
    alternatives=st.tuples(st.none() | POINTS, st.none() | POINTS),
)
NEAR_JOINTS = st.builds(NearJoint, st.sampled_from([0, 1.0, np.float32(0.0)]), POINTS, SHARES)
DETECTIONS = st.builds(
    lambda joints, near_joints, curve_3d, reason, spans: Detection(
        replace(detection_of(wave(), joints=tuple(joints)).centerline, near_joints=tuple(near_joints)),
        wave(),
        curve_3d,
        reason,
        spans,
    ),
    st.lists(JOINTS, max_size=2),
    st.lists(NEAR_JOINTS, max_size=2),
    CURVES_3D,
    st.none() | TEXT,
    SPAN_LISTS,
)
CROSSINGS = st.builds(
    Crossing,
    POINTS,
    st.tuples(st.tuples(COUNTS, SHARES), st.tuples(COUNTS, SHARES)),
    st.none() | st.builds(lambda kind, top: kind(top), st.sampled_from(INTEGERS), st.integers(0, 1)),
    SHARES,
)
ENDS = st.tuples(COUNTS, st.builds(lambda kind, end: kind(end), st.sampled_from(INTEGERS), st.integers(0, 1)))
BRANCH_POINTS = st.builds(
    BranchPoint,
    POINTS,
    st.lists(ENDS, max_size=3).map(tuple),
    SHARES,
    st.none() | st.tuples(SMALL, SMALL, SMALL),
    st.none() | COUNTS,
)
ROUTES = st.builds(Route, CURVES, SMALL, COUNTS, st.tuples(ENDS, ENDS))
HARNESSES = st.builds(
    lambda found, point, number: Harness((found,), (0,), (replace(point, members=((0, 1),)),), 0, number),
    DETECTIONS,
    BRANCH_POINTS,
    st.none() | COUNTS,
)
DROPPED = st.builds(lambda found, why, share: Dropped(found.centerline, why, share), DETECTIONS, TEXT, SHARES)
TRACKS = st.builds(
    Track,
    COUNTS,
    st.sampled_from(TrackState),
    CURVES,
    CURVES_3D,
    COUNTS,
    COUNTS,
    st.none() | DETECTIONS,
    SPAN_LISTS,
    SHARES,
    st.none() | SMALL,
)
RESULTS = st.builds(
    FrameResult,
    st.lists(DETECTIONS, max_size=1).map(tuple),
    st.lists(TRACKS, max_size=1).map(tuple),
    st.none() | TEXT,
    st.tuples(COUNTS, COUNTS),
    st.dictionaries(TEXT, SHARES, max_size=2),
    COUNTS,
    STAMPS,
    TEXT,
    st.lists(CROSSINGS, max_size=1).map(tuple),
)
CAMERAS = st.builds(
    PinholeCamera,
    SMALL,
    SMALL,
    SMALL,
    SMALL,
    st.lists(SHARES, min_size=4, max_size=5) | st.just(np.float32([0.5, 0.25, 0, 0])),
    size=st.none() | st.tuples(COUNTS, COUNTS),
)
CONFIGS = st.builds(
    lambda gap, knots, gate, hits: Config(
        linking=LinkingConfig(max_gap_widths=gap, objects=hits),
        fitting=FittingConfig(knots=None if knots is None else knots + type(knots)(2)),
        tracking=TrackingConfig(gate=gate),
    ),
    SMALL,
    st.none() | COUNTS,
    SMALL,
    COUNTS,
)
TRUTHS = st.builds(
    lambda curves, numbers: Truth(tuple(curves[: len(numbers)]), (), tuple(numbers)),
    st.lists(CURVES, min_size=3, max_size=3),
    st.lists(COUNTS, max_size=3, unique=True),
)
RIGS = st.builds(
    lambda camera, apart, std: CameraRig([camera, camera], [np.eye(4), moved_by(apart)], pixel_std=std),
    CAMERAS,
    st.floats(0.01, 1.0),
    SMALL,
)
RIG_OBJECTS = st.builds(
    lambda members, curve, reason, spans, width, share: RigObject(
        members, curve, reason, spans, width, share, None if curve is None else np.float32([0.25, 0.5])
    ),
    st.tuples(st.none() | COUNTS, COUNTS),
    CURVES_3D,
    st.none() | TEXT,
    SPAN_LISTS,
    st.none() | SMALL,
    SHARES,
)
RIG_TRACKS = st.builds(
    RigTrack,
    COUNTS,
    st.sampled_from(TrackState),
    st.none() | COUNTS,
    st.tuples(st.none() | COUNTS, COUNTS),
    st.tuples(st.booleans(), st.booleans()),
    CURVES_3D,
    COUNTS,
    COUNTS,
)
RIG_RESULTS = st.builds(
    RigResult,
    st.lists(RESULTS, max_size=2).map(tuple),
    st.lists(RIG_OBJECTS, max_size=2).map(tuple),
    st.lists(RIG_TRACKS, max_size=1).map(tuple),
    st.dictionaries(TEXT, SHARES, max_size=2),
    COUNTS,
    STAMPS,
)
EVERY_CURVE = CURVES.map(lambda curve: BSplineCurve(curve.knots.astype(np.longdouble), curve.control_points))

MADE = {
    BSplineCurve: EVERY_CURVE,
    BranchPoint: BRANCH_POINTS,
    CameraRig: RIGS,
    Config: CONFIGS,
    Crossing: CROSSINGS,
    Detection: DETECTIONS,
    Dropped: DROPPED,
    FrameResult: RESULTS,
    Harness: HARNESSES,
    Joint: JOINTS,
    NearJoint: NEAR_JOINTS,
    PinholeCamera: CAMERAS,
    RigResult: RIG_RESULTS,
    Route: ROUTES,
    Track: TRACKS,
    Truth: TRUTHS,
}


def check(data) -> None:
    """Check that a dictionary is plain, and that every way of writing it gives the same."""
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert json.loads(encode_line(data)) == json.loads(encode(data, indent=1)) == data
    assert plain(data)


def plain(value) -> bool:
    if isinstance(value, dict):
        return all(type(key) is str and plain(one) for key, one in value.items())
    if isinstance(value, list):
        return all(plain(one) for one in value)
    return value is None or type(value) in (bool, int, float, str)


def test_no_public_type_is_left_out():
    public = {getattr(dloftbs, name) for name in dloftbs.__all__}
    assert {kind for kind in public if hasattr(kind, "to_dict")} == MADE.keys() - {Truth}


@pytest.mark.parametrize("kind", MADE, ids=lambda kind: kind.__name__)
@few_examples
@given(data=st.data())
def test_whatever_it_is_made_of_its_dictionary_is_plain(kind, data):
    made = data.draw(MADE[kind])
    check(made.to_dict())
    if hasattr(kind, "from_dict"):
        others = (made.detections,) if kind is Harness else ()
        again = kind.from_dict(json.loads(encode(made.to_dict())), *others)
        assert again.to_dict() == made.to_dict()


@few_examples
@given(TRACKS, RESULTS)
def test_fields_are_plain_too(track, result):
    values = (track.id, track.hits, track.misses, track.confidence, *(edge for span in track.inferred for edge in span))
    values += (result.index, *result.size, *(() if result.stamp is None else (result.stamp,)))
    assert {type(value) for value in values} <= {int, float}
    assert type(result.name) is str


@pytest.mark.parametrize("config", [Config(), Config.paper()], ids=["default", "paper"])
def test_what_the_pipeline_gives_is_plain(shared_data: Path, config: Config):
    pipeline = Pipeline(config)
    camera = PinholeCamera(600.0, 600.0, 320.0, 240.0)
    for number in range(12):
        mask = cv2.imread(str(shared_data / "masks" / "007.png"), cv2.IMREAD_GRAYSCALE)
        if number > 8:
            mask[100:120] = 0
        depth = np.full(mask.shape, 1.0, np.float32)
        result = pipeline.process(Frame(mask=mask, depth=depth, camera=camera, stamp=np.float32(0.1 * number)))
        assert result.tracks
        check(result.to_dict())


def test_what_is_shown_of_any_value_is_one_short_line():
    mask = np.zeros((240, 400), np.uint8)
    mask[118:123, 20:380] = mask[20:220, 198:203] = 1
    camera = PinholeCamera(300.0, 300.0, 200.0, 120.0, (0.1,) * 12, size=(240, 400))
    frame = Frame(mask=mask, image=np.zeros((240, 400, 3), np.uint8), depth=np.ones((240, 400)), camera=camera)
    pipeline = Pipeline()
    result = pipeline.process(frame)
    assert len(result.crossings) == 1
    first = result[0]
    tracker = dloftbs.Tracker()
    tracker.update(result.detections)
    values = [
        frame, camera, result, *result.detections, *result.tracks, *result.crossings, first.curve, first.curve_3d,
        first.centerline, *first.centerline.segments, *first.joints, pipeline, pipeline.trace(frame), Config(),
        Config.paper(), dloftbs.detect(0 * mask), dloftbs.Tracker(), dloftbs.HsvRange.parse("170:10"),
        Config.paper().replace({"segmentation.hsv": ["1:2,3:4,5:6"] * 20}), dloftbs.viz.Style(),
        dloftbs.viz.Style(palette=((1, 2, 3),) * 99), dloftbs.sources.open(mask[None]), tracker.predict()[0],
        dloftbs.OcclusionEvidence(occluders=mask), dloftbs.DepthRegistration(camera, camera, np.eye(3), np.zeros(3)),
    ]  # fmt: skip
    for value in values:
        assert 0 < len(repr(value)) < 300, repr(value)
        assert "\n" not in repr(value)
    assert repr(result) == "FrameResult(frame 0: 2 detections, 2 tracks, 1 crossing)"
    assert repr(frame) == "Frame(0: 400x240, image, mask, depth, camera)"
    assert repr(Config()) == "Config()"
    assert repr(pipeline) == "Pipeline(2 tracks, Config())"
    assert repr(dloftbs.viz.Style(panel_px=9)) == "Style(panel_px=9)"
    assert repr(dloftbs.sources.open(mask[None])) == "ArraySource('array', 1 frames)"
    assert repr(LinkingConfig(objects=2)) == "LinkingConfig(objects=2)"
