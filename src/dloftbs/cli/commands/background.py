"""``dloftbs background``: a clip of a camera that stands still in, the place without cables out."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.input_options import limit_option
from dloftbs.cli.limits import FilledPath, file_path
from dloftbs.cli.output_options import check_png
from dloftbs.cli.shell import BAD_INPUT, interrupted

if TYPE_CHECKING:
    from dloftbs.data.frame import Frame


@click.command(short_help="Make a picture of the place without cables from a clip.")
@click.argument("where", metavar="INPUT...", nargs=-1, required=True, type=FilledPath())
@click.option(
    "--out", "-o", required=True, type=file_path(), metavar="PNG", callback=check_png, help="Picture to write."
)
@limit_option
@click.option("--topic", metavar="NAME", help="Topic of the images in a ROS recording; needed if there are several.")
@click.pass_context
def background(context: click.Context, where: tuple[str, ...], out: Path, limit: int | None, topic: str | None) -> None:
    """Make a picture of the place without cables, for --background of `detect` and `track`.

    INPUT is any input of `dloftbs track` from a camera that stands still. The picture is the median of up to 50
    frames, spread evenly over the input. A cable disappears where fewer than half of them show it. A cable that
    rests stays in the picture: then take a clip, or a photo, of the empty place. Ctrl-C ends a camera's stream, as
    --limit does; of a recording, nothing is written, and the exit code is 130.

    \b
    dloftbs background worms.mp4 --out empty.png
    dloftbs track worms.mp4 --background empty.png --overlay overlay.mp4
    dloftbs background 0 --limit 100 --out empty.png
    """
    from dloftbs import sources
    from dloftbs.cli.places import READING, InputFiles
    from dloftbs.segmentation import median_background
    from dloftbs.sinks.sink import identity_of
    from dloftbs.support.safe_files import check_writable, write_whole
    from dloftbs.viz import as_png

    replaced = InputFiles(where, dict.fromkeys(READING)).name_of(identity_of(str(out)))
    if replaced is not None:
        raise click.UsageError(f"--out {out} would replace the input {replaced}; choose another name")
    check_writable(out)
    used = 0

    def until_stopped(frames: Iterable[Frame], stop: Callable[[], bool]) -> Iterator[Frame]:
        nonlocal used
        for frame in islice(frames, limit):
            used += 1
            yield frame
            if stop():
                return

    named = where[0] if len(where) == 1 else where
    with sources.open(named, kind="image", topic=topic) as source, interrupted() as stop:
        picture = median_background(until_stopped(source, stop))
        if stop() and not (source.live or source.single_pass):  # the older picture is better than the median of a part
            raise KeyboardInterrupt
    write_whole(out, as_png(picture))
    click.echo(f"{out}: the background of {used} frame{'s' * (used != 1)}", err=True)
    topics = [] if topic is None else ["--topic", topic]
    follow = shlex.join(["dloftbs", "track", *where, *topics, "--background", str(out), "--overlay", "overlay.mp4"])
    click.echo(f"next: {follow}", err=True)
    if source.skipped and not source.live:
        context.exit(BAD_INPUT)
