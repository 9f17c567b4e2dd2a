"""Wrong types in every argument of everything public: the package's errors come, and no others."""

from __future__ import annotations

import enum
import inspect
import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from builders import line

import dloftbs
import dloftbs_lab
from dloftbs import DloftbsError, ros
from dloftbs.camera import DepthRegistration, PinholeCamera
from dloftbs.evidence import OcclusionEvidence
from dloftbs.ros.message_types import MessageTypes

ROOMS = ("config", "evaluation", "lab", "ros", "sinks", "sources", "topology", "viz")
WRONG: dict[str, object] = {
    "nothing": None,
    "a number": 5,
    "a negative fraction": -1.5,
    "no number": float("nan"),
    "a huge integer": 10**400,
    "text": "x",
    "bytes": b"\x00",
    "an empty list": [],
    "a ragged list": [[1], [1, 2]],
    "a dictionary": {"a": 1},
    "a pair of texts": ("a", "b"),
    "an object": object(),
    "a type": dict,
    "a function": len,
    "an empty array": np.zeros(0),
    "an array of text": np.array(["a", "b"]),
    "an array of times": np.array([1], "datetime64[s]"),
    "a complex array": np.ones((3, 3), complex),
}
MASK = np.zeros((40, 60), bool)
MASK[20:24, 5:55] = True
CAMERA = PinholeCamera(50.0, 50.0, 30.0, 20.0)
SPACE = line((0.0, 0.0, 1.0), (0.1, 0.0, 1.2))
FRAME = dloftbs.Frame(mask=MASK, camera=CAMERA)
RESULT = dloftbs.Pipeline().process(FRAME)
TRACE = dloftbs.Pipeline().trace(FRAME)
FOUND = dloftbs.Detection(RESULT[0].centerline, RESULT[0].curve, SPACE, camera=CAMERA)
BESIDE = np.eye(4)
BESIDE[0, 3] = 0.1
RIG = dloftbs.CameraRig([CAMERA, CAMERA], [np.eye(4), BESIDE])
RIG_RESULT = RIG.detect([MASK, MASK])
EVIDENCE = OcclusionEvidence(occluders=MASK)
TEE = np.zeros((120, 200), np.uint8)
TEE[56:64, 10:190] = TEE[60:110, 96:104] = 1
(HARNESS,) = dloftbs.detect(TEE, branched=True).harnesses
STROKE = dloftbs.Stroke(points=[(9, 22), (50, 22)])
COLOUR = dloftbs.ColourModel.fit(np.repeat(MASK[..., None], 3, axis=2).astype(np.uint8) * 200, [STROKE]).to_config()
POINTS = np.array([(0.0, 0.0), (1.0, 2.0), (5.0, 1.0)])
CURVES = [line((0, 0), (9, 0)), line((0, 0), (1, 9))]

STORE = MessageTypes().store
MAKE = ros.RosbagsFactory(STORE)
HEADER = ros.Header(1, "camera")
STD_HEADER = HEADER.message(MAKE)
_FOLDER = TemporaryDirectory()
with ros.BagSink(Path(_FOLDER.name, "a.mcap"), with_input=True) as _sink:
    _sink.write(FRAME, RESULT)
RECORDING = ros.Recording(_sink.path)
ROS_MASK = ros.mask_message(MAKE, STD_HEADER, MASK)
ROS_DEPTH = ros.image_message(MAKE, STD_HEADER, np.ones((40, 60), np.uint16))
ROS_INFO = ros.camera_message(MAKE, STD_HEADER, CAMERA, (40, 60))

Call = tuple[Callable[..., Any], dict[str, Any]]


def image() -> np.ndarray:
    return np.zeros((40, 60, 3), np.uint8)


KNOT = dloftbs.topology.Diagram(((0, 1, 2, 0, 1, 2),), (True,), (1, -1, 1), (1, 0, 1))
TRUTH = dloftbs_lab.Truth(CURVES, (), tuple(range(1, len(CURVES) + 1)))


