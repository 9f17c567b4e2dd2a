"""The frames of a source that the pipeline can work on."""

from __future__ import annotations

import logging
from collections.abc import Iterator

from dloftbs.cli.options import InputOptions
from dloftbs.cli.shell import Failure
from dloftbs.config import Config
from dloftbs.frame import Frame
from dloftbs.sources import Source

_log = logging.getLogger("dloftbs.cli")

NO_COLOUR = (
    "{name} is a colour image, and nothing says what in it is cable: "
    "give its colour, e.g. --hsv 170:10,80:255,60:255 for red (hue 0..179, saturation and value 0..255), "
    "or masks with --masks, or, if the image is a mask itself, --kind mask"
)


class UsableFrames:
    """Iterates over a source, and leaves out frames that have neither a mask nor a colour to make one from.

    Parameters
    ----------
    source : Source
    config : Config
    inputs : InputOptions

    Raises
    ------
    Failure
        While iterating, if there is a colour image and no option says how to make a mask of it.
    """

    def __init__(self, source: Source, config: Config, inputs: InputOptions) -> None:
        self._source = source
        self._has_colour = bool(config.segmentation.hsv)
        self._has_masks = inputs.masks is not None
        self._without_mask = 0

    @property
    def skipped(self) -> int:
        """Frames left out so far, the ones that the source could not read included."""
        return self._source.skipped + self._without_mask

    def __iter__(self) -> Iterator[Frame]:
        for frame in self._source:
            if frame.mask is not None or self._has_colour:
                yield frame
            elif self._has_masks:
                self._without_mask += 1
                _log.warning("skipped frame %d (%s): it has no mask, and there is no --hsv", frame.index, frame.name)
            else:
                raise Failure(NO_COLOUR.format(name=frame.name))
