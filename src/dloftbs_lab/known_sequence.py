"""Sequences whose truth is known."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from pathlib import Path

from dloftbs.data.frame import Frame
from dloftbs.sources import Source
from dloftbs_lab.truth import Truth


class KnownSequence(Source):
    """A sequence whose frames can be had in any order, and whose truth is known.

    Every frame is a function of the arguments and its index alone, bit for bit. A sequence can be pickled, and making
    one costs little: the expensive work happens in `frame` and `truth`.

    A subclass sets the attributes of `Source`, `length` among them, and gives `frame` and `truth`.

    Attributes
    ----------
    tolerance_px : float or None
        The largest L3 of a curve that counts as right; None where it goes with the size of the image.
    scene_name : str or None
        Name of what is seen, the same for sequences that show the same motion under other noise; None where it is the
        sequence's own.
    folder : Path or None
        That frames and truth are read from; None where they are made.
    """

    folder: Path | None = None
    tolerance_px: float | None = None
    scene_name: str | None = None
    is_branched: bool = False

    def __len__(self) -> int:
        assert self.length is not None  # a known sequence has one
        return self.length

    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames from the first on."""
        self._begin()
        for index in range(len(self)):
            if self._closed:
                return
            yield self.frame(index)

    @abstractmethod
    def frame(self, index: int) -> Frame:
        """Return one frame.

        Raises
        ------
        InputError
            If there is no such frame.
        """

    @abstractmethod
    def truth(self, index: int) -> Truth:
        """Return the truth of a frame.

        Raises
        ------
        InputError
            If there is no such frame.
        """
