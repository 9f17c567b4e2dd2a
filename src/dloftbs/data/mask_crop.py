"""The part of the mask that holds the objects, cut out in a canonical orientation, and its skeleton.

A skeleton depends on the order in which the sides are peeled, and greedy choices depend on the order in which equal
candidates come. To make the result move along when a mask is transposed, flipped or rotated by 90 degrees, everything
from the skeleton to the order of the segments is decided in an orientation that is chosen from the mask itself, so that
all eight versions of a mask become one and the same problem. No pixel is moved for this: the orientation is a view with
other strides.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from dloftbs.support.arrays import FloatArray

_Scalar = TypeVar("_Scalar", bound=np.generic)


@dataclass(frozen=True)
class Orientation:
    """One of the eight symmetries of the square: flip the columns, flip the rows, then transpose."""

    flip_x: bool
    flip_y: bool
    transpose: bool

    def view(self, array: npt.NDArray[_Scalar]) -> npt.NDArray[_Scalar]:
        """Return the array in this orientation, as a view."""
        turned = array[:: -1 if self.flip_y else 1, :: -1 if self.flip_x else 1]
        return turned.T if self.transpose else turned


@dataclass(frozen=True, eq=False)
class MaskCrop:
    """A cleaned, non-empty mask, cut to its bounding box with an empty margin of one pixel.

    Made by the cleaning stage; nothing is checked. Points and arrays in the orientation of the crop are "oriented".

    Parameters
    ----------
    pixels : numpy.ndarray, shape (h + 2, stride), uint8
        0 and 1, C-contiguous, with a stride that is a multiple of 8; column and row 1 hold the box's first pixels.
    bitmask : numpy.ndarray, shape (n, R), uint64
        The same, 64 pixels a word, see `dloftbs.kernels.bitmask.frame`.
    size : (int, int)
        ``(h, w)`` of the bounding box.
    origin : (int, int)
        ``(x, y)`` in the image of the box's top left pixel.
    orientation : Orientation
    image_size : (int, int)
        ``(H, W)`` of the image.
    outline : numpy.ndarray, shape (n, 2), optional
        Corners of the polygon that alone is seen of the image, whose edges act as its border.
    """

    pixels: npt.NDArray[np.uint8]
    bitmask: npt.NDArray[np.uint64]
    size: tuple[int, int]
    origin: tuple[int, int]
    orientation: Orientation
    image_size: tuple[int, int]
    outline: FloatArray | None = None

    def oriented(self, pixels: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
        """Return a view of an array of the shape of `pixels`: oriented, cut to the box and its margin."""
        h, w = self.size
        return self.orientation.view(pixels[: h + 2, : w + 2])

    @cached_property
    def image_transform(self) -> tuple[FloatArray, FloatArray]:
        """Matrix (2, 2) and offset (2,) that turn an oriented ``(x, y)`` into the image's: ``matrix @ p + offset``."""
        (h, w), (x0, y0) = self.size, self.origin
        sign_x, sign_y = (-1.0 if self.orientation.flip_x else 1.0), (-1.0 if self.orientation.flip_y else 1.0)
        matrix = [[0.0, sign_x], [sign_y, 0.0]] if self.orientation.transpose else [[sign_x, 0.0], [0.0, sign_y]]
        offset_x = x0 + w if self.orientation.flip_x else x0 - 1
        offset_y = y0 + h if self.orientation.flip_y else y0 - 1
        return np.array(matrix), np.array([offset_x, offset_y], dtype=np.float64)

    def to_image(self, points: FloatArray) -> FloatArray:
        """Turn oriented points ``(x, y)`` into the image's, shape (n, 2)."""
        matrix, offset = self.image_transform
        return points @ matrix.T + offset

    def to_oriented(self, points: FloatArray) -> FloatArray:
        """Turn the image's points ``(x, y)`` into oriented ones, shape (n, 2)."""
        matrix, offset = self.image_transform
        return (points - offset) @ matrix  # the inverse of a signed permutation is its transpose


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The skeleton of a crop, in its orientation.

    Parameters
    ----------
    grid : numpy.ndarray, shape (H, W), uint8
        0 and 1, the outermost rows and columns 0.
    pixels_rc : numpy.ndarray, shape (n, 2), int32
        Its foreground, ascending.
    degrees : numpy.ndarray, shape (n,), uint8
        The number of neighbours of each.
    """

    grid: npt.NDArray[np.uint8]
    pixels_rc: npt.NDArray[np.int32]
    degrees: npt.NDArray[np.uint8]

    @property
    def is_endpoint(self) -> npt.NDArray[np.bool_]:
        """Mask of the pixels that have one neighbour."""
        return self.degrees == 1

    @property
    def is_branch_point(self) -> npt.NDArray[np.bool_]:
        """Mask of the pixels that have more than two neighbours."""
        return self.degrees > 2


def canonical_orientation(pixels: npt.NDArray[np.uint8], moments: tuple[int, ...]) -> Orientation:
    """Choose the orientation of a mask: all eight versions of a mask look the same in theirs.

    Moments of the border pixels about the middle of the box decide: the wider side becomes the columns, the heavier
    half the high coordinates. Where they do not distinguish the sides, the remaining orientations are compared pixel by
    pixel; those that are equal even then show the same mask, so any will do.

    Parameters
    ----------
    pixels : numpy.ndarray, shape (h, w), uint8
        The mask, cut to its bounding box.
    moments : tuple of int
        See `dloftbs.kernels.bitmask.frame`.
    """
    h, w = pixels.shape
    sx, sy, sxyy, syxx, sxxx, syyy, sxx, syy = moments
    odd_x = sx or sxyy or sxxx
    odd_y = sy or syxx or syyy
    wide = w - h or sxx - syy or abs(odd_x) - abs(odd_y)
    if odd_x and odd_y and wide:
        return Orientation(odd_x < 0, odd_y < 0, wide < 0)
    candidates = _orientations(odd_x, odd_y, wide)
    return max(candidates, key=lambda one: np.packbits(one.view(pixels)).tobytes())


def _orientations(odd_x: int, odd_y: int, wide: int) -> Iterator[Orientation]:
    """Yield the orientations that the signs of the moments leave open; 0 leaves both choices open."""
    choices = [(False, True) if sign == 0 else (sign < 0,) for sign in (odd_x, odd_y, wide)]
    for flip_x, flip_y, transpose in product(*choices):
        yield Orientation(flip_x, flip_y, transpose)
