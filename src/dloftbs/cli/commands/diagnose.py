"""``dloftbs diagnose``: a stream in, a page of text out that says what is wrong with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from dloftbs.cli.config_options import config_options
from dloftbs.cli.help_sections import SectionedCommand
from dloftbs.cli.input_options import InputOptions, every_option, fps_option, input_options
from dloftbs.cli.limits import MAX_FRAMES, FilledPath
from dloftbs.cli.output_options import check_pictures
from dloftbs.cli.shell import interrupted

if TYPE_CHECKING:
    from dloftbs.config import Config
    from dloftbs.data.frame import Frame
    from dloftbs.data.frame_result import FrameResult

_FRAMES = 50


@click.command(cls=SectionedCommand, short_help="Find out which stage fails first, with pictures.")
@click.argument("where", metavar="INPUT...", nargs=-1, required=True, type=FilledPath())
@click.option(
    "--stages",
    type=FilledPath(),
    metavar="FOLDER|PNG",
    callback=check_pictures(video=False),
    help="Draw all stages of the three worst frames: frames without a detection, or else the least certain.",
)
@click.option(
    "--limit",
    type=click.IntRange(1, MAX_FRAMES),
    metavar="N",
    default=_FRAMES,
    show_default=True,
    help="Stop after N used frames.",
)
@every_option
@fps_option
@input_options
@config_options
@click.pass_context
def diagnose(
    context: click.Context,
    where: tuple[str, ...],
    stages: str | None,
    limit: int,
    every: int,
    fps: float | None,
    inputs: InputOptions,
    config: Config,
) -> None:
    """Explain why too much, too little or the wrong thing is found.

    INPUT, and the options of inputs and settings, are those of `dloftbs track`. The command tracks the first frames and
    prints a page of text: the source, the mask, the objects found and dropped, the time of each stage, and what to
    change, the most frequent fault first. The exit code is 0, and 1 if the input cannot be read.

    \b
    dloftbs diagnose cable.mp4 --hsv 170:10,80:255,60:255
    dloftbs diagnose run.mcap --topic /camera/color/image_raw --hsv red --stages stages
    """
    from dloftbs.cli.diagnosis import Diagnosis
    from dloftbs.cli.followed_stream import StreamOptions
    from dloftbs.cli.frames import in_natural_order
    from dloftbs.cli.outputs import open_all_pictures
    from dloftbs.cli.places import InputFiles, plan_outputs
    from dloftbs.cli.progress import open_progress
    from dloftbs.cli.stream_run import StreamRun
    from dloftbs.pipeline import Pipeline

    outputs = plan_outputs((), {"--stages": stages}, InputFiles(where, context.params), config, is_one=limit == 1)
    run = StreamRun(
        where[0] if len(where) == 1 else in_natural_order(where, inputs),
        StreamOptions(inputs, config, fps, every, limit),
        in_turn=True,  # so that times are those of a core, and the mask is the frame's
    )
    diagnosis = Diagnosis(run.report, config.lifting)

    def add(frame: Frame, result: FrameResult) -> None:
        diagnosis.add(frame, run.mask, result)

    try:
        with run, open_progress(shares_terminal=False) as progress, interrupted() as stop:
            run.follow(add, shown=progress.tick, stop=stop)
    finally:
        if run.report.frames:
            click.echo(diagnosis.page(run.source))
    run.check_frames()
    for sink in open_all_pictures(outputs.pictures, Pipeline(config)):
        worst = diagnosis.worst()
        with sink:
            for frame, result in worst:
                sink.write(frame, result)
        click.echo(f"{stages}: the stages of {', '.join(f'frame {frame.index}' for frame, _ in worst)}", err=True)