def calls(folder: Path) -> dict[str, Call]:
    """Return a call that is right of everything public that takes arguments, by its name."""
    track, scores = RESULT.tracks[0], dloftbs_lab.evaluation.TrackingScorer()
    instances = {
        "BSplineCurve": CURVES[0],
        "CameraRig": RIG,
        "RigResult": RIG_RESULT,
        "StereoPipeline": dloftbs.StereoPipeline(RIG),
        "Config": dloftbs.Config(),
        "BackgroundSegmenter": dloftbs.BackgroundSegmenter(image()),
        "ColourModel": dloftbs.ColourModel(COLOUR),
        "DepthRegistration": DepthRegistration(CAMERA, CAMERA, np.eye(3), np.zeros(3)),
        "Detection": FOUND,
        "FrameResult": RESULT,
        "Harness": HARNESS,
        "OcclusionEvidence": EVIDENCE,
        "PinholeCamera": CAMERA,
        "Pipeline": dloftbs.Pipeline(),
        "Segment": TRACE.segments[0],
        "Track": dloftbs.Track(1, track.state, track.curve, SPACE, 1, 0, None, camera=CAMERA),
        "Tracker": dloftbs.Tracker(),
        "config.SegmentationConfig": dloftbs.config.SegmentationConfig(),
        "lab.Truth": TRUTH,
        "evaluation.Matching": dloftbs_lab.evaluation.match_curves(CURVES, CURVES),
        "evaluation.TrackingScorer": scores,
        "ros.FrameMaker": ros.FrameMaker("a"),
        "ros.Header": HEADER,
        "ros.MarkerWriter": ros.MarkerWriter(MAKE),
        "ros.RclpyFactory": ros.RclpyFactory(),
        "ros.Recording": RECORDING,
        "ros.RosbagsFactory": MAKE,
        "topology.Diagram": KNOT,
        "viz.Style": dloftbs.viz.Style(),
    }
    in_image = ros.sample_px(track)
    in_space = ros.SampledTrack(track, np.ones((100, 3)), in_image.s, in_image.inferred)
    message = {"make": MAKE, "header": STD_HEADER}
    given: dict[str, dict[str, Any]] = {
        "BSplineCurve": {"knots": CURVES[0].knots, "control_points": CURVES[0].control_points},
        "BSplineCurve.__call__": {"u": 0.5, "derivative": 0, "extrapolate": False},
        "BSplineCurve.bend_radius": {"u": 0.5, "over": 1.0},
        "BSplineCurve.curvature": {"u": 0.5},
        "BSplineCurve.distance": {"other": CURVES[1]},
        "BSplineCurve.inside": {"polygon": [(0.0, 0.0), (9.0, 0.0), (9.0, 9.0)]},
        "BSplineCurve.nearest_pixel": {"mask": MASK},
        "BSplineCurve.poses": {"us": [0.0, 1.0], "towards": (0.0, 0.0, 1.0)},
        "BSplineCurve.slack": {"u_a": 0.1, "u_b": 0.9},
        "BSplineCurve.tightest_bend": {"over": 1.0},
        "BSplineCurve.from_dict": {"data": CURVES[0].to_dict()},
        "BSplineCurve.nearest": {"point": (1.0, 2.0)},
        "BSplineCurve.t_at": {"u": 0.5},
        "BSplineCurve.u_at": {"t": 0.5},
        "BSplineCurve.resample": {"n": 5},
        "BSplineCurve.sample": {"n": 5},
        "BSplineCurve.tangent": {"u": 0.5},
        "BSplineCurve.transformed": {"matrix": np.eye(2), "offset": np.zeros(2)},
        "BranchPoint": {
            **{"position": (1.0, 2.0), "members": ((0, 1), (1, 0)), "confidence": 0.5},
            **{"position_3d": (1.0, 2.0, 3.0), "id": 1},
        },
        "BranchPoint.from_dict": {"data": HARNESS.branch_points[0].to_dict()},
        "Harness": {
            **{"detections": HARNESS.detections, "branches": HARNESS.branches, "index": 0, "id": 1},
            **{"branch_points": HARNESS.branch_points},
        },
        "Harness.from_dict": {"data": HARNESS.to_dict(), "detections": HARNESS.detections, "index": 0},
        "Harness.path": {"end_a": HARNESS.ends[0], "end_b": HARNESS.ends[1]},
        "Harness.path_3d": {"end_a": HARNESS.ends[0], "end_b": HARNESS.ends[1]},
        "Route": {"curve": CURVES[0], "width": 3.0, "harness": 0, "ends": ((0, 1), (1, 0))},
        "Crossing.from_dict": {"data": dloftbs.Crossing((1.0, 2.0), ((0, 0.1), (0, 0.9))).to_dict()},
        "ColourModel.colour_log_odds": {"image": image()},
        "ColourModel.probability": {"image": image()},
        "Detection.curve_3d_std": {"u_3d": 0.5},
        "Detection.curve_std": {"u": 0.5},
        "Detection.from_dict": {"data": FOUND.to_dict()},
        "Track.curve_3d_std": {"u_3d": 0.5},
        "Track.curve_std": {"u": 0.5},
        "Prompt": {
            **{"points": [[1.0, 2.0]], "owner": [0], "negative": [[1.0, 2.0]], "boxes": [[0.0, 0.0, 3.0, 4.0]]},
            **{"mask": MASK},
        },
        "Dropped.from_dict": {"data": dloftbs.Dropped(FOUND.centerline, "a", 0.5).to_dict()},
        "Dropped": {"centerline": FOUND.centerline, "reason": "a", "probability": 0.5},
        "FrameResult.from_dict": {"data": RESULT.to_dict()},
        "FrameResult.save": {"path": folder / "result.csv", "frame": FRAME},
        "Joint.from_dict": {"data": dloftbs.Joint(dloftbs.JointKind.GAP, (0.1, 0.2), 1.0, 2.0).to_dict()},
        "NearJoint.from_dict": {"data": dloftbs.NearJoint(1.0, (3.0, 4.0), 0.4).to_dict()},
        "Track.from_dict": {"data": track.to_dict(), "detection": FOUND},
        "CameraRig": {"cameras": [CAMERA, CAMERA], "poses": [np.eye(4), BESIDE], "time_std_s": 0.01, "triggered": True},
        "CameraRig.detect": {"views": [MASK, MASK], "mask": None, "objects": 1, "poses": None},
        "CameraRig.from_dict": {"data": RIG.to_dict()},
        "CameraRig.from_file": {"path": folder / "rig.json", "pixel_std": 0.5},
        "CameraRig.project": {"points_m": np.ones((3, 3))},
        "RigResult": {"views": RIG_RESULT.views, "objects": (), "tracks": (), "index": 1, "stamp": 1.0},
        "RigResult.from_dict": {"data": RIG_RESULT.to_dict()},
        "StereoPipeline": {"rig": RIG, "hsv": "1:2", "objects": 1},
        "StereoPipeline.process": {"views": [MASK, MASK], "mask": None},
        "Centerline": {
            "segments": TRACE.segments,
            "joints": (),
            "closed": False,
            "near_joints": (),
            "course_confidence": 1.0,
            "existence": 1.0,
        },
        "Config": {"fitting": dloftbs.config.FittingConfig(), "segmentation": dloftbs.config.SegmentationConfig()},
        "Config.from_dict": {"data": {}},
        "Config.from_file": {"path": folder / "config.yaml"},
        "Config.from_yaml": {"text": ""},
        "Config.paper": {"objects": 1},
        "Config.replace": {"changes": {"fitting.knots": 9}},
        "BackgroundSegmenter": {"background": image(), "contrast": 20.0},
        "BackgroundSegmenter.__call__": {"image": image()},
        "median_background": {"frames": [image()]},
        "Config.with_roi": {"roi": (1, 2, 3, 4)},
        "ColourModel": {"config": COLOUR},
        "ColourModel.__call__": {"image": image()},
        "ColourModel.fit": {"image": image(), "strokes": [STROKE], "source": "a"},
        "ColourModel.together": {"pictures": COLOUR.pictures},
        "ColourModel.pictures_of": {"pictures": [(image(), [STROKE], "a")]},
        "ColourModel.fit_many": {"pictures": [(image(), [STROKE], "a")]},
        "Crossing": {"position": (1.0, 2.0), "passes": ((0, 0.1), (0, 0.9)), "top": 0, "confidence": 0.5},
        "DepthRegistration": {
            "depth_camera": CAMERA,
            "colour_camera": CAMERA,
            "rotation": np.eye(3),
            "translation_m": np.zeros(3),
        },
        "DepthRegistration.from_file": {"path": folder / "registration.yaml"},
        "DepthRegistration.register": {"depth": np.ones((40, 60)), "size": (40, 60)},
        "Detection": {"centerline": FOUND.centerline, "curve": FOUND.curve, "curve_3d": SPACE, "camera": CAMERA},
        "Detection.u_2d": {"u_3d": 0.5},
        "Detection.u_3d": {"u": 0.5},
        "Frame": {
            "image": image(),
            "mask": MASK,
            "depth": np.ones((40, 60)),
            "camera": CAMERA,
            "index": 1,
            "name": "a",
            "instances": MASK,
            "grippers": np.ones((1, 4)),
        },
        "FrameResult": {"detections": (), "tracks": (), "reason": None, "size": (4, 6), "frame": FRAME},
        "HsvRange": {"hue": (1, 2), "saturation": (3, 4), "value": (5, 6)},
        "HsvRange.parse": {"text": "1:2"},
        "NearJoint": {"u": 0.0, "point": (1.0, 2.0), "confidence": 0.5},
        "OcclusionEvidence": {"occluders": MASK, "mask": MASK, "depth": np.ones((40, 60)), "camera": CAMERA},
        "PinholeCamera": {"fx": 5.0, "fy": 5.0, "cx": 2.0, "cy": 2.0, "distortion": (0.0,) * 4},
        "PinholeCamera.check_size": {"size": (40, 60)},
        "PinholeCamera.deproject": {"points_px": POINTS, "depth_m": np.ones(3)},
        "PinholeCamera.from_calibration": {"keys": CAMERA.to_dict()},
        "PinholeCamera.from_dict": {"data": CAMERA.to_dict()},
        "PinholeCamera.from_file": {"path": folder / "camera.yaml"},
        "PinholeCamera.from_matrix": {"matrix": CAMERA.matrix},
        "PinholeCamera.project": {"points_m": np.ones((3, 3))},
        "PinholeCamera.scaled": {"size": (80, 120)},
        "Pipeline": {"config": dloftbs.Config(), "hsv": "1:2", "objects": 1},
        "Pipeline.detect": {"frame": MASK},
        "Pipeline.process": {"frame": MASK},
        "Pipeline.trace": {"frame": MASK},
        "Stroke": {"points": POINTS, "cable": True, "radius_px": 2.0},
        "Stroke.parse": {"text": "1,2", "cable": True, "radius_px": 2.0},
        "Segment": {"points": POINTS, "radius": np.ones(3)},
        "Track": {
            "id": 1,
            "state": track.state,
            "curve": track.curve,
            "curve_3d": None,
            "hits": 1,
            "misses": 0,
            "detection": None,
        },
        "Track.u_2d": {"u_3d": 0.5},
        "Track.u_3d": {"u": 0.5},
        "Tracker": {"config": dloftbs.config.TrackingConfig()},
        "Tracker.predict": {"stamp": 1.0},
        "Tracker.update": {"detections": [FOUND], "stamp": 1.0, "size": (40, 60), "widths": None},
        "config.SegmentationConfig.with_hsv": {"colour": "1:2"},
        "detect": {
            **{"x": MASK, "image": image(), "depth": np.ones((40, 60)), "camera": CAMERA, "objects": 1},
            "instances": MASK,
        },
        "track": {"frames": [MASK], "hsv": "1:2", "objects": 1},
        "config.ColourPicture": {
            **{name: getattr(COLOUR.pictures[0], name) for name in ("source", "size", "cable", "ground", "sample")}
        },
        "config.choose_config": {"config": None, "hsv": None, "objects": None},
        "config.read_colour": {"colour": "1:2"},
        "config.read_roi": {"given": (1, 2, 3, 4)},
        "evaluation.TrackingScorer": {"gate": 1.0},
        "evaluation.compare_curves": {"found": CURVES, "true": CURVES, "samples": 50},
        "evaluation.curve_l3": {"found": CURVES[0], "true": CURVES[1], "samples": 50},
        "evaluation.dice": {"found_labels": MASK.astype(int), "true_labels": MASK.astype(int)},
        "evaluation.endpoint_error": {"found": CURVES[0], "true": CURVES[1]},
        "evaluation.f_distance": {"x": POINTS, "y": POINTS},
        "evaluation.l1": {"mask_pixels": POINTS, "curve_points": POINTS},
        "evaluation.l2": {"curve_points": POINTS, "mask_pixels": POINTS},
        "evaluation.l3": {"c": POINTS, "r": POINTS},
        "evaluation.l3_undirected": {"c": POINTS, "r": POINTS},
        "evaluation.length_error": {"found": CURVES[0], "true": CURVES[1]},
        "evaluation.match_curves": {"found": CURVES, "true": CURVES, "samples": 50, "gate_px": 5.0},
        "evaluation.mmd": {"x": POINTS, "y": POINTS},
        "evaluation.point_error": {"found": CURVES[0], "true": CURVES[1], "samples": 50},
        "ros.BagSink": {"path": folder / "b.mcap", "overlay": True, "with_input": True, "frame_id": "a"},
        "ros.BagSource": {
            **{"path": RECORDING.path, "topic": "/dloftbs/mask", "depth_topic": "/dloftbs/mask"},
            **{"info_topic": "/dloftbs/camera_info", "kind": "mask", "camera": CAMERA, "registration": None},
            **{"depth_unit_m": 0.001, "fps": 5.0, "guess_depth": True, "tolerance_s": 0.1, "keep_messages": False},
        },
        "ros.FrameMaker": {
            **{"where": "a", "kind": "auto", "rectified": False, "camera": CAMERA, "registration": None},
            **{"depth_unit_m": 0.001, "depth_is_meant": True, "info_is_meant": True, "depth_is_registered": False},
        },
        "ros.FrameMaker.make": {
            **{"image": ROS_MASK, "pixels": (None, MASK), "depth": ROS_DEPTH, "index": 1, "stamp": 1.0},
            **{"stamp_ns": 1, "name": "a"},
        },
        "ros.FrameMaker.pixels": {"image": ROS_MASK, "mask": ROS_MASK},
        "ros.FrameMaker.take_info": {"info": ROS_INFO},
        "ros.Header": {"stamp_ns": 1, "frame_id": "a"},
        "ros.Header.message": {"make": MAKE, "ending": "a"},
        "ros.MarkerWriter": {"make": MAKE},
        "ros.MarkerWriter.clear": {"header": STD_HEADER},
        "ros.MarkerWriter.message": {
            **{"header": STD_HEADER, "samples": [in_space], "branch_points": HARNESS.branch_points}
        },
        "ros.RclpyFactory.__call__": {"type_name": "no_msgs/msg/Thing"},
        "ros.Recording": {"path": RECORDING.path},
        "ros.Recording.messages": {"wanted": ["/dloftbs/mask"]},
        "ros.Recording.peek": {"wanted": ["/dloftbs/mask"]},
        "ros.RosFrame": {"mask": MASK, "camera": CAMERA, "frame_id": "a", "stamp_ns": 1, "recorded": ()},
        "ros.RosbagsFactory": {"store": STORE},
        "ros.RosbagsFactory.__call__": {"type_name": "std_msgs/msg/Header", "frame_id": "a"},
        "ros.SampledTrack": {name: getattr(in_space, name) for name in ("track", "points", "s", "inferred")},
        "ros.camera_message": {**message, "camera": CAMERA, "size": (40, 60)},
        "ros.answers_message": {"make": MAKE, "result": RESULT, "kinds": ("std",)},
        "ros.camera_of": {"message": ROS_INFO, "rectified": False},
        "ros.diagnostics_message": {**message, "result": RESULT, "name": "a"},
        "ros.header_of": {"frame": FRAME, "frame_id": "a"},
        "ros.image_message": {**message, "pixels": image()},
        "ros.mask_message": {**message, "mask": MASK},
        "ros.objects_of": {"result": RESULT},
        "ros.picture_message": {**message, "jpeg": b"a"},
        "ros.pixels_of": {"message": ROS_MASK},
        "ros.points_message": {**message, "samples": [in_space], "dims": 3},
        "ros.sample_m": {"track": track},
        "ros.sample_px": {"track": track},
        "ros.sampled_m": {"result": RESULT},
        "sinks.kind_of": {"path": "a.csv"},
        "sinks.open": {"path": folder / "a.csv"},
        "sinks.read_json_lines": {"path": folder / "a.jsonl"},
        "sinks.read_npz": {"path": folder / "a.npz"},
        "sources.open": {
            "where": MASK[None],
            "kind": "auto",
            "camera": CAMERA,
            "fps": 5.0,
            "jobs": 1,
            "keep_messages": False,
        },
        "lab.Truth": {"curves": CURVES, "visible_masks": (), "ids": TRUTH.ids, "curves_3d": ()},
        "lab.Truth.from_dict": {"data": TRUTH.to_dict()},
        "lab.open_labelled": {"folder": folder, "layout": "auto"},
        "topology.Diagram": {
            **{"passes": KNOT.passes, "closed": KNOT.closed, "turns": KNOT.turns, "tops": KNOT.tops},
            **{"confidences": KNOT.confidences, "labels": KNOT.labels, "objects": KNOT.objects},
            **{"strand_confidences": KNOT.strand_confidences},
        },
        "topology.Diagram.close": {"over": True},
        "topology.Diagram.from_curves": {"curves": [SPACE], "closed": None},
        "topology.Diagram.from_gauss_code": {"code": KNOT.gauss_code, "signs": KNOT.signs},
        "topology.Diagram.from_pd_code": {"code": KNOT.pd_code},
        "topology.Diagram.from_result": {"result": RESULT, "objects": [0], "min_confidence": 0.9},
        "topology.Diagram.part": {"strands": [0]},
        "topology.describe": {"result": RESULT},
        "viz.Style": {"ink": (1, 2, 3), "line_px": 1.0, "panel_px": 100},
        "viz.Style.colour": {"order": 1},
        "viz.Style.scaled": {"size": (40, 60)},
        "viz.as_png": {"picture": image()},
        "viz.contact_sheet": {"pictures": [image()], "titles": ["a"], "columns": 1, "tile_width": 60},
        "viz.draw": {"image_or_frame": FRAME, "result": RESULT, "style": dloftbs.viz.Style()},
        "viz.draw_3d": {"frame": FRAME, "result": RESULT, "style": dloftbs.viz.Style()},
        "viz.draw_stages": {"trace": TRACE, "style": dloftbs.viz.Style()},
        "viz.show": {"result": RESULT, "image_or_frame": FRAME},
    }
    for name in dloftbs.config.__all__:
        kind = getattr(dloftbs.config, name)
        if name.endswith("Config") and name != "Config":
            defaults = kind(**NEEDED.get(name, {}))
            given[f"config.{name}"] = {field: getattr(defaults, field) for field in kind.__struct_fields__}
    found: dict[str, Call] = {}
    for name, arguments in given.items():
        home: Any = dloftbs
        owner, _, last = name.rpartition(".")
        if owner in instances:
            home = instances[owner]
        elif owner:
            room, *parts = owner.split(".")
            home = home_of(room)
            for part in parts:
                home = getattr(home, part)
        found[name] = (getattr(home, last), arguments)
    return found


