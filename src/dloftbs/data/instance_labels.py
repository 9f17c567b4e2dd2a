"""Masks of single objects, as segmenters give them, and the label image that they make."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from dloftbs.data.run_lengths import decode
from dloftbs.errors import InputError
from dloftbs.support.array_likes import as_pixels, is_array_like
from dloftbs.support.arrays import AnyArray, plane_of
from dloftbs.support.mask_values import without_border
from dloftbs.support.values import check_size, shown

Labels = npt.NDArray[np.uint16]
Size = tuple[int, int]

MAX_LABEL = 65535
"""Largest number of an object.

Source: by definition, of 16 bits, as label images are stored.
"""
_SEGMENTATION = "segmentation"
"""Key of a mask in the dictionaries of SAM and COCO.

Source: the formats.
"""
_SHAPES = "a label image (H, W), a stack (N, H, W), a list of masks (H, W) or of SAM's dictionaries"


class HasMasks(Protocol):
    """A segmenter's result that holds its masks (N, H, W), as `supervision.Detections` does."""

    @property
    def mask(self) -> Any:
        """The masks; None where there are none."""


Instances = npt.ArrayLike | Sequence[npt.ArrayLike] | Sequence[Mapping[str, Any]] | HasMasks
"""Forms of a mask per object that `as_labels` takes."""


def as_labels(given: object, size: Size | None = None) -> Labels:
    """Return the label image of a mask per object.

    Parameters
    ----------
    given : label image, stack, sequence of masks or of dictionaries, or an object with `mask`
        A label image (H, W) of integers keeps its numbers; 255 beside numbers up to 32 is a border, and ground. In a
        stack (N, H, W), or a list of masks (H, W), of bool or integers, any non-zero is the object. Dictionaries are
        SAM's: ``"segmentation"`` is a mask, or its run lengths (see `run_lengths.decode`). An object is asked for its
        `mask`, a stack.
    size : (int, int), optional
        ``(H, W)`` of the frame.

    Returns
    -------
    numpy.ndarray, shape (H, W), uint16
        0 is ground, k + 1 the object k. Where masks overlap, smaller ones lie on top of larger ones; of equal ones the
        later.

    Raises
    ------
    InputError
        If it is something else, types are wrong, sizes differ, numbers are negative or beyond 65535, or nothing says
        the size.
    """
    if isinstance(given, Mapping):
        raise InputError(f"instances must be {_SHAPES}, got {shown(given)}; put one dictionary into a list")
    if not is_array_like(given) and not isinstance(given, (list, tuple)):
        if not hasattr(given, "mask"):
            raise InputError(f"instances must be {_SHAPES}, got {shown(given)}")
        return _of_result(given, size)
    if isinstance(given, (list, tuple)) and not _is_nested(given):
        return paint((_mask_of(f"instances[{k}]", one, size) for k, one in enumerate(given)), size)
    array = as_pixels("instances", given, "one")
    if array.ndim == 4 and 1 in array.shape:  # (N, 1, H, W) as of networks, (1, N, H, W), (N, H, W, 1)
        array = array.squeeze(next(axis for axis in (1, 0, 3, 2) if array.shape[axis] == 1))
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[:, :, 0]
    if array.ndim == 2:
        return without_border(_checked(array, size))
    if array.ndim != 3:
        raise InputError(f"instances must be {_SHAPES}, got {array.shape} of {array.dtype}")
    if array.shape[2] in (3, 4) and array.dtype == np.uint8:
        raise InputError(f"instances must be {_SHAPES}, got a picture in colour, {array.shape} of {array.dtype}")
    if size not in (None, array.shape[1:]) and array.shape[:2] == size:
        raise InputError(f"instances must be (N, H, W), got {array.shape}; masks come first: x.transpose(2, 0, 1)")
    return paint((check_kind("instances", mask) for mask in array), size or (array.shape[1], array.shape[2]))


