"""``dloftbs track``: a stream in, curves with identities out."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from contextlib import ExitStack
from itertools import islice
from typing import TYPE_CHECKING

import click

from dloftbs.cli.limits import FilledPath
from dloftbs.cli.options import (
    STANDARD_OUTPUT,
    InputOptions,
    check_pictures,
    config_options,
    every_option,
    input_options,
    limit_option,
    out_option,
    prints_to_terminal,
    stages_option,
)
from dloftbs.cli.page import LOOK_EVERY_S, PageOptions, page_options, require_page, served
from dloftbs.cli.shell import BAD_INPUT, interrupted
from dloftbs.errors import SourceError

if TYPE_CHECKING:
    from dloftbs.cli.places import Outputs
    from dloftbs.config import Config
    from dloftbs.frame import Frame
    from dloftbs.frame_result import FrameResult
    from dloftbs.sinks import Sink
    from dloftbs.sources import Source


@click.command(short_help="Follow the cables through a stream.")
@click.argument("where", metavar="INPUT...", nargs=-1, required=True, type=FilledPath())
@out_option
@click.option(
    "--overlay",
    type=FilledPath(),
    metavar="VIDEO|FOLDER|PNG",
    callback=check_pictures(video=True),
    help="Draw the curves over the frames: .mp4, .mov, a folder of pictures, or a picture for a single frame.",
)
@stages_option
@limit_option
@every_option
@click.option(
    "--fps",
    type=click.FloatRange(0.01, 1000.0),
    metavar="RATE",
    help="Frames per second of the input, for its stamps and the video of overlays; there it is 30 if nobody says.",
)
@click.option(
    "--view", is_flag=True, help="Show the curves live on a page while tracking; a recording waits until it is open."
)
@input_options
@config_options
@page_options
@click.pass_context
def track(
    context: click.Context,
    where: tuple[str, ...],
    outs: tuple[str, ...],
    overlay: str | None,
    stages: str | None,
    limit: int | None,
    every: int,
    fps: float | None,
    view: bool,
    inputs: InputOptions,
    config: Config,
    page: PageOptions,
) -> None:
    """Follow the cables through a stream, each with its identity and direction.

    INPUT is a video, an animated PNG or WebP, a folder or a glob of images or masks in their natural
    order, the files of one, an .npy or .npz file, the index of a camera or its device /dev/video0, the
    address of a stream, or - for standard input. Without --out, --overlay and --stages, results are JSON
    lines on standard output. Progress and a summary of the timing go to standard error. What cannot be
    read is reported, the rest goes on, and the exit code is 1. Ctrl-C ends the run: files are closed, the
    summary is printed, and the exit code is 130. Reading, tracking and writing go on side by side; a camera
    that is faster than all that has frames left out, so that results are never late. No result replaces an
    input: in a folder of inputs, pictures are named photo.overlay.png and photo.stages.png.

    \b
    dloftbs track cable.mp4 --hsv 170:10,80:255,60:255 --out curves.jsonl --overlay overlay.mp4
    dloftbs track cable.mp4 --hsv 170:10 --every 30 --limit 5 --stages stages
    dloftbs track masks/ --kind mask --fps 30 --out curves.npz
    """
    from dloftbs.cli.frames import UsableFrames, in_natural_order
    from dloftbs.cli.outputs import write_config
    from dloftbs.cli.places import InputFiles, plan_outputs
    from dloftbs.cli.progress import open_progress
    from dloftbs.cli.stream_report import RunReport
    from dloftbs.overlap import Ahead, Behind, cores
    from dloftbs.pipeline import Pipeline

    if view:
        require_page()
    if not outs and overlay is None and stages is None:
        outs = (STANDARD_OUTPUT,)
    pictures = {"--overlay": overlay, "--stages": stages}
    outputs = plan_outputs(outs, pictures, InputFiles(where, context.params), config, is_one=limit == 1)
    pipeline = Pipeline(config)
    source = inputs.open(where[0] if len(where) == 1 else in_natural_order(where, inputs), fps, jobs=cores())
    frames = UsableFrames(source, config, inputs, every)
    usable = None if source.length is None else -(-source.length // every)
    report = RunReport(min((n for n in (usable, limit) if n is not None), default=None))
    read = Ahead(_frames_of(source, frames, limit), newest=source.live)
    try:
        with ExitStack() as stack:
            stack.enter_context(read)
            sink = stack.enter_context(_open_sink(outputs, source.fps and source.fps / every, config))
            write_config(outputs.config_file, config)
            progress = stack.enter_context(open_progress(shares_terminal=prints_to_terminal(outs)))
            stop = stack.enter_context(interrupted())
            show = _open_page(stack, source, page, stop) if view else None

            def write(done: tuple[Frame, FrameResult]) -> None:
                frame, result = done
                sink.write(frame, result)
                report.skipped = frames.skipped
                report.add(result)
                progress.tick(report)

            written = stack.enter_context(Behind(write))
            for frame in islice(read, limit):
                result = pipeline.process(frame)
                written.put((frame, result))
                if show is not None:
                    show(frame, result)
                if stop():
                    raise KeyboardInterrupt
    finally:
        report.skipped, report.missed = frames.skipped, read.missed
        if report.frames:
            click.echo(report.summary(), err=True)
    if not report.frames:
        raise SourceError(f"{source.name}: no frame could be read")
    if report.skipped and not source.live:  # a camera now and then has a frame that cannot be decoded
        context.exit(BAD_INPUT)


def _open_page(
    stack: ExitStack, source: Source, page: PageOptions, stop: Callable[[], bool]
) -> Callable[[Frame, FrameResult], None]:
    """Serve a page until the stack is closed; of a recording nothing is tracked before somebody looks."""
    from dloftbs.ui.view_session import ViewFeed

    feed = ViewFeed(source.name, length=source.length, live=source.live)
    stack.enter_context(served(feed, page))
    stack.callback(feed.finish)
    if not source.live:
        click.echo("waiting until the page is open", err=True)
        while not feed.visited.wait(LOOK_EVERY_S) and not stop():
            pass
    return feed.publish


def _frames_of(source: Source, frames: Iterable[Frame], limit: int | None) -> Generator[Frame, None, None]:
    """Yield the frames of a source, and close it in the same thread; of a recording, read none that is not wanted."""
    with source:
        yield from frames if source.live else islice(frames, limit)


def _open_sink(outputs: Outputs, fps: float | None, config: Config) -> Sink:
    from dloftbs.cli.outputs import open_all_pictures, open_outputs
    from dloftbs.pipeline import Pipeline

    # Another pipeline, since what is drawn is drawn in another thread.
    return open_outputs(outputs.data, *open_all_pictures(outputs.pictures, Pipeline(config), fps=fps or 30.0))
