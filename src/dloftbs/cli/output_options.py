"""Options that say what is written, and where."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import click

from dloftbs.cli.limits import FilledPath
from dloftbs.errors import InputError

STANDARD_OUTPUT = "-"
_Named = TypeVar("_Named", str, Path, None)
DATA_SUFFIXES = (
    *(".jsonl", ".ndjson", ".npz", ".csv", ".ply", ".obj", ".usda", ".xml", ".json", ".labelme", ".mcap", ".rrd"),
)


def check_png(context: click.Context, parameter: click.Parameter, path: _Named) -> _Named:
    """Let only the name of a picture without loss pass.

    Raises
    ------
    click.BadParameter
        On any other.
    """
    if path is not None and Path(path).suffix.lower() != ".png":
        raise click.BadParameter(f"must end in .png, got {str(path)!r}", context, parameter)
    return path


def check_data_paths(context: click.Context, parameter: click.Parameter, paths: tuple[str, ...]) -> tuple[str, ...]:
    """Let only names pass that say in which form data are to be written.

    Raises
    ------
    click.BadParameter
        On any other.
    """
    for path in paths:
        if path != STANDARD_OUTPUT and not path.endswith("/") and Path(path).suffix.lower() not in DATA_SUFFIXES:
            expected = f"must end in {', '.join(DATA_SUFFIXES)}, or in / for the folder of a rosbag2"
            raise click.BadParameter(f"{expected}, got {path!r}", context, parameter)
    return paths


def check_pictures(*, video: bool) -> Callable[[click.Context, click.Parameter, str | None], str | None]:
    """Return what lets only the name of a folder or a picture pass, and where `video` says so that of a video."""

    def check(context: click.Context, parameter: click.Parameter, path: str | None) -> str | None:
        if path is None:
            return None
        from dloftbs import sinks

        wanted = (sinks.OverlayImagesSink, sinks.OverlayPictureSink) + (sinks.OverlayVideoSink,) * video
        try:
            kind = sinks.kind_of(path)
        except InputError as error:
            raise click.BadParameter(str(error), context, parameter) from error
        if kind not in wanted or (kind is sinks.OverlayImagesSink and os.path.isfile(path)):
            what = f"a folder, a picture (.png, ...){' or a video (.mp4, .mov)' * video}"
            raise click.BadParameter(f"must be {what}, got {path!r}", context, parameter)
        return path

    return check


def prints_to_terminal(outs: Sequence[str]) -> bool:
    """Return True if results are printed where a person reads them."""
    return STANDARD_OUTPUT in outs and sys.stdout.isatty()


stages_option = click.option(
    "--stages",
    type=FilledPath(),
    metavar="FOLDER|PNG",
    callback=check_pictures(video=False),
    help="Draw a figure of all stages per frame: into a folder, or into a file for a single frame. It shows "
    "where a mask or a curve goes wrong.",
)
with_input_option = click.option(
    "--with-input",
    is_flag=True,
    help="Write the input into ROS recordings, too. From a ROS 2 recording, all messages are copied; "
    "from other inputs, images, depth and camera.",
)
out_option = click.option(
    "--out",
    "-o",
    "outs",
    multiple=True,
    type=FilledPath(),
    metavar="FILE",
    callback=check_data_paths,
    help="Write curves; the suffix names the format. Curves: .jsonl, .npz, .csv. Meshes in metres: .ply, .obj. "
    "Simulators: .usda (USD), .xml (MuJoCo). Training labels: .json (COCO masks), a folder .labelme (lines). "
    "Viewers: .rrd (Rerun), .mcap or a folder ending in / (ROS 2 recording). - prints JSON lines. Repeatable. "
    "NAME.config.yaml beside the first file keeps the settings.",
)
