"""``dloftbs view``: curves live over their video, on a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from dloftbs.cli.config_options import config_options
from dloftbs.cli.help_sections import SectionedCommand
from dloftbs.cli.input_options import InputOptions, every_option, input_options
from dloftbs.cli.limits import FilledPath
from dloftbs.cli.page import LOOK_EVERY_S, PageOptions, check_colour, page_options, require_page, served
from dloftbs.cli.shell import interrupted

if TYPE_CHECKING:
    from dloftbs.config import Config


@click.command(cls=SectionedCommand, short_help="Show the curves live in a browser.")
@click.argument("where", metavar="INPUT...", nargs=-1, required=True, type=FilledPath())
@every_option
@input_options
@config_options
@page_options
def view(where: tuple[str, ...], every: int, inputs: InputOptions, config: Config, page: PageOptions) -> None:
    """Serve a page with the curves over the video, as they are tracked.

    INPUT is what `dloftbs track` takes. A recording waits until the page is open, and plays at its own pace. A
    camera shows its newest frame. You can pause, step and loop, and with depth turn the curves in space.

    \b
    dloftbs view cable.mp4 --config cable.yaml
    dloftbs view 0 --hsv 170:10
    """
    require_page()
    from dloftbs.cli.frames import UsableFrames, in_natural_order
    from dloftbs.ui.view_session import ViewSession

    named = where[0] if len(where) == 1 else in_natural_order(where, inputs)
    cable = config.segmentation
    with inputs.open(named, segmented=cable.needs_image, mask_is=cable.mask_is) as source:
        check_colour(source, config, inputs, where)
        session = ViewSession(
            UsableFrames(source, config, inputs, where, every),
            config,
            source.name,
            length=source.length,
            live=source.live or (source.single_pass and source.length is None),
            once=source.single_pass,
            fps=source.fps and source.fps / every,
        )
        with served(session, page), interrupted() as stop:
            while session.wait(LOOK_EVERY_S) and not stop():
                pass