def paint(masks: Iterable[AnyArray], size: Size | None = None) -> Labels:
    """Return the label image of masks (H, W) of bool or integers: 0 is ground, k + 1 the mask k.

    Smaller masks lie on top of larger ones. Each mask is let go of but for its bounding box before the next comes.

    Raises
    ------
    InputError
        If their sizes differ, from each other or from `size`, there are more than 65535, or nothing says the size.
    """
    pieces: list[tuple[int, int, tuple[slice, slice], AnyArray]] = []
    for number, mask in enumerate(masks, 1):
        if number > MAX_LABEL:
            raise InputError(f"there may be at most {MAX_LABEL} instances")
        size = _same_size(f"instances[{number - 1}]", mask, size)
        pixels = mask != 0
        box = _extent(pixels.any(axis=1)), _extent(pixels.any(axis=0))
        crop = pixels[box].copy()
        pieces.append((int(np.count_nonzero(crop)), number, box, crop))
    if size is None:
        raise InputError(
            "instances are an empty list, of which nothing says the size; give the image beside, or zeros (H, W)"
        )
    labels = np.zeros(size, np.uint16)
    for _, number, box, crop in sorted(pieces, key=lambda piece: (-piece[0], piece[1])):
        labels[box][crop] = number
    return labels


def _extent(is_set: npt.NDArray[np.bool_]) -> slice:
    """Return the slice from the first to the last element that is set."""
    found = np.flatnonzero(is_set)
    return slice(int(found[0]), int(found[-1]) + 1) if found.size else slice(0)


def are_masks_of_objects(value: object) -> bool:
    """Return True for what can only be masks of single objects: SAM's dictionaries, or an object with a stack."""
    if isinstance(value, (list, tuple)):
        return bool(value) and all(isinstance(one, Mapping) and _SEGMENTATION in one for one in value)
    return not is_array_like(value) and getattr(getattr(value, "mask", None), "ndim", 0) == 3


def _of_result(given: Any, size: Size | None) -> Labels:
    if given.mask is not None:
        if not is_array_like(given.mask):
            raise InputError(f"the mask of {type(given).__name__} must be a stack (N, H, W), got {shown(given.mask)}")
        return as_labels(given.mask, size)
    if hasattr(given, "__len__") and not len(given):
        return paint((), size)
    raise InputError(f"this {type(given).__name__} has no masks (mask is None); a detector of boxes gives none")


def _is_nested(given: Sequence[object]) -> bool:
    """Return True for rows of numbers, a label image that is a list."""
    first = given[0] if given else None
    return isinstance(first, (list, tuple)) and not (first and isinstance(first[0], (list, tuple)))


def _mask_of(name: str, one: object, size: Size | None) -> AnyArray:
    """Return one object's mask (H, W)."""
    if isinstance(one, Mapping):
        if _SEGMENTATION not in one and "counts" not in one:
            raise InputError(f"{name} must have the key {_SEGMENTATION!r}, as SAM's do, got {shown(one)}")
        name, one = f"{name}[{_SEGMENTATION!r}]", one.get(_SEGMENTATION, one)
        if isinstance(one, list):
            raise InputError(f"{name} is a polygon; masks and run lengths are taken, and polygons in a file of COCO")
    if isinstance(one, Mapping):
        if size is not None and "size" in one:  # before pixels are made
            _check_same(name, check_size("size", one["size"], least=0), size)
        return decode(one)
    plane = plane_of(as_pixels(name, one, "one"))
    if plane.ndim != 2:
        raise InputError(f"{name} must be a mask (H, W), got {plane.shape}")
    return check_kind(name, plane)


def check_kind(name: str, mask: AnyArray) -> AnyArray:
    """Return an object's mask, or a label image, as it is, if it is bool or integer.

    Raises
    ------
    InputError
        If it is of another type, such as scores.
    """
    if mask.dtype.kind not in "biu":
        remedy = "; threshold it first: x > 0.5" if mask.dtype.kind == "f" else ""
        raise InputError(f"{name} must be bool or integer, got {mask.dtype}{remedy}")
    return mask


def _checked(labels: AnyArray, size: Size | None) -> Labels:
    """Return a label image of 16 bits, the same array where it is one."""
    check_kind("instances", labels)
    _same_size("instances", labels, size)
    if labels.dtype.kind == "i" and labels.size and labels.min() < 0:
        raise InputError(f"instances must be at least 0, the ground, got {labels.min()}; add 1 where -1 is the ground")
    if labels.dtype.itemsize > 2 and labels.size and labels.max() > MAX_LABEL:
        raise InputError(f"instances must be at most {MAX_LABEL}, got {labels.max()}; number them anew")
    return labels.astype(np.uint16, copy=False)


def _same_size(name: str, mask: AnyArray, size: Size | None) -> Size:
    found = int(mask.shape[0]), int(mask.shape[1])
    if size is not None:
        _check_same(name, found, size)
    return found


def _check_same(name: str, found: Size, size: Size) -> None:
    if found != size:
        raise InputError(f"{name} must have the size {size} (rows, columns) of the frame and the others, got {found}")