NEEDED: dict[str, dict[str, Any]] = {
    "BackgroundConfig": {"file": "empty.png"},
    "ColourConfig": {"pictures": COLOUR.pictures},
    "ColourPicture": {},
    "LocalConfig": {"tone": "darker"},
    "NetworkConfig": {"file": "model.onnx"},
}
"""Arguments of those sections that have no default."""


LEFT_OUT = {
    # Made by the package, not by its users.
    "Joint", "Prediction", "StageTrace", "OcclusionEvidence.depth_along", "OcclusionEvidence.look",
    "OcclusionEvidence.of", "OcclusionEvidence.project", "OcclusionEvidence.sample", "Segment.cut", "sinks.NpzRow",
    "evaluation.CurveDistances", "evaluation.DiceScore", "evaluation.InstanceScore", "evaluation.Matching",
    "evaluation.Matching.clean", "evaluation.Pair", "evaluation.PointError", "evaluation.TrackingScores",
    "ros.MessageFactory.__call__",
    "evaluation.TrackingScorer.add", "evaluation.TrackingScorer.track_of", "evaluation.match_distances",
    "lab.write_sequence", "FrameResult.to_dataframe", "FrameResult.plot",
    "topology.EndMove", "topology.Move", "topology.Simplified",
}  # fmt: skip
"""Names that other tests try, or that nobody calls by hand."""
MADE_BY_OPEN = ("Source", "Sink", "KnownSequence")
"""Ends of the names of classes that `sources.open` and `sinks.open` make, which check what they are given."""


