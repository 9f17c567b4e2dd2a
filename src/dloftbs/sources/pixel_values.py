"""Files that hold a value for each pixel: masks, numbers of objects, depth."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dloftbs.errors import SourceError, source_errors
from dloftbs.sources.image_header import is_lossy
from dloftbs.sources.indexed_colour import is_indexed
from dloftbs.sources.pixels import (
    LOSSY_LABELS,
    as_mask,
    decode,
    first_of_many,
    load_npy,
    read_bytes,
    read_image_or_mask,
    read_indices,
)
from dloftbs.sources.source import logger
from dloftbs.support.arrays import AnyArray, holds_depth, plane_of


def read_labels(path: Path) -> AnyArray:
    """Read the numbers (H, W) of the objects: one channel of integers, or the indices of an indexed PNG.

    Raises
    ------
    SourceError
        If the file cannot be read or has several channels or other numbers, or went through a lossy codec.
    """
    with source_errors(path):
        data = read_bytes(path)
        if is_lossy(data):
            raise SourceError(LOSSY_LABELS)
        labels = read_indices(data) if is_indexed(data) else decode(data)
    if labels.ndim != 2 or not np.issubdtype(labels.dtype, np.integer):
        raise SourceError(
            f"{path}: labels must have one channel of integers, or be a PNG of indexed colour, "
            f"got {labels.shape} of {labels.dtype}"
        )
    return labels


def read_mask(path: Path, mask_is: str = "auto") -> AnyArray:
    """Read a mask (H, W), of which `mask_is` says what its values are, from an image file or a .npy file.

    Raises
    ------
    SourceError
        If the file cannot be read or is no mask.
    """
    if path.suffix.lower() != ".npy":
        _, mask = read_image_or_mask(path, "mask", mask_is)
        assert mask is not None  # what was asked for
        return mask
    with source_errors(path):
        return as_mask(load_npy(path))


def read_depth(path: Path) -> AnyArray:
    """Read a depth image (H, W) from a 16-bit or floating-point image file, or from a .npy file.

    Raises
    ------
    SourceError
        If the file cannot be read or is no depth.
    """
    if path.suffix.lower() != ".npy":
        with source_errors(path):
            data = read_bytes(path)
            depth = as_depth(decode(data))
        for remark in first_of_many(data):
            logger.warning("%s: %s", path, remark)
        return depth
    depth = plane_of(load_npy(path))
    with source_errors(path):
        return as_depth(depth)


def as_depth(pixels: AnyArray) -> AnyArray:
    """Return the pixels of a file that is depth (H, W).

    Raises
    ------
    SourceError
        If they have several channels, or 8 bits: a picture of depth is none.
    """
    if pixels.ndim != 2 or not holds_depth(pixels.dtype):
        raise SourceError(
            f"depth must have one channel of 16 bits or more or of floating point, got {pixels.shape} of {pixels.dtype}"
        )
    return pixels
