"""Base of the generated sequences: numbered frames, one truth kept at a time, and small pickles."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Collection, Iterable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.synthetic.strand import Strand
from dloftbs_lab.synthetic.tube import footprint
from dloftbs_lab.truth import Truth

_NUMBERS = 20
"""Sequences of each family of a suite at scale 1."""
HD_WIDTH_PX = 12.0
"""Width of a cable in an image of 1280 x 720."""


class GeneratedSequence(KnownSequence):
    """A sequence whose frames are functions of a seed and their index.

    A subclass gives `_make_truth`, and `_make_frame` where it has more than a mask. It keeps expensive values in cached
    properties: pickles leave them out.

    Parameters
    ----------
    name : str
    frames : int
    size : (int, int)
        ``(H, W)`` px, at least 64 x 64.
    seed : int
        Not negative.
    fps : float, optional
        Gives the stamps ``index / fps``; without it there are none, as for images that have nothing to do with each
        other.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    def __init__(self, name: str, frames: int, size: tuple[int, int], seed: int, fps: float | None) -> None:
        if frames < 1 or seed < 0 or min(size) < 64:
            raise InputError(
                f"expected frames >= 1, seed >= 0 and a size of at least 64 x 64, got {frames}, {seed} and {size}"
            )
        if fps is not None and not 0.0 < fps < math.inf:
            raise InputError(f"fps must be positive, got {fps}")
        self.name = name
        self.length = self._frames = frames
        self.size = size
        self.seed = seed
        self.fps = self._rate = fps
        self._latest: tuple[int, Truth] | None = None

    def __getstate__(self) -> dict[str, Any]:
        kept = {k: v for k, v in self.__dict__.items() if not isinstance(getattr(type(self), k, None), cached_property)}
        return {**kept, "_latest": None}

    def frame(self, index: int) -> Frame:
        """Return one frame.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        self._check(index)
        return self._make_frame(index)

    def truth(self, index: int) -> Truth:
        """Return the truth of a frame.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        self._check(index)
        # A frame and its truth are asked for one after the other, and each needs the same drawing.
        latest = self._latest
        if latest is None or latest[0] != index:
            self._latest = latest = (index, self._make_truth(index))
        return latest[1]

    def _make_frame(self, index: int) -> Frame:
        """Return a frame that there is: with the mask of all cables, shape (H, W) bool, and no image."""
        return Frame(mask=self.truth(index).mask, **self._labels(index))

    @abstractmethod
    def _make_truth(self, index: int) -> Truth:
        """Return the truth of a frame that there is."""

    def _check(self, index: int) -> None:
        if not 0 <= index < self._frames:
            raise InputError(f"index must be in 0..{self._frames - 1}, got {index}")

    def _labels(self, index: int) -> dict[str, Any]:
        stamp = None if self._rate is None else index / self._rate
        return {"index": index, "stamp": stamp, "name": f"{self.name}#{index:04d}"}


class NumberedSequence(GeneratedSequence):
    """One of several generated sequences of a family; its number is a part of its name.

    Parameters
    ----------
    name : str
        Without the number.
    family : str
    key : tuple of int
        Tells what has random numbers of its own from the others, besides the number and the seed.
    number : int
        Not negative.
    frames, size, seed, fps
        As for `GeneratedSequence`.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    def __init__(
        self,
        name: str,
        family: str,
        key: tuple[int, ...],
        number: int,
        frames: int,
        size: tuple[int, int],
        seed: int,
        fps: float,
    ) -> None:
        if number < 0:
            raise InputError(f"number must not be negative, got {number}")
        super().__init__(f"{name}, {number}", frames, size, seed, fps)
        self.family = family
        self.number = number
        self._key = (seed, *key, number)

    def _rng(self, *purpose: int) -> np.random.Generator:
        return np.random.default_rng([*self._key, *purpose])


class MaskSequence(GeneratedSequence):
    """A generated sequence of perfect masks; a subclass sets `width_px` and gives the cables by `_strands`."""

    width_px: float

    def _make_truth(self, index: int) -> Truth:
        strands = self._strands(index)
        masks = visible_tubes(strands, [self.width_px] * len(strands), self.size)
        return Truth(tuple(strand.curve() for strand in strands), masks, tuple(range(len(strands))))

    @abstractmethod
    def _strands(self, index: int) -> tuple[Strand, ...]:
        """Return the cables of a frame, the lowest first."""


def truth_of(
    curves: Iterable[BSplineCurve], owner: npt.NDArray[np.integer[Any]], curves_3d: Iterable[BSplineCurve] = ()
) -> Truth:
    """Return the truth of cables by the number of the uppermost at each pixel, shape (H, W), negative for none."""
    curves = tuple(curves)
    numbers = tuple(range(len(curves)))
    return Truth(curves, tuple(owner == number for number in numbers), numbers, tuple(curves_3d))


def visible_tubes(
    strands: Sequence[Strand], widths_px: Sequence[float], size: tuple[int, int]
) -> tuple[npt.NDArray[np.bool_], ...]:
    """Return the visible part of each tube, shapes (H, W); a later one lies over an earlier one."""
    owner = np.full(size[0] * size[1], -1, np.int16)
    for number, (strand, width_px) in enumerate(zip(strands, widths_px, strict=True)):
        owner[footprint(strand, width_px / 2.0, size).pixel] = number
    return tuple((owner == number).reshape(size) for number in range(len(strands)))


def check_choice(name: str, value: str, choices: Collection[str]) -> None:
    """Let only one of the choices pass.

    Raises
    ------
    InputError
        On any other value.
    """
    if value not in choices:
        raise InputError(f"{name} must be one of {', '.join(map(repr, choices))}, got {value!r}")


def proportion(size: tuple[int, int]) -> float:
    """Return the pixels per pixel of a 1280 x 720 image."""
    return min(size[0] / 720.0, size[1] / 1280.0)


def width_at(size: tuple[int, int], width_px: float | None, widest_px: float) -> float:
    """Return the width of a cable in an image of `size`: the one given, or `HD_WIDTH_PX` in proportion.

    Parameters
    ----------
    size : (int, int)
        ``(H, W)`` px.
    width_px : float or None
    widest_px : float
        Largest width in an image of 1280 x 720, px.

    Raises
    ------
    InputError
        If the width is less than one pixel, or too large for the image.
    """
    width = HD_WIDTH_PX * proportion(size) if width_px is None else width_px
    widest = widest_px * proportion(size)
    if not 1.0 <= width <= widest:
        raise InputError(f"width_px must be in 1..{widest:g} here, got {width}")
    return width


def count_at(scale: float, full: int, least: int) -> int:
    """Return how many frames a sequence of `full` frames has at a scale.

    Raises
    ------
    InputError
        If the scale is not positive.
    """
    if not 0.0 < scale < math.inf:
        raise InputError(f"scale must be positive, got {scale}")
    return max(least, round(full * scale))


def numbers_at(scale: float) -> range:
    """Return the numbers of the sequences of a family at a scale: 20 at scale 1, and always one.

    Raises
    ------
    InputError
        If the scale is not positive.
    """
    return range(count_at(scale, _NUMBERS, 1))
