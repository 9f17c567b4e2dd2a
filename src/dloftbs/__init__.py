"""Fast tracking of deformable linear objects (cables, ropes, hoses) as B-splines.

A whole program::

    import dloftbs

    for d in dloftbs.detect(mask):            # one mask, no memory
        print(d.curve.sample(100))            # (100, 2) px

    for result in dloftbs.track("cable.mp4", hsv="170:10,80:255,60:255"):  # a red one
        for t in result.tracks:               # identities and directions are kept
            print(t.id, t.curve.sample(100))

The names load on first use, so that importing the package costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from dloftbs._version import __version__
from dloftbs.data.presentation import Outputs, register_outputs
from dloftbs.errors import explain_import

if TYPE_CHECKING:
    from dloftbs import config, ros, sinks, sources, topology, viz
    from dloftbs.api import detect, track
    from dloftbs.camera import DepthRegistration, PinholeCamera
    from dloftbs.config import Config, HsvRange, Stroke
    from dloftbs.data.branch_point import BranchPoint
    from dloftbs.data.centerline import Centerline, Joint, JointKind, NearJoint, Segment
    from dloftbs.data.curve import BSplineCurve
    from dloftbs.data.detection import Crossing, Detection
    from dloftbs.data.dropped import Dropped
    from dloftbs.data.frame import Frame
    from dloftbs.data.frame_result import FrameResult
    from dloftbs.data.harness import Harness, Route
    from dloftbs.data.prediction import Prediction
    from dloftbs.data.prompt import Prompt
    from dloftbs.data.stage_trace import StageTrace
    from dloftbs.data.tracks import EndKind, Track, TrackState
    from dloftbs.errors import ConfigError, DependencyError, DloftbsError, InputError, SinkError, SourceError
    from dloftbs.evidence import OcclusionEvidence
    from dloftbs.pipeline import Pipeline
    from dloftbs.segmentation import BackgroundSegmenter, ColourModel, Segmenter, median_background
    from dloftbs.stereo import CameraRig, RigResult, StereoPipeline
    from dloftbs.tracking import Tracker

_HOME = {
    "PinholeCamera": "camera",
    **dict.fromkeys(("Centerline", "Joint", "JointKind", "NearJoint", "Segment"), "data.centerline"),
    **dict.fromkeys(("Config", "HsvRange", "Stroke"), "config"),
    "BSplineCurve": "data.curve",
    **dict.fromkeys(
        ("ConfigError", "DependencyError", "DloftbsError", "InputError", "SinkError", "SourceError"), "errors"
    ),
    **dict.fromkeys(("Crossing", "Detection"), "data.detection"),
    "Dropped": "data.dropped",
    "OcclusionEvidence": "evidence",
    "Frame": "data.frame",
    "FrameResult": "data.frame_result",
    "BranchPoint": "data.branch_point",
    **dict.fromkeys(("Harness", "Route"), "data.harness"),
    **dict.fromkeys(("EndKind", "Track", "TrackState"), "data.tracks"),
    **dict.fromkeys(("detect", "track"), "api"),
    "Pipeline": "pipeline",
    "Prediction": "data.prediction",
    "Prompt": "data.prompt",
    **dict.fromkeys(("BackgroundSegmenter", "ColourModel", "Segmenter", "median_background"), "segmentation"),
    "StageTrace": "data.stage_trace",
    **dict.fromkeys(("CameraRig", "RigResult", "StereoPipeline"), "stereo"),
    "DepthRegistration": "camera",
    "Tracker": "tracking",
}
_SUBMODULES = ("config", "ros", "sinks", "sources", "topology", "viz")

__all__ = [
    "BSplineCurve",
    "BackgroundSegmenter",
    "BranchPoint",
    "CameraRig",
    "Centerline",
    "ColourModel",
    "Config",
    "ConfigError",
    "Crossing",
    "DependencyError",
    "DepthRegistration",
    "Detection",
    "DloftbsError",
    "Dropped",
    "EndKind",
    "Frame",
    "FrameResult",
    "Harness",
    "HsvRange",
    "InputError",
    "Joint",
    "JointKind",
    "NearJoint",
    "OcclusionEvidence",
    "PinholeCamera",
    "Pipeline",
    "Prediction",
    "Prompt",
    "RigResult",
    "Route",
    "Segment",
    "Segmenter",
    "SinkError",
    "SourceError",
    "StageTrace",
    "StereoPipeline",
    "Stroke",
    "Track",
    "TrackState",
    "Tracker",
    "__version__",
    "config",
    "detect",
    "median_background",
    "ros",
    "sinks",
    "sources",
    "topology",
    "track",
    "viz",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME and name not in _SUBMODULES:
        raise AttributeError(f"module 'dloftbs' has no attribute {name!r}")
    try:
        if name in _HOME:
            value = getattr(importlib.import_module(f"dloftbs.{_HOME[name]}"), name)
        else:
            value = importlib.import_module(f"dloftbs.{name}")
    except ImportError as error:
        raise explain_import(error) from error
    globals()[name] = value
    return value


def _outputs() -> Outputs:
    from dloftbs.sinks.single import OUTPUTS

    return OUTPUTS


register_outputs(_outputs)


def __dir__() -> list[str]:
    return sorted(__all__)
