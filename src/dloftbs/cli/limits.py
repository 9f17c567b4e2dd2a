"""The largest numbers that options take: beyond them a run does not end, or numbers do not fit."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import click

from dloftbs.errors import InputError
from dloftbs.support.values import check_path

MAX_FRAMES = 10**9
"""Of a stream; a year of video at 30 frames a second."""
MAX_DEMO_FRAMES = 10_000
"""Of the demo, which keeps the results of all its frames in memory."""
MAX_SIDE_PX = 4096
"""Of generated images, as wide as digital cinema; memory and time grow with the area."""
MAX_SCALE = 100.0
"""Times the frames of the paper's data sets: more than a million."""
MAX_OBJECTS = 10**9
"""As `linking.objects` takes them."""
MAX_JOBS = 256
"""Threads or processes; each holds frames."""
MAX_SEED = 2**63 - 1
MAX_TOLERANCE_PX = 1e5
"""Of a curve's distance, far beyond any image."""
MIN_DEPTH_UNIT_M, MAX_DEPTH_UNIT_M = 1e-9, 1e3
"""A count of depth, metres: sensors have 1e-5 to 1e-2."""


class FilledPath(click.Path):
    """The path of a file or a folder, with ``~`` for the home folder, which shells leave in ``--out=~/results``.

    An empty text, of a variable that is not set, would be the current folder.
    """

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path."""
        if value == "":
            self.fail("is empty; the current folder is .", param, ctx)
        try:
            check_path("it", value)
        except InputError as error:
            self.fail(str(error), param, ctx)
        return super().convert(os.path.expanduser(value), param, ctx)


def file_path(**options: Any) -> FilledPath:
    """Return the type of an option that is a `Path`."""
    return FilledPath(path_type=Path, **options)


def parse_size(context: click.Context, parameter: click.Parameter, text: str | None) -> tuple[int, int] | None:
    """Read a size such as ``1280x720`` and return it as ``(H, W)``; anything else is bad usage."""
    if text is None:
        return None
    match = re.fullmatch(r"([0-9]{1,9})[xX]([0-9]{1,9})", text)
    if match is None:
        raise click.BadParameter(f"expected a width and a height such as 1280x720, got {text!r}", context, parameter)
    width, height = int(match[1]), int(match[2])
    if max(width, height) > MAX_SIDE_PX:
        raise click.BadParameter(f"expected at most {MAX_SIDE_PX}x{MAX_SIDE_PX}, got {text!r}", context, parameter)
    return height, width
