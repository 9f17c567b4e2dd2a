"""The demo of objects that branch: a harness in motion, tracked by its masks, and held against the truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from dloftbs import sinks, viz
from dloftbs.cli.outputs import open_outputs
from dloftbs.config import Config
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.harness import Harness
from dloftbs.pipeline import Pipeline
from dloftbs_lab.commands.demo_names import CURVES, INPUT, OVERLAY
from dloftbs_lab.evaluation import match_curves
from dloftbs_lab.evaluation.runner.frame_scores import CLEAN_L3
from dloftbs_lab.evaluation.runner.harness_scores import NODE, HarnessScore, score_harness
from dloftbs_lab.synthetic import HarnessSequence

WHAT = {
    INPUT: "the masks that were drawn, as a video",
    OVERLAY: "the video with the branches, and a white ring at each branch point",
    CURVES: "all branches, and the harnesses with their branch points and routes, one line of JSON a frame",
}
DRAWN = "a harness"
_BRANCHES = 3


def follow(frames: int, size: tuple[int, int], seed: int, folder: Path) -> str:
    """Draw a harness, track it, write its files into the folder, and return the figures as text.

    Raises
    ------
    InputError
        If no harness fits a video of this size.
    SinkError
        If a file cannot be written.
    """
    sequence = HarnessSequence(_BRANCHES, "in perspective", frames, size, seed)
    pipeline = Pipeline(Config().replace({"linking.branched": True}))
    scores: list[HarnessScore] = []
    harness_ids, point_ids, milliseconds = set[int | None](), set[int | None](), []
    video = sinks.OverlayVideoSink(folder / INPUT, fps=sequence.fps or 30.0, draw=_as_picture)
    overlay = sinks.OverlayVideoSink(folder / OVERLAY, fps=sequence.fps or 30.0, draw=viz.draw)
    with video, open_outputs([str(folder / CURVES)], overlay) as sink:
        for frame in sequence:
            result = pipeline.process(frame)
            video.write(frame, result)
            sink.write(frame, result)
            scores.append(_score(result, sequence, frame.index))
            harness_ids |= {one.id for one in result.harnesses}
            point_ids |= {point.id for point in result.branch_points}
            milliseconds.append(result.total_ms)
    found, true, right = (sum(getattr(one, f"nodes_{what}") for one in scores) for what in ("found", "true", "right"))
    branches = sum(one.branches_right for one in scores) / (len(scores) * (2 * _BRANCHES + 1))
    rows = [
        ("video", f"{frames} frames of {size[1]}x{size[0]}, a harness with {_BRANCHES} branch points, {sequence.name}"),
        ("a frame", f"{np.median(milliseconds):.2f} ms (p50)"),
        ("whole harness right", f"in {sum(one.whole for one in scores)} of {frames} frames"),
        ("branches right", f"{100.0 * branches:.0f} %"),
        ("branch points", f"F1 {200.0 * right / max(found + true, 1):.0f} %"),
        ("ids in all", f"{len(harness_ids)} of harnesses, {len(point_ids)} of branch points"),
        ("routes", _routes(result.harnesses)),
    ]
    return "\n".join(f"{name:24}{value}" for name, value in rows)


def _score(result: FrameResult, sequence: HarnessSequence, index: int) -> HarnessScore:
    truth, side = sequence.truth(index), max(sequence.size)
    points = np.array([point.position for point in result.branch_points]).reshape(-1, 2)
    matching = match_curves([one.curve for one in result], truth.curves)
    return score_harness(points, matching, truth, CLEAN_L3 * side, NODE * side)


def _routes(harnesses: tuple[Harness, ...]) -> str:
    lengths = [f"{route.curve.length:.0f} px" for harness in harnesses for route in harness.routes]
    return f"of the last frame: {', '.join(lengths)}" if lengths else "none in the last frame"


def _as_picture(frame: Frame, result: FrameResult) -> npt.NDArray[np.uint8]:
    assert frame.mask is not None  # the sequence draws masks
    return np.repeat((frame.mask[..., None] != 0).astype(np.uint8) * 255, 3, axis=2)
