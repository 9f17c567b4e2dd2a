"""``dloftbs stereo``: the streams of two cameras in, curves in metres with identities out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.answer_options import Answers, answer_options
from dloftbs.cli.commands.track import follow
from dloftbs.cli.config_options import config_options
from dloftbs.cli.help_sections import SectionedCommand
from dloftbs.cli.input_options import InputOptions, every_option, fps_option, input_options, limit_option
from dloftbs.cli.limits import FilledPath
from dloftbs.cli.output_options import STANDARD_OUTPUT, check_pictures, out_option, stages_option, with_input_option
from dloftbs.cli.page import PageOptions, page_options, require_page

if TYPE_CHECKING:
    from dloftbs.config import Config


@click.command(cls=SectionedCommand, short_help="Follow the cables through the streams of two cameras, in metres.")
@click.argument("where", metavar="LEFT [RIGHT]", nargs=-1, required=True, type=FilledPath())
@click.option(
    "--rig",
    "rig_files",
    multiple=True,
    required=True,
    type=FilledPath(),
    metavar="FILE",
    help="The cameras and their poses: our own YAML, Kalibr's camchain, OpenCV's stereoCalibrate (give both files), or "
    "two camera_info of ROS, left and right. Repeatable.",
)
@click.option("--rectified", is_flag=True, help="The images are rectified: use P of camera_info, without distortion.")
@click.option("--triggered", is_flag=True, help="The cameras expose at once, though their stamps differ.")
@click.option("--side-by-side", is_flag=True, help="LEFT shows both views side by side; there is no RIGHT.")
@click.option(
    "--right-topic", metavar="NAME", help="Topic of the right images, in RIGHT, or in LEFT if RIGHT is missing."
)
@click.option("--right-masks", type=FilledPath(), metavar="PATH", help="Masks of the right frames, as for --masks.")
@click.option("--right-mask-topic", metavar="NAME", help="Topic of the masks of the right images.")
@out_option
@click.option(
    "--overlay",
    type=FilledPath(),
    metavar="VIDEO|FOLDER|PNG",
    callback=check_pictures(video=True),
    help="Draw the curves over the left frames: .mp4, .mov, a folder of pictures, or a picture for a single frame.",
)
@stages_option
@with_input_option
@limit_option
@every_option
@fps_option
@click.option(
    "--view", is_flag=True, help="Show the left view's curves live on a page; a recording waits until it is open."
)
@answer_options
@input_options
@config_options
@page_options
@click.pass_context
def stereo(
    context: click.Context,
    where: tuple[str, ...],
    rig_files: tuple[str, ...],
    rectified: bool,
    triggered: bool,
    side_by_side: bool,
    right_topic: str | None,
    right_masks: str | None,
    right_mask_topic: str | None,
    outs: tuple[str, ...],
    overlay: str | None,
    stages: str | None,
    with_input: bool,
    limit: int | None,
    every: int,
    fps: float | None,
    view: bool,
    answers: Answers,
    inputs: InputOptions,
    config: Config,
    page: PageOptions,
) -> None:
    """Follow the cables through the streams of two cameras, in metres.

    LEFT and RIGHT are what `dloftbs track` takes: two videos, two folders, two cameras, or one ROS
    recording with --topic and --right-topic. With --side-by-side, LEFT shows both views side by side, as stereo
    cameras give them. Results are those of the left view, in the frame of its camera: curves in pixels, and
    in metres where both views show a cable. Input options and naming rules such as "{stem}_mask.png" apply to
    both views. Outputs, progress and exit codes are those of `dloftbs track`.

    \b
    dloftbs stereo left.mp4 right.mp4 --rig rig.yaml --hsv 170:10,80:255,60:255 --out curves.jsonl
    dloftbs stereo zed.mp4 --side-by-side --rig camchain.yaml --hsv red --overlay overlay.mp4
    dloftbs stereo run.mcap --topic /left/image_rect --right-topic /right/image_rect --rig left.yaml
    --rig right.yaml --rectified --hsv red --out curves.ply
    """
    from dloftbs.cli.followed_stream import StreamOptions
    from dloftbs.cli.outputs import is_recording
    from dloftbs.cli.places import InputFiles, plan_outputs
    from dloftbs.cli.stereo_run import StereoRun
    from dloftbs.stereo import CameraRig

    _check_where(where, side_by_side, right_topic, right_masks, right_mask_topic)
    for option, one_camera in (("--camera", inputs.camera), ("--info-topic", inputs.info_topic)):
        if one_camera is not None:
            raise click.UsageError(f"{option} is one camera; --rig has both")
    right = inputs if side_by_side else _of_right(inputs, where, right_topic, right_masks, right_mask_topic)
    if view:
        require_page()
    if not outs and overlay is None and stages is None and not view:
        outs = (STANDARD_OUTPUT,)
    if with_input and not any(is_recording(path) for path in outs):
        raise click.UsageError("--with-input goes with --out NAME.mcap or --out FOLDER/")
    answers.check(outs)
    rig = CameraRig.from_file(*map(Path, rig_files), rectified=rectified, triggered=triggered or None)
    beside = [path for path in (*rig_files, right_masks) if path is not None]
    files = InputFiles((*where, *beside), context.params)
    pictures = {"--overlay": overlay, "--stages": stages}
    outputs = plan_outputs(outs, pictures, files, config, is_one=limit == 1)
    options = StreamOptions(inputs, config, fps, every, limit, keep_messages=with_input)
    run = StereoRun((where[0], where[-1]), rig, options, right, side_by_side=side_by_side)
    follow(context, run, outputs, answers, page if view else None)


def _check_where(
    where: tuple[str, ...],
    side_by_side: bool,
    right_topic: str | None,
    right_masks: str | None,
    right_mask_topic: str | None,
) -> None:
    """Find out whether the command names two views.

    Raises
    ------
    click.UsageError
        If it does not.
    """
    if len(where) != 2 and not (len(where) == 1 and (side_by_side or right_topic is not None)):
        raise click.UsageError("name LEFT and RIGHT, or LEFT alone with --side-by-side or --right-topic")
    if side_by_side:
        rights = {"--right-topic": right_topic, "--right-masks": right_masks, "--right-mask-topic": right_mask_topic}
        given = [name for name, value in {"RIGHT": where[1:] or None, **rights}.items() if value is not None]
        if given:
            raise click.UsageError(f"--side-by-side has both views in one stream: leave out {' and '.join(given)}")


def _of_right(
    left: InputOptions, where: tuple[str, ...], topic: str | None, masks: str | None, mask_topic: str | None
) -> InputOptions:
    """Return the input options of the right view, whose own options are given: what is the left view's is not its.

    Raises
    ------
    click.UsageError
        If an option names what is the left view's alone.
    """
    from dloftbs.sources.naming_rules import is_rule

    for option, given, remedy in (
        ("--masks", left.masks if masks is None and mask_topic is None else None, "add --right-masks, or give"),
        ("--depth", left.depth, "give"),
        ("--instances", left.instances, "give"),
        ("--occluders", left.occluders, "give"),
    ):
        if given is not None and not is_rule(given):
            raise click.UsageError(
                f"{option} {given} goes with the left view alone: {remedy} a naming rule for both views, such as "
                '"{stem}_mask.png"'
            )
    shares_recording = where[0] == where[-1]  # else topics of one name are each view's own
    if shares_recording and left.mask_topic is not None and masks is None and mask_topic is None:
        raise click.UsageError(
            "--mask-topic goes with the left view alone: name that of the right with --right-mask-topic"
        )
    return replace(
        left,
        topic=topic or left.topic,
        masks=masks if masks is not None or mask_topic is not None else left.masks,
        mask_topic=mask_topic if mask_topic is not None or masks is not None else left.mask_topic,
        depth_topic=None if shares_recording else left.depth_topic,
    )
