"""``dloftbs tune``: strokes and sliders on a page say what in a source is cable."""

from __future__ import annotations

import functools
import shlex
from pathlib import Path
from time import sleep
from typing import TYPE_CHECKING

import click

from dloftbs.cli.config_options import config_options
from dloftbs.cli.help_sections import SectionedCommand
from dloftbs.cli.input_options import InputOptions, input_options
from dloftbs.cli.limits import FilledPath
from dloftbs.cli.page import (
    LOOK_EVERY_S,
    PageOptions,
    check_yaml_path,
    page_options,
    require_page,
    served,
    source_arguments,
)
from dloftbs.cli.shell import interrupted

if TYPE_CHECKING:
    from dloftbs.config import Config


@click.command(cls=SectionedCommand, short_help="Tune the segmentation in a browser.")
@click.argument("where", metavar="INPUT...", nargs=-1, required=True, type=FilledPath())
@click.option(
    "--out",
    "-o",
    type=FilledPath(),
    metavar="FILE",
    callback=check_yaml_path,
    help="YAML file that Save writes, for --config. If it exists, it is read first, and options change it. "
    "Default: the file of --config.",
)
@input_options
@functools.partial(config_options, beneath="out")
@page_options
@click.pass_context
def tune(
    context: click.Context,
    where: tuple[str, ...],
    out: str | None,
    inputs: InputOptions,
    config: Config,
    page: PageOptions,
) -> None:
    """Serve a page where strokes or sliders mark the cable.

    INPUT is what `dloftbs track` takes. The page shows picture, mask and curves while you draw, and the number of
    objects over the whole video. Save writes the settings that --config reads. The page can read and write nothing
    else. Only this machine can open it, unless --host opens it to others.

    \b
    dloftbs tune cable.mp4 --out cable.yaml
    dloftbs track cable.mp4 --config cable.yaml --overlay overlay.mp4
    """
    require_page()
    from dloftbs.cli.frames import in_natural_order
    from dloftbs.ui.frame_store import FrameStore
    from dloftbs.ui.tune_session import TuneSession

    target = Path(out) if out is not None else context.params.get("config_file")
    named = where[0] if len(where) == 1 else in_natural_order(where, inputs)
    source = inputs.open(named, segmented=True, mask_is=config.segmentation.mask_is)
    config_file = shlex.quote("cable.yaml" if target is None else str(target))
    verb, overlay = ("detect", "overlay.png") if source.length == 1 else ("track", "overlay.mp4")
    arguments = source_arguments(where, context)
    command = f"dloftbs {verb} {arguments} --config {config_file} --out curves.jsonl --overlay {overlay}"
    session = TuneSession(FrameStore(source), config, target, command)
    with served(session, page), interrupted() as stop:
        while not stop():
            sleep(LOOK_EVERY_S)
