"""``dloftbs demo``: a generated video, tracked as a user would, and held against the truth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.limits import MAX_DEMO_FRAMES, MAX_SEED, file_path, parse_size
from dloftbs.cli.shell import Failure

if TYPE_CHECKING:
    from dloftbs_lab.synthetic import DemoSequence

_FULL = (96, (720, 1280))
_QUICK = (24, (360, 640))
_SEED = 3
"""Both cables are hidden and cross each other, and one crosses itself.

Source: chosen with the number of frames so that no frame is misread. Seeds 0 to 19 with 90 frames have 1 to 12 misread
frames each: where a gripper or the other cable lies over the place at which a cable crosses itself.
"""
_WIDTH_PX = 12.0  # at 720 rows
_SPACE_SHARE = 3  # so many times fewer frames in space


@click.command(short_help="Generate a demo video, track it and report the accuracy.")
@click.option("--out", "-o", type=file_path(), default="demo", show_default=True, metavar="FOLDER")
@click.option(
    "--frames", type=click.IntRange(2, MAX_DEMO_FRAMES), metavar="N", help=f"Length of the video. Default: {_FULL[0]}."
)
@click.option(
    "--seed",
    type=click.IntRange(0, MAX_SEED),
    default=_SEED,
    show_default=True,
    metavar="N",
    help="Number of the scene; each has another bench and another motion.",
)
@click.option("--size", metavar="WxH", callback=parse_size, help="Size of the video. Default: 1280x720.")
@click.option("--quick", is_flag=True, help=f"A small video: {_QUICK[0]} frames of 640x360.")
@click.option("--branched", is_flag=True, help="A wiring harness instead, tracked by its masks.")
@click.option(
    "--stereo", is_flag=True, help="One cable before two cameras instead: two videos, a rig, curves in metres."
)
@click.pass_context
def demo(
    context: click.Context,
    out: Path,
    frames: int | None,
    seed: int,
    size: tuple[int, int] | None,
    quick: bool,
    branched: bool,
    stereo: bool,
) -> None:
    """Generate a video of two cables, track each by its colour, and report the accuracy.

    The folder gets the video, the curves, an overlay video, a sheet of a dozen frames, the figures, and a README
    that names each file. A cable in space follows, with the noise of a depth camera: its curves in metres, and a
    figure. The page index.html shows all of it, and the commands to run next. Each colour is set to be one
    cable (linking.objects=1). The default scene was chosen. With other seeds, some frames are misread, mostly where a
    gripper covers the place at which a cable crosses itself.

    With --branched the folder gets a wiring harness instead: the video, its branches and branch points, an overlay
    video, and a README with the figures. With --stereo it gets one cable before two cameras: two videos, the rig,
    and curves in metres.
    """
    from dloftbs.cli.outputs import config_beside, write_config
    from dloftbs.config import Config, SegmentationConfig
    from dloftbs.support.safe_files import claim_folder
    from dloftbs_lab.commands.demo_files import (
        describe,
        figures_of,
        mark_as_demo,
        render,
        table,
        write_sheet,
        write_summary,
    )
    from dloftbs_lab.commands.demo_names import INDEX
    from dloftbs_lab.commands.demo_run import follow
    from dloftbs_lab.commands.demo_space import follow_in_space

    default_frames, default_size = _QUICK if quick else _FULL
    if branched and stereo:
        raise click.UsageError("--branched and --stereo are two demos: name one of them")
    if branched or stereo:
        click.echo(_other_demo(context, out, (frames or default_frames, size or default_size, seed), stereo=stereo))
        return
    sequence = _sequence(frames or default_frames, size or default_size, seed)
    configs = [
        Config(segmentation=SegmentationConfig(hsv=(colour,))).replace({"linking.objects": 1})
        for colour in sequence.hsv
    ]
    context.with_resource(claim_folder(out))
    mark_as_demo(out)
    click.echo(f"drawing {len(sequence)} frames into {out}", err=True)
    render(sequence, out)
    click.echo("tracking them by colour", err=True)
    run = follow(sequence, configs, out)
    for cable, config in enumerate(configs, start=1):
        write_config(config_beside([str(out / f"cable_{cable}")], config), config)
    write_sheet(run, out)
    click.echo("tracking a cable in space by colour and depth", err=True)
    space = follow_in_space(max(3, len(sequence) // _SPACE_SHARE), sequence.size, seed, out)
    rows = figures_of(run, space, sequence)
    write_summary(run, space, sequence, out)
    describe(rows, space, out)
    click.echo(table(rows))
    click.echo(f"open {out / INDEX} in a browser", err=True)


def _other_demo(context: click.Context, out: Path, scene: tuple[int, tuple[int, int], int], *, stereo: bool) -> str:
    """Run the demo with two cameras, or of a harness, on frames of a size by a seed, and return its figures."""
    from dloftbs.errors import InputError
    from dloftbs.support.safe_files import claim_folder
    from dloftbs_lab.commands import demo_branched, demo_stereo
    from dloftbs_lab.commands.demo_files import describe_files, mark_as_demo

    demo = demo_stereo if stereo else demo_branched
    context.with_resource(claim_folder(out))
    mark_as_demo(out, demo.WHAT)
    click.echo(f"drawing {demo.DRAWN} into {out}, and tracking it", err=True)
    try:
        figures = demo.follow(*scene, out)
    except InputError as error:
        raise Failure(f"no demo of this size and length: {error}") from error
    describe_files(demo.WHAT, figures, out)
    return figures


def _sequence(frames: int, size: tuple[int, int], seed: int) -> DemoSequence:
    from dloftbs.errors import InputError
    from dloftbs_lab.synthetic import DemoSequence

    width_px = max(_WIDTH_PX * min(size[0] / 720.0, size[1] / 1280.0), 3.0)
    try:
        return DemoSequence(frames=frames, size=size, seed=seed, width_px=width_px)
    except InputError as error:
        raise Failure(f"no demo of this size and length: {error}") from error
