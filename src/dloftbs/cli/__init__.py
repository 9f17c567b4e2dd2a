"""The command ``dloftbs``.

Exit codes: 0; 1 for bad input or a lost output, with a message on standard error; 2 for bad usage; 130 after Ctrl-C;
141, quietly, where the reader of standard output has gone. Results go to standard output or to files, messages to
standard error.

Only click and the package's errors are imported here: heavy modules load in the command that needs them, so that
``--help`` answers at once.
"""

from __future__ import annotations

from importlib.metadata import entry_points

import click

from dloftbs._version import __version__
from dloftbs.cli.commands.background import background
from dloftbs.cli.commands.batch import batch
from dloftbs.cli.commands.colour import colour
from dloftbs.cli.commands.config import config
from dloftbs.cli.commands.detect import detect
from dloftbs.cli.commands.diagnose import diagnose
from dloftbs.cli.commands.stereo import stereo
from dloftbs.cli.commands.track import track
from dloftbs.cli.commands.tune import tune
from dloftbs.cli.commands.view import view
from dloftbs.cli.commands.warmup import warmup
from dloftbs.cli.shell import Shell, messages_to_stderr

__all__ = ["main"]


COMMANDS = "dloftbs.commands"
"""Group of entry points by which commands of other packages join."""


@click.group(cls=Shell, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="dloftbs", message="%(prog)s %(version)s")
@click.pass_context
def main(context: click.Context) -> None:
    """Find and follow cables, ropes and hoses in images and video, as B-splines.

    \b
    dloftbs demo                                     # generate a video, track it, open demo/index.html
    dloftbs tune cable.mp4 --out cable.yaml          # draw along a cable, press Save
    dloftbs track cable.mp4 --config cable.yaml --out curves.csv --overlay overlay.mp4
    """
    context.with_resource(messages_to_stderr())


for command in (detect, track, stereo, batch, tune, view, diagnose, colour, background, config, warmup):
    main.add_command(command)
for point in entry_points(group=COMMANDS):
    main.add_command(point.load())
