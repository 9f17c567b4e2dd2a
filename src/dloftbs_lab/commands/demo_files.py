"""The files of the demo's folder, and the text that goes with them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import msgspec

from dloftbs import sinks, viz
from dloftbs._version import __version__
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import SinkError
from dloftbs.support.arrays import ByteArray
from dloftbs.support.json_text import encode
from dloftbs.support.safe_files import sink_errors, write_whole
from dloftbs_lab.commands import demo_space
from dloftbs_lab.commands.demo_names import CURVES, INDEX, INPUT, OVERLAY, README, SHEET, SUMMARY
from dloftbs_lab.commands.demo_page import demo_page
from dloftbs_lab.commands.scoring import spread_text
from dloftbs_lab.synthetic import DemoSequence

if TYPE_CHECKING:
    from dloftbs_lab.commands.demo_run import DemoRun
    from dloftbs_lab.commands.demo_space import SpaceRun

_WHAT = {
    INDEX: "a page with the video, the figures and the commands to run next: open this first",
    INPUT: "the generated video",
    OVERLAY: "the video with the curves: a dot is the start, a ring the end, dashes were not seen but inferred",
    SHEET: "a dozen frames of it",
    CURVES: "all curves, one line of JSON a frame",
    "cable_1.config.yaml": "the settings used, with the colour of the first cable",
    "cable_2.config.yaml": "the settings for the second cable",
    **demo_space.WHAT,
    SUMMARY: "the figures below, and each frame's",
    README: "this text",
}


_TITLE = "The demo of dloftbs"


def mark_as_demo(folder: Path, files: Mapping[str, str] = _WHAT) -> None:
    """Make a folder the demo's: its README says so from the beginning, that a later demo may replace all files.

    Raises
    ------
    SinkError
        If it holds files of these names that no demo wrote, or cannot be written.
    """
    readme = folder / README
    with sink_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        there = [name for name in files if os.path.lexists(folder / name)]
        if there and not (readme.is_file() and readme.read_text("utf-8", "replace").startswith(_TITLE)):
            raise SinkError(
                f"{folder} is not the folder of a demo, and holds {', '.join(there)}, which would be replaced: "
                "name another folder with --out"
            )
    write_whole(readme, f"{_TITLE} {__version__}, which has not come to its end.\n".encode())


def render(sequence: DemoSequence, folder: Path) -> None:
    """Write the sequence as a video.

    Raises
    ------
    SinkError
        If it cannot be written.
    """
    with sinks.OverlayVideoSink(folder / INPUT, fps=sequence.fps or 30.0, draw=as_it_is) as video:
        for frame in sequence:
            video.write(frame, FrameResult((), (), None, frame.size, index=frame.index))


def as_it_is(frame: Frame, result: FrameResult) -> ByteArray:
    """Return the image of a frame that was drawn, shape (H, W, 3)."""
    assert frame.image is not None  # the sequence draws images
    return frame.image


def write_sheet(run: DemoRun, folder: Path) -> None:
    """Write the pictures kept, in their order, on one sheet."""
    indices = sorted(run.pictures)
    titles = [_title(run, index) for index in indices]
    sheet = viz.contact_sheet([run.pictures[i] for i in indices], titles)
    encoded, data = cv2.imencode(".png", sheet)
    assert encoded  # any picture of uint8 can be a PNG
    write_whole(folder / SHEET, data.tobytes())


def _title(run: DemoRun, index: int) -> str:
    score = next(score for score in run.scores.frames if score.index == index)
    return f"frame {index}: {score.curves} found"


def write_summary(run: DemoRun, space: SpaceRun, sequence: DemoSequence, folder: Path) -> None:
    """Write the figures, and each frame's, as JSON."""
    height, width = sequence.size
    summary = {
        "version": __version__,
        "sequence": {"name": sequence.name, "frames": len(sequence), "size": f"{width}x{height}"},
        "configs": [config.to_dict() for config in run.configs],
        **_timing(run),
        **run.scores.to_dict(),
        "in_space": space.to_dict(),
        "per_frame": [msgspec.to_builtins(score) for score in run.scores.frames],
    }
    write_whole(folder / SUMMARY, encode(summary, indent=2))


