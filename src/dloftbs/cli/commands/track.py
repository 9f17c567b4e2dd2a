"""``dloftbs track``: a stream in, curves with identities out."""

from __future__ import annotations

import sys
from collections.abc import Generator, Iterable, Sequence
from contextlib import ExitStack
from itertools import islice
from typing import TYPE_CHECKING

import click

from dloftbs.cli.limits import MAX_FRAMES, FilledPath
from dloftbs.cli.options import (
    STANDARD_OUTPUT,
    InputOptions,
    check_pictures,
    config_options,
    input_options,
    out_option,
)
from dloftbs.cli.shell import interrupted
from dloftbs.errors import SourceError

if TYPE_CHECKING:
    from dloftbs.cli.places import Outputs
    from dloftbs.config import Config
    from dloftbs.frame import Frame
    from dloftbs.frame_result import FrameResult
    from dloftbs.sinks import Sink
    from dloftbs.sources import Source


@click.command(short_help="Follow the cables through a stream.")
@click.argument("where", metavar="INPUT", type=FilledPath())
@out_option
@click.option(
    "--overlay",
    type=FilledPath(),
    metavar="VIDEO|FOLDER|PNG",
    callback=check_pictures(video=True),
    help="Draw the curves over the frames: .mp4, .mov, a folder of pictures, or a picture for a single frame.",
)
@click.option("--limit", type=click.IntRange(1, MAX_FRAMES), metavar="N", help="Stop after N frames.")
@click.option(
    "--fps",
    type=click.FloatRange(0.01, 1000.0),
    metavar="RATE",
    help="Frames per second of the input, for its stamps and the video of overlays; there it is 30 if nobody says.",
)
@input_options
@config_options
@click.pass_context
def track(
    context: click.Context,
    where: str,
    outs: tuple[str, ...],
    overlay: str | None,
    limit: int | None,
    fps: float | None,
    inputs: InputOptions,
    config: Config,
) -> None:
    """Follow the cables through a stream, each with its identity and direction.

    INPUT is a video, a folder or a glob of images or masks in their natural order, an .npy or .npz file,
    the index of a camera, or the address of a stream. Without --out and --overlay, results are JSON lines
    on standard output. Progress and a summary of the timing go to standard error. Ctrl-C ends the run:
    files are closed, the summary is printed, and the exit code is 130. Reading, tracking and writing go on
    side by side; a camera that is faster than all that has frames left out, so that results are never late.
    No result replaces an input: in a folder of inputs, pictures are named photo.overlay.png.

    \b
    dloftbs track cable.mp4 --hsv 170:10,80:255,60:255 --out curves.jsonl --overlay overlay.mp4
    dloftbs track masks/ --kind mask --fps 30 --out curves.npz
    """
    from dloftbs.cli.frames import UsableFrames
    from dloftbs.cli.outputs import write_config
    from dloftbs.cli.places import InputFiles, plan_outputs
    from dloftbs.cli.progress import open_progress
    from dloftbs.cli.stream_report import RunReport
    from dloftbs.overlap import Ahead, Behind, cores
    from dloftbs.pipeline import Pipeline

    if not outs and overlay is None:
        outs = (STANDARD_OUTPUT,)
    files = InputFiles((where,), context.params)
    outputs = plan_outputs(outs, {"--overlay": overlay}, files, config, is_one=limit == 1)
    pipeline = Pipeline(config)
    source = inputs.open(where, fps, jobs=cores())
    frames = UsableFrames(source, config, inputs)
    length = min((n for n in (source.length, limit) if n is not None), default=None)
    report = RunReport()
    read = Ahead(_frames_of(source, frames, limit), newest=source.live)
    try:
        with ExitStack() as stack:
            stack.enter_context(read)
            sink = stack.enter_context(_open_sink(outputs, source.fps))
            write_config(outputs.config_file, config)
            progress = stack.enter_context(open_progress(length, shares_terminal=_prints_to_terminal(outs)))
            stop = stack.enter_context(interrupted())

            def write(done: tuple[Frame, FrameResult]) -> None:
                frame, result = done
                sink.write(frame, result)
                report.skipped = frames.skipped
                report.add(result)
                progress.tick(report)

            written = stack.enter_context(Behind(write))
            for frame in islice(read, limit):
                written.put((frame, pipeline.process(frame)))
                if stop():
                    raise KeyboardInterrupt
    finally:
        report.skipped, report.missed = frames.skipped, read.missed
        if report.frames:
            click.echo(report.summary(), err=True)
    if not report.frames:
        raise SourceError(f"{source.name}: no frame could be read")


def _frames_of(source: Source, frames: Iterable[Frame], limit: int | None) -> Generator[Frame, None, None]:
    """Yield the frames of a source, and close it in the same thread; of a recording, read none that is not wanted."""
    with source:
        yield from frames if source.live else islice(frames, limit)


def _open_sink(outputs: Outputs, fps: float | None) -> Sink:
    from dloftbs.cli.outputs import open_outputs, open_pictures

    pictures = (open_pictures(path, ending, fps=fps or 30.0) for path, ending in outputs.pictures.values())
    return open_outputs(outputs.data, *pictures)


def _prints_to_terminal(outs: Sequence[str]) -> bool:
    return STANDARD_OUTPUT in outs and sys.stdout.isatty()
