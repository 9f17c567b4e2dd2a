"""Mask to crop: morphology, holes, bounding box, orientation (paper: open and skeletonise)."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.cleaning.enlarged import LARGEST_STEP, smooth_steps
from dloftbs.cleaning.holes import fill_holes
from dloftbs.cleaning.kernels import morphology
from dloftbs.cleaning.kernels.enlargement import enlargement
from dloftbs.cleaning.kernels.narrow_ground import find_narrow_ground
from dloftbs.cleaning.slits import close_slits
from dloftbs.config import CleaningConfig
from dloftbs.data.frame_region import Region
from dloftbs.data.mask_crop import MaskCrop, canonical_orientation
from dloftbs.kernels.bitmask import cut, frame
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS

_WORD_BYTES = 8
_NOISE, _MAX_CHANGED = 32, 4096  # a mask of which a larger share and more pixels change is noise


def clean(
    mask: npt.NDArray[Any],
    config: CleaningConfig,
    region: Region | None = None,
    *,
    branched: bool = False,
    enlarged: bool = False,
) -> MaskCrop | None:
    """Close and open the mask by squares, and cut out the rest.

    The paper opens by a 3 x 3 square. What that takes may come back where it is as long as a thin cable, and no fringe
    of a thick one. Of what the closing adds stays what fills a hole or a notch, so that nothing that lies close
    together is joined. Larger holes are filled where they lie within one cable. As in OpenCV, what lies beyond the
    image counts as foreground to an erosion, so that a cable that leaves the image is not eaten from there.

    Parameters
    ----------
    mask : numpy.ndarray, shape (H, W), bool or integer
        Any non-zero is cable. Never changed.
    config : CleaningConfig
    region : Region, optional
        That the mask was cut to. The edges of its polygon act as the image's border: nothing is left outside of it.
    branched : bool
        Whether objects may branch: then slits between cables are those of a bundle, and closed, too.
    enlarged : bool
        Whether the mask may have been enlarged by repeating its pixels: the steps that this leaves are smoothed first.

    Returns
    -------
    MaskCrop or None
        None where nothing is left.
    """
    close, opening = config.close_px // 2, config.open_px // 2
    # A closing grows first, then looks as far again; so that only the image's own border acts as one.
    margin = opening + 2 * close
    polygon = None if region is None else region.inside
    grown = mask if polygon is None else _grown_beyond(mask, polygon, 2 * (opening + close))
    bitmask, inside, x0, y0, area = cut(_packed(grown), mask.shape[1], margin)
    step = enlargement(bitmask) if enlarged else 1
    if 1 < step <= LARGEST_STEP:
        bitmask, inside, x0, y0, area = cut(_packed(smooth_steps(grown, step)), mask.shape[1], margin)
    most = area // _NOISE + _MAX_CHANGED
    if close > 0 and len(bitmask):
        bitmask = morphology.close(bitmask, inside, close, most)
    if opening > 0 and len(bitmask):
        bitmask = morphology.open_up(bitmask, inside, opening, config.thin_px, most)
    if polygon is not None and len(bitmask):
        bitmask &= _window(_packed(polygon), x0, y0, bitmask.shape)
    pixels, framed, (left, top, h, w), moments = frame(bitmask)
    if len(pixels) == 0:
        return None
    orientation = canonical_orientation(pixels[1 : h + 1, 1 : w + 1], moments)
    x, y = x0 + left, y0 + top
    if config.fill_holes:
        top, left = (h + 1) % 2 if orientation.flip_y else 0, (w + 1) % 2 if orientation.flip_x else 0
        places = find_narrow_ground(framed, h, w, top, left)
        beyond = (y == 0, y + h == mask.shape[0], x == 0, x + w == mask.shape[1])
        filled = fill_holes(pixels[:, : w + 2], places, beyond) if len(places) else None
        if branched and len(places):
            filled = close_slits(pixels[:, : w + 2] if filled is None else filled)
        if filled is not None:  # the box is the same
            if polygon is not None:
                filled[1 : h + 1, 1 : w + 1] &= polygon[y : y + h, x : x + w] != 0
            pixels, framed, _, moments = frame(np.ascontiguousarray(_packed(filled).T))
            orientation = canonical_orientation(pixels[1 : h + 1, 1 : w + 1], moments)
    size, outline = (mask.shape[0], mask.shape[1]), None if region is None else region.outline
    return MaskCrop(pixels, framed, (h, w), (x, y), orientation, size, outline)


def _grown_beyond(mask: npt.NDArray[Any], polygon: npt.NDArray[np.uint8], reach: int) -> npt.NDArray[np.uint8]:
    """Return a mask that goes on beyond the edges of a polygon, so that no erosion eats it from there."""
    cable = (mask != 0).view(np.uint8)
    grown = cv2.dilate(cable, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    return np.asarray(cable | (grown > polygon))  # all of them are 0 or 1, and the cable is 0 outside


def _window(packed: npt.NDArray[np.uint64], x0: int, y0: int, shape: tuple[int, ...]) -> npt.NDArray[np.uint64]:
    """Return packed pixels (H, words) as a bitmask (k, R) that begins at a column and a row; 0 beyond them."""
    (words, rows), first = shape, x0 // WORD_BITS
    window = np.zeros((words, rows), np.uint64)
    low, high = max(first, 0), min(first + words, packed.shape[1])
    top, bottom = max(y0, 0), min(y0 + rows, packed.shape[0])
    window[low - first : high - first, top - y0 : bottom - y0] = packed[top:bottom, low:high].T
    return window


def _packed(mask: npt.NDArray[Any]) -> npt.NDArray[np.uint64]:
    """Return the mask with 64 pixels a word, shape (H, words)."""
    if mask.dtype not in (np.bool_, np.uint8):
        mask = mask != 0
    packed = np.packbits(np.ascontiguousarray(mask), axis=1, bitorder="little")
    height, width = packed.shape
    if width % _WORD_BYTES == 0:
        return packed.view(np.uint64)
    padded = np.zeros((height, -(-width // _WORD_BYTES) * _WORD_BYTES), dtype=np.uint8)
    padded[:, :width] = packed
    return padded.view(np.uint64)
