"""A stretch of a longer sequence, at the speed of the whole."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.truth import Truth


class Excerpt(KnownSequence):
    """Some frames of a sequence, one after the other, as a sequence of its own: frames count from 0, stamps stay.

    It has the other attributes of the sequence, too.

    Parameters
    ----------
    sequence : KnownSequence
    start : int
        Index of the first frame.
    frames : int

    Raises
    ------
    InputError
        If the sequence has no such frames.
    """

    def __init__(self, sequence: KnownSequence, start: int, frames: int) -> None:
        if not 0 <= start < start + frames <= len(sequence):
            raise InputError(
                f"expected some of the {len(sequence)} frames of {sequence.name}, got {frames} from {start} on"
            )
        self.name = sequence.name
        self.fps = sequence.fps
        self.length = frames
        self.tolerance_px = sequence.tolerance_px
        self.is_branched = sequence.is_branched
        self.folder = sequence.folder
        self._sequence = sequence
        self._start = start

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # a copy asks for some before it has a sequence
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return getattr(self._sequence, name)

    def frame(self, index: int) -> Frame:
        """Return one frame.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        return replace(self._sequence.frame(self._place(index)), index=index)

    def truth(self, index: int) -> Truth:
        """Return the truth of a frame.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        return self._sequence.truth(self._place(index))

    def _place(self, index: int) -> int:
        if not 0 <= index < len(self):
            raise InputError(f"index must be in 0..{len(self) - 1}, got {index}")
        return self._start + index
