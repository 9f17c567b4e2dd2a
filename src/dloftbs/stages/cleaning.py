"""Stage 2: mask to patch: bounding box, morphology, pose (paper: open and skeletonise)."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.config import CleaningConfig
from dloftbs.kernels.boxes import tight_box, word_box
from dloftbs.kernels.cleaning import give_back, keep_filled
from dloftbs.kernels.thinning import find_border
from dloftbs.patch import Patch, canonical_pose

_Box = tuple[int, int, int, int]  # x0, y0, x1, y1, the last two excluded
_WORD = 8  # the kernels look at eight pixels at a time


def clean(mask: npt.NDArray[Any], config: CleaningConfig) -> Patch | None:
    """Close and open the mask by squares and cut out what is left.

    The paper opens by a 3 x 3 square. What that takes may come back where it is as long as a thin cable. Of what the
    closing adds stays what fills a hole or a notch, so that nothing that lies close together is joined. As in OpenCV,
    what lies beyond the image counts as foreground to an erosion, so that a cable that leaves the image is not eaten
    from there.

    Parameters
    ----------
    mask : numpy.ndarray, shape (H, W), bool or integer
        Any non-zero is cable. Never changed.
    config : CleaningConfig

    Returns
    -------
    Patch or None
        None where nothing is left.
    """
    binary = _as_bytes(mask)
    box = _rough_box(binary)
    if box is None:
        return None
    x0, y0, x1, y1 = _grow(box, config, binary.shape)
    cut = binary[y0:y1, x0:x1]
    if config.close_px > 1:
        closed = cv2.morphologyEx(cut, cv2.MORPH_CLOSE, np.ones((config.close_px, config.close_px), dtype=np.uint8))
        keep_filled(cut.copy(), closed)
        cut = closed
    if config.open_px > 1:
        square = np.ones((config.open_px, config.open_px), dtype=np.uint8)
        opened = cv2.morphologyEx(cut, cv2.MORPH_OPEN, square)
        own = cut if config.close_px > 1 else cut.copy()
        if config.thin_px > 0 and not give_back(own, opened, config.thin_px):
            opened = cv2.morphologyEx(opened, cv2.MORPH_OPEN, square)
        cut = opened
    inner = _bounding_box(cut)
    if inner is None:
        return None
    left, top, right, bottom = inner
    cut = cut[top:bottom, left:right]
    h, w = cut.shape
    pixels = np.zeros((h + 2, -(-(w + 2) // _WORD) * _WORD), dtype=np.uint8)
    np.not_equal(cut, 0, out=pixels[1 : h + 1, 1 : w + 1].view(np.bool_))
    border, area = find_border(pixels.view(np.uint64))
    pose = canonical_pose(pixels[1 : h + 1, 1 : w + 1], border, pixels.shape[1])
    return Patch(pixels, (h, w), (x0 + left, y0 + top), border, area, pose)


def _as_bytes(mask: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Return the mask as uint8 with rows in one piece, without a copy where it is that already."""
    if mask.dtype == np.bool_:
        mask = mask.view(np.uint8)
    elif mask.dtype != np.uint8:
        mask = (mask != 0).view(np.uint8)
    return mask if mask.flags.c_contiguous else np.ascontiguousarray(mask)


def _rough_box(mask: npt.NDArray[np.uint8]) -> _Box | None:
    """Return the foreground's box, or where the memory allows it one that is up to seven columns wider, faster."""
    if mask.shape[1] % _WORD or mask.ctypes.data % _WORD:
        return _bounding_box(mask)
    k0, y0, k1, y1 = word_box(mask.view(np.uint64))
    return (_WORD * k0, y0, _WORD * k1, y1) if y1 > 0 else None


def _bounding_box(mask: npt.NDArray[np.uint8]) -> _Box | None:
    box: _Box = tight_box(mask)  # OpenCV 4.8's boundingRect errs on masks of two and three columns
    return box if box[3] > 0 else None


def _grow(box: _Box, config: CleaningConfig, shape: tuple[int, ...]) -> _Box:
    """Widen the box by what the morphology reaches over, so that only the image's own border acts as one."""
    margin = config.open_px // 2 + 2 * (config.close_px // 2)  # a closing grows first, then looks as far again
    x0, y0, x1, y1 = box
    return max(x0 - margin, 0), max(y0 - margin, 0), min(x1 + margin, shape[1]), min(y1 + margin, shape[0])