def home_of(name: str) -> Any:
    """Return what the first part of a name stands for: the laboratory, a room of it, or a part of the package."""
    if name == "lab":
        return dloftbs_lab
    return getattr(dloftbs_lab if name == "evaluation" else dloftbs, name)


def public() -> Iterator[str]:
    """Yield the names of all that is public and takes arguments."""
    spaces = [("", dloftbs), *((f"{room}.", home_of(room)) for room in ROOMS)]
    for prefix, space in spaces:
        for name in space.__all__:
            value = getattr(space, name)
            is_class = inspect.isclass(value) and value.__module__.startswith("dloftbs")
            if is_class and issubclass(value, (Exception, enum.Enum)):
                continue
            if (is_class or inspect.isfunction(value)) and takes_arguments(value):
                yield prefix + name
            if is_class and not (prefix and name in dloftbs.__all__):
                for method in vars(value):
                    if method == "__call__" or not method.startswith("_"):
                        function = getattr(value, method)
                        if callable(function) and takes_arguments(function):
                            yield f"{prefix}{name}.{method}"


def takes_arguments(function: Callable[..., Any]) -> bool:
    return any(name != "self" for name in inspect.signature(function).parameters)


def test_nothing_public_is_forgotten(tmp_path: Path) -> None:
    at_the_front = {f"{room}.{name}" for room in ROOMS for name in dloftbs.__all__}
    tried = {name for name in public() if not any(part.endswith(MADE_BY_OPEN) for part in name.split("."))}
    assert tried - LEFT_OUT - at_the_front - calls(tmp_path).keys() == set()
    assert tried >= LEFT_OUT


NAMES = sorted(calls(Path("nowhere")))


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let what takes a wrong value for a path write where nothing is."""
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", NAMES)
def test_wrong_types_raise_the_errors_of_the_package_alone(name: str, tmp_path: Path) -> None:
    failures = []
    call, given = calls(tmp_path)[name]
    for argument, (what, wrong) in itertools.product(given, WRONG.items()):
        try:
            result = call(**{**given, argument: wrong})
            if inspect.isgenerator(result):
                next(result, None)
            if isinstance(result, (dloftbs.sinks.Sink, dloftbs.sources.Source)):
                result.close()
        except DloftbsError:
            pass
        except Exception as error:  # noqa: BLE001 - this is what is looked for
            failures.append(f"{name}({argument}={what}): {type(error).__name__}: {error}"[:200])
    assert failures == []
