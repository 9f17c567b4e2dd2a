"""``dloftbs track``: a stream in, curves with identities out."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import click

from dloftbs.cli.answer_options import Answers, answer_options
from dloftbs.cli.config_options import config_options
from dloftbs.cli.help_sections import SectionedCommand
from dloftbs.cli.input_options import InputOptions, every_option, fps_option, input_options, limit_option, robot_options
from dloftbs.cli.limits import FilledPath
from dloftbs.cli.output_options import (
    STANDARD_OUTPUT,
    check_pictures,
    out_option,
    prints_to_terminal,
    stages_option,
    with_input_option,
)
from dloftbs.cli.page import LOOK_EVERY_S, PageOptions, page_options, require_page, served
from dloftbs.cli.shell import BAD_INPUT, interrupted

if TYPE_CHECKING:
    from dloftbs.cli.followed_stream import FollowedStream
    from dloftbs.cli.places import Outputs
    from dloftbs.config import Config
    from dloftbs.data.frame import Frame
    from dloftbs.data.frame_result import FrameResult
    from dloftbs.sources import Source


@click.command(cls=SectionedCommand, short_help="Follow the cables through a stream.")
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
@with_input_option
@limit_option
@every_option
@fps_option
@click.option(
    "--view", is_flag=True, help="Show the curves live on a page while tracking; a recording waits until it is open."
)
@click.option("--rerun", is_flag=True, help="Show frames and curves live in the viewer of Rerun (extra rerun).")
@answer_options
@input_options
@robot_options
@config_options
@page_options
@click.pass_context
def track(
    context: click.Context,
    where: tuple[str, ...],
    outs: tuple[str, ...],
    overlay: str | None,
    stages: str | None,
    with_input: bool,
    limit: int | None,
    every: int,
    fps: float | None,
    view: bool,
    rerun: bool,
    answers: Answers,
    inputs: InputOptions,
    config: Config,
    page: PageOptions,
) -> None:
    """Follow the cables through a stream, each with its identity and direction.

    INPUT is a video, an animated PNG, WebP or AVIF, a TIFF of several pages, an .npy or .npz file, or a ROS
    recording (.mcap, .db3, .bag or a rosbag2 folder). It may also be a folder or a glob of images or masks, read in
    natural order. A camera is its index, its device such as /dev/video0, or the address of a stream; - is standard
    input.

    Without --out, --overlay, --stages, --view and --rerun, results are JSON lines on standard output; --out - prints
    them beside other outputs. Progress and a summary go to standard error. Frames that cannot be read are reported
    and skipped, and the exit code is 1. Ctrl-C ends the run: files are closed, the summary is printed, and the
    exit code is 130. If a camera is faster than the tracking, frames are skipped, so results are never late. No
    result replaces an input: in a folder of inputs, pictures are named photo.overlay.png and photo.stages.png.

    \b
    dloftbs track cable.mp4 --hsv 170:10,80:255,60:255 --out curves.jsonl --overlay overlay.mp4
    dloftbs track cable.mp4 --hsv 170:10 --every 30 --limit 5 --stages stages
    dloftbs track masks/ --kind mask --fps 30 --out curves.npz
    dloftbs track run.mcap --topic /camera/color/image_raw --hsv 170:10 --out curves.mcap
    """
    from dloftbs.cli.followed_stream import StreamOptions
    from dloftbs.cli.frames import in_natural_order
    from dloftbs.cli.outputs import is_recording
    from dloftbs.cli.places import InputFiles, plan_outputs
    from dloftbs.cli.stream_run import StreamRun

    if view:
        require_page()
    if not outs and overlay is None and stages is None and not view and not rerun:
        outs = (STANDARD_OUTPUT,)
    if with_input and not any(is_recording(path) for path in outs):
        raise click.UsageError("--with-input goes with --out NAME.mcap or --out FOLDER/")
    answers.check(outs)
    pictures = {"--overlay": overlay, "--stages": stages}
    outputs = plan_outputs(outs, pictures, InputFiles(where, context.params), config, is_one=limit == 1)
    run = StreamRun(
        where[0] if len(where) == 1 else in_natural_order(where, inputs),
        StreamOptions(inputs, config, fps, every, limit, keep_messages=with_input),
    )
    follow(context, run, outputs, answers, page if view else None, rerun=rerun)


def follow(
    context: click.Context,
    run: FollowedStream[Any],
    outputs: Outputs,
    answers: Answers,
    page: PageOptions | None,
    *,
    rerun: bool = False,
) -> None:
    """Follow the cables through an input, write all outputs, and end with the summary and the exit code."""
    from dloftbs.cli.outputs import open_all_pictures, open_outputs
    from dloftbs.cli.progress import open_progress
    from dloftbs.pipeline import Pipeline
    from dloftbs.sinks import RerunViewerSink

    config, report = run.options.config, run.report
    try:
        with ExitStack() as stack:
            stack.enter_context(run)
            # Another pipeline, since what is drawn is drawn in another thread.
            drawn = open_all_pictures(outputs.pictures, Pipeline(config), fps=run.video_fps, answers=answers)
            live = [RerunViewerSink()] if rerun else []
            sink = open_outputs(
                outputs.data,
                *drawn,
                *live,
                with_input=run.options.keep_messages,
                pose=run.options.inputs.pose,
                answers=answers,
                config=config,
                config_file=outputs.config_file,
            )
            stack.enter_context(sink)
            progress = stack.enter_context(open_progress(shares_terminal=prints_to_terminal(outputs.data)))
            stop = stack.enter_context(interrupted())
            show = None if page is None else _open_page(stack, run.source, config, page, stop)

            def write(frame: Frame, result: FrameResult) -> None:
                answers.warn(result)
                sink.write(frame, result)
                if show is not None:
                    show(frame, result)

            run.follow(write, shown=progress.tick, stop=stop)
    finally:
        if report.frames:
            click.echo(report.summary(), err=True)
    run.check_frames()
    answers.check_compared()
    if report.skipped and not run.source.live:  # a camera now and then has a frame that cannot be decoded
        context.exit(BAD_INPUT)


def _open_page(
    stack: ExitStack, source: Source, config: Config, page: PageOptions, stop: Callable[[], bool]
) -> Callable[[Frame, FrameResult], None]:
    """Serve a page until the stack is closed; of a recording nothing is tracked before somebody looks."""
    from dloftbs.ui.view_session import ViewFeed

    feed = ViewFeed(source.name, length=source.length, live=source.live, objects=config.linking.objects)
    stack.enter_context(served(feed, page))
    stack.callback(feed.finish)
    if not source.live:
        click.echo("waiting until the page is open", err=True)
        while not feed.visited.wait(LOOK_EVERY_S) and not stop():
            pass
    return feed.publish
