"""The frames of a source that the pipeline can work on."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.input_options import InputOptions
from dloftbs.cli.shell import Failure
from dloftbs.config import Config, read_roi
from dloftbs.data.frame import Frame
from dloftbs.data.frame_region import Region
from dloftbs.errors import InputError, SourceError
from dloftbs.sources import Source, naming_rules
from dloftbs.sources.image_files import IMAGE_EXTENSIONS, sorted_by_name
from dloftbs.sources.look_alikes import warn_of_labels

if TYPE_CHECKING:
    from dloftbs.ros.bag_file import RawMessage

_log = logging.getLogger("dloftbs.cli")

NO_COLOUR = (
    "{name} is a colour image, and nothing says what in it is cable: "
    "draw on the cable, then add --config cable.yaml:\n"
    "    {tune}\n"
    "or name its colour, e.g. --hsv red or --hsv 170:10,80:255,60:255, or give masks with --masks or --instances, "
    "or, if the image is a mask itself, --kind mask"
)


class UsableFrames:
    """Iterates over a source, and leaves out frames that lack what a mask is made from.

    A frame lacks a mask where there is no way to make one, and depth where masks are made from it and others have it. A
    region of interest must lie within it, and holds for frames of the first one's size. Messages of the recording that
    such a frame carries go with the next usable one.

    Parameters
    ----------
    source : Source
    config : Config
    inputs : InputOptions
    where : str or sequence of str
        Input as the command names it.
    every : int
        Only every so manieth frame is wanted, the first one included; all keep their indices.

    Raises
    ------
    Failure
        While iterating, if there is a colour image and no option says how to make a mask of it.
    """

    def __init__(
        self, source: Source, config: Config, inputs: InputOptions, where: str | Sequence[str], every: int = 1
    ) -> None:
        self._source = source
        self._tune = inputs.tune_command(where)
        self._every = every
        self._has_colour = config.segmentation.is_given
        self._asks_depth = config.segmentation.plane is not None
        self._had_depth = False
        self._has_masks = inputs.masks is not None or inputs.instances is not None
        self._roi = config.region.roi
        self._size: tuple[int, int] | None = None
        self._unusable = 0

    @property
    def skipped(self) -> int:
        """Frames left out so far, the ones that the source could not read included."""
        return self._source.skipped + self._unusable

    def __iter__(self) -> Iterator[Frame]:
        earlier: list[RawMessage] = []
        for frame in self._source:
            if frame.index % self._every:
                continue
            self._had_depth = self._had_depth or frame.depth is not None
            problem = self._problem(frame)
            if problem is not None:
                self._unusable += 1
                _log.warning("skipped frame %d (%s): %s", frame.index, frame.name, problem)
                earlier += _small_ones_of(frame)
                continue
            yield _with_recorded(frame, earlier) if earlier else frame
            earlier = []

    def _problem(self, frame: Frame) -> str | None:
        """Return why a frame is not usable; None if it is."""
        misfit = self._misfit(frame)
        if misfit is not None:
            return misfit
        if frame.mask is None and self._asks_depth and self._had_depth and frame.depth is None:
            return "it has no depth, which the plane needs"
        if frame.mask is not None or self._has_colour:
            return None
        if self._has_masks:
            return "it has no mask, and there is no --hsv"
        raise Failure(NO_COLOUR.format(name=frame.name, tune=self._tune))

    def _misfit(self, frame: Frame) -> str | None:
        """Return why the region of interest does not hold for a frame; None if it does."""
        if self._roi is None:
            return None
        self._size = self._size or frame.size
        if frame.size != self._size:
            return f"it has the size {frame.size}, and the region of interest holds for {self._size} (rows, columns)"
        try:
            Region(read_roi(self._roi), frame.size)
        except InputError as error:
            return str(error)
        return None


def _small_ones_of(frame: Frame) -> list[RawMessage]:
    """Return the messages that a frame carries but for images, which would fill the memory in a long stretch."""
    from dloftbs.ros import RosFrame  # late: it takes long to load
    from dloftbs.ros.topic_choice import IMAGE_TYPES

    recorded = frame.recorded if isinstance(frame, RosFrame) else None
    return [raw for raw in recorded or () if raw.channel is None or raw.channel.type_name not in IMAGE_TYPES]


def _with_recorded(frame: Frame, earlier: list[RawMessage]) -> Frame:
    """Return a frame that also carries messages of the frames before it."""
    from dloftbs.ros import RosFrame

    return replace(frame, recorded=(*earlier, *(frame.recorded or ()))) if isinstance(frame, RosFrame) else frame


def without_partners(where: Sequence[str], inputs: InputOptions) -> list[str]:
    """Return the inputs without those that go with another by a naming rule: shells put both into one glob.

    Raises
    ------
    SourceError
        If none is left.
    """
    files = [Path(text) for text in where if os.path.isfile(text)]
    kept = files
    for rule in inputs.rules:
        kept = naming_rules.without_partners(kept, rule)
    partners = set(files) - set(kept)
    images = [text for text in where if Path(text) not in partners]
    if not images:
        remedy = "; where there are no pictures, name the folder" if inputs.instances is not None else ""
        raise SourceError(f"every input is the partner of another under {' and '.join(inputs.rules)}{remedy}")
    warn_of_labels([path for path in kept if path not in partners], "the inputs")
    return images


def in_natural_order(where: Sequence[str], inputs: InputOptions) -> list[str]:
    """Return the files of a stream in their natural order, as a shell that expands a glob does not give them.

    Raises
    ------
    click.UsageError
        If one is no image, by its name.
    SourceError
        As `without_partners`.
    """
    for text in where:
        if Path(text).suffix.lower() not in IMAGE_EXTENSIONS:
            raise click.UsageError(f"several inputs of one stream must be image files; {text!r} is none")
    return [str(path) for path in sorted_by_name([Path(text) for text in without_partners(where, inputs)])]
