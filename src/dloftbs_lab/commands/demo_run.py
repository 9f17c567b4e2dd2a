"""The demo's video, tracked, drawn and scored, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from dloftbs import sinks, sources, viz
from dloftbs.cli.outputs import open_outputs
from dloftbs.cli.progress import open_progress
from dloftbs.cli.stream_report import RunReport
from dloftbs.config import Config
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.pipeline.group import PipelineGroup
from dloftbs.sources import Source
from dloftbs_lab.commands.demo_names import CURVES, INPUT, OVERLAY
from dloftbs_lab.commands.scoring import Scores, score_frame
from dloftbs_lab.synthetic import DemoSequence

_PICTURES = 12
STYLE = viz.Style(palette=((66, 228, 240), (250, 230, 120)))
"""Yellow on the blue cable, light blue on the pink one."""


@dataclass
class DemoRun:
    """Outcome of the demo.

    Parameters
    ----------
    configs : list of Config
        One for each cable: they differ in the colour.
    report : RunReport
    scores : Scores
    pictures : dict of int to numpy.ndarray, shape (H, W, 3), uint8
        Drawn frames, spread over the sequence, by index.
    """

    configs: list[Config]
    report: RunReport
    scores: Scores
    pictures: dict[int, npt.NDArray[np.uint8]] = field(default_factory=dict)


def follow(sequence: DemoSequence, configs: list[Config], folder: Path) -> DemoRun:
    """Track the video in the folder, write curves and overlay beside it, and score them.

    Each cable has a colour of its own and so a pipeline of its own, with tracks of its own; their ids tell
    them apart. Tracking, drawing and scoring come one after the other, so that the timing is not disturbed.

    Raises
    ------
    SourceError, SinkError
        If the video cannot be read, or a result not be written.
    """
    run = DemoRun(configs, RunReport(objects=len(sequence.hsv)), Scores(len(sequence.hsv)))
    with sources.open(folder / INPUT) as source:
        results = _track(source, run)
        _write(source, results, run, folder)
    for result in results:
        run.scores.add(score_frame(result, sequence.truth(result.index)))
    return run


def _track(source: Source, run: DemoRun) -> list[FrameResult]:
    pipelines = PipelineGroup(run.configs)
    results = []
    run.report.length = source.length
    with open_progress(shares_terminal=False) as progress:
        for frame in source:
            results.append(pipelines.process(frame))
            run.report.add(results[-1])
            progress.tick(run.report)
    run.report.skipped = source.skipped
    return results


def _write(source: Source, results: list[FrameResult], run: DemoRun, folder: Path) -> None:
    wanted = {results[i].index for i in np.linspace(0, len(results) - 1, _PICTURES).round().astype(int)}

    def draw(frame: Frame, result: FrameResult) -> npt.NDArray[np.uint8]:
        picture = viz.draw(frame, result, style=STYLE)
        if frame.index in wanted:
            run.pictures[frame.index] = picture
        return picture

    overlay = sinks.OverlayVideoSink(folder / OVERLAY, fps=source.fps or 30.0, draw=draw)
    with open_outputs([str(folder / CURVES)], overlay) as sink:
        for frame, result in zip(source, results, strict=True):
            sink.write(frame, result)