def _timing(run: DemoRun) -> dict[str, Any]:
    total = run.report.total
    return {
        "frames": run.report.frames,
        "frames_skipped": run.report.skipped,
        "pipeline_frames_per_s": 1e3 * total.count / total.sum_ms,
        "pipeline_p50_ms": total.percentile(50),
        "pipeline_p99_ms": total.percentile(99),
        "confirmed_tracks": run.report.steadiness.tracks,
    }


def figures_of(run: DemoRun, space: SpaceRun, sequence: DemoSequence) -> list[tuple[str, str]]:
    """Return the figures, each with its name."""
    timing, scores = _timing(run), run.scores.to_dict()
    height, width = sequence.size
    frames, cables = timing["frames"], run.scores.cables
    rows = [
        ("video", f"{frames} frames of {width}x{height}, {cables} cables, {sequence.name}"),
        (
            "pipeline alone",
            f"{timing['pipeline_frames_per_s']:.0f} frames/s; a frame {timing['pipeline_p50_ms']:.2f} ms (p50), "
            f"{timing['pipeline_p99_ms']:.2f} ms (p99)",
        ),
        ("L1, mask to curves", spread_text(scores["l1_px"], "px")),
        ("L2, curves to mask", spread_text(scores["l2_px"], "px")),
        ("L3, curve to truth", f"{spread_text(scores['l3_px'], 'px')} (frame {scores['worst_frame']})"),
        ("right number of curves", f"in {scores['frames_with_the_right_number_of_curves']} of {frames} frames"),
        ("too many curves", f"in {scores['frames_with_too_many_curves']} of {frames} frames"),
    ]
    if timing["frames_skipped"]:
        rows.append(("not read", f"{timing['frames_skipped']} frames"))
    for cable, missing in enumerate(scores["frames_without_a_curve_for_a_cable"]):
        ids = scores["ids_of_each_cable"][cable]
        rows.append((f"cable {cable + 1}", f"without a curve in {missing} of {frames} frames; ids in all: {ids}"))
    rows.append(("turned around", f"{scores['turned_around']} times"))
    return rows + space.rows()


def table(rows: list[tuple[str, str]]) -> str:
    """Return the figures as text."""
    return "\n".join(f"{name:24}{value}" for name, value in rows)


def describe_files(files: Mapping[str, str], figures: str, folder: Path) -> None:
    """Write what the folder holds, and the figures."""
    rows = "\n".join(f"{name:20}{what}" for name, what in {**files, README: "this text"}.items())
    write_whole(folder / README, f"{_TITLE} {__version__}\n\n{rows}\n\n{figures}\n".encode())


def describe(rows: list[tuple[str, str]], space: SpaceRun, folder: Path) -> None:
    """Write what the folder holds, the command that makes the same, and the figures: as text, and as a page."""
    write_whole(folder / INDEX, demo_page(rows, space.command()).encode())
    files = "\n".join(f"{name:20}{what}" for name, what in _WHAT.items())
    text = (
        f"{_TITLE} {__version__}\n\n{files}\n\n"
        "Track one cable yourself, in this folder:\n\n"
        f"    dloftbs track {INPUT} --config cable_1.config.yaml --out cable_1.jsonl --overlay cable_1.mp4\n\n"
        "A cable in space, its curve as a mesh:\n\n"
        f"    {space.command()}\n\n"
        f"{table(rows)}\n\n"
        "L1: mean distance of the cables' visible pixels to the nearest curve; a perfect one has a quarter of their\n"
        "width. L2: of the curves' points to the nearest visible pixel; parts under a hand or a gripper count here.\n"
        "L3: of a curve from its true one at equal arc lengths, hidden parts included, the best curve for each cable;\n"
        "cables without a curve have none, and are counted.\n"
    )
    write_whole(folder / README, text.encode())
