"""Options that ask for more than the curves: bends below a radius, topology, shape and deviations."""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dloftbs.cli.config_options import Command
from dloftbs.cli.output_options import STANDARD_OUTPUT
from dloftbs.cli.reasons import Reasons
from dloftbs.errors import InputError

if TYPE_CHECKING:
    from dloftbs.data.answers import BendLimit
    from dloftbs.data.frame import Frame
    from dloftbs.data.frame_result import FrameResult
    from dloftbs.viz.shapes import Picture

logger = logging.getLogger("dloftbs.cli")
_LINES = (".jsonl", ".ndjson")


@dataclass
class Answers:
    """Answers that a command was asked for: names, and the least radius of bends."""

    kinds: tuple[str, ...] = ()
    limit: BendLimit | None = None
    _unknown: Reasons = field(default_factory=Reasons, init=False)
    _compared: int = field(default=0, init=False)

    def check(self, outs: Sequence[str]) -> None:
        """Raise a usage error if nothing is written that could hold the answers."""
        if self.kinds and not any(out == STANDARD_OUTPUT or Path(out).suffix.lower() in _LINES for out in outs):
            raise click.UsageError("--with goes with JSON lines: --out NAME.jsonl or --out -")

    def warn(self, result: FrameResult) -> None:
        """Warn of each object of a frame that bends more than it may, and once for each reason why that is unknown."""
        if self.limit is None:
            return
        for line in self.limit.violations(result):
            logger.warning("frame %d: %s", result.index, line)
        unknown = self.limit.unknown(result)
        self._compared += len(result.tracks or result.detections) - len(unknown)
        for name, reason in unknown.items():
            if self._unknown.add(reason):
                text = "frame %d: the bend of %s cannot be compared with %s: %s; later frames like this are not named"
                logger.warning(text, result.index, name, self.limit, reason)

    def check_compared(self) -> None:
        """Refuse a run in which objects were found, but no bend could be compared with the limit.

        Raises
        ------
        InputError
            If that is so.
        """
        if self._unknown.total and not self._compared:
            raise InputError(
                f"no bend could be compared with the least radius {self.limit}, which is in metres: "
                f"{next(iter(self._unknown.counts()))}; give depth and a camera, or a radius in pixels, such as 40px"
            )

    @property
    def draw(self) -> Callable[[Frame, FrameResult], Picture] | None:
        """Function that draws overlays with the answers in them; None where there are none to draw."""
        if self.limit is None and "std" not in self.kinds:
            return None
        return self._draw

    def _draw(self, frame: Frame, result: FrameResult) -> Picture:
        from dloftbs import viz
        from dloftbs.viz.answer_marks import mark_bends, mark_deviations

        picture = viz.draw(frame, result)
        if "std" in self.kinds:
            mark_deviations(picture, result)
        if self.limit is not None:
            mark_bends(picture, result, self.limit)
        return picture


NO_ANSWERS = Answers()


def answer_options(command: Command) -> Command:
    """Add ``--with`` and ``--min-bend-radius``; the command gets them as `answers`, an `Answers`."""

    @click.option(
        "--with",
        "answer_kinds",
        metavar="topology,shape,std",
        callback=_parse_kinds,
        help="Add answers to JSON lines, separated by commas: knots and crossings (topology), tightest bend and length "
        "(shape), standard deviation along each curve (std). Overlays draw the deviation as a band.",
    )
    @click.option(
        "--min-bend-radius",
        "bend_limit",
        metavar="METRES|Npx",
        callback=_parse_limit,
        help="Warn where a cable bends more tightly: in metres (needs depth), or in pixels such as 40px. "
        "Overlays show the place; a .csv has the radii, and a ROS recording the warnings.",
    )
    @functools.wraps(command)
    def with_answers(*args: Any, answer_kinds: tuple[str, ...], bend_limit: BendLimit | None, **kwargs: Any) -> None:
        command(*args, answers=Answers(answer_kinds, bend_limit), **kwargs)

    return with_answers


def _parse_kinds(context: click.Context, parameter: click.Parameter, text: str | None) -> tuple[str, ...]:
    if text is None:
        return ()
    from dloftbs.data.answers import check_kinds

    try:
        return check_kinds([kind.strip() for kind in text.split(",")])
    except InputError as error:
        raise click.BadParameter(str(error), context, parameter) from error


def _parse_limit(context: click.Context, parameter: click.Parameter, text: str | None) -> BendLimit | None:
    if text is None:
        return None
    from dloftbs.data.answers import BendLimit

    try:
        return BendLimit.parse(text)
    except InputError as error:
        raise click.BadParameter(str(error), context, parameter) from error
