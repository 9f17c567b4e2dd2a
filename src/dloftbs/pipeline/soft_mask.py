"""Masks that are probabilities: how many of their less sure pixels are cable, is decided by what is read of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import cv2
import numpy as np

from dloftbs.config import Config
from dloftbs.data.centerline import Centerline
from dloftbs.data.frame import Frame
from dloftbs.kernels.shared.soft_masks import HALF, LEAST_PROBABLE
from dloftbs.support.arrays import AnyArray, BoolArray, ByteArray

_LIMITS = (HALF, HALF // 2, HALF // 4, LEAST_PROBABLE)
"""Least values of cable that are tried, of 256.

Source: by definition; each halves the one before.
"""
SURE = 0.9
"""Mean confidence of objects from which on no further reading is tried.

Source: by definition; nine in ten are whole cables.
"""


def plain_mask(frame: Frame, config: Config) -> BoolArray:
    """Return what the mask of a frame says is cable, shape (H, W), where the configuration may say what its values are.

    See `Frame.is_cable`.
    """
    known = replace(frame, mask_is=config.segmentation.mask_is) if frame.mask_is == "auto" else frame
    is_cable = known.is_cable
    assert is_cable is not None  # whoever asks gave it a mask
    return is_cable


def readings_of(soft: ByteArray) -> Iterator[tuple[int, AnyArray]]:
    """Yield limits, the highest first, and what is cable by each (H, W): parts that are rather cable somewhere.

    This is a threshold with hysteresis, as Canny's (PAMI 1986): a part is taken down to the limit if any pixel of it
    reaches one half.
    """
    sure = soft >= HALF
    yield HALF, sure
    if not sure.any():
        return
    for limit in _LIMITS[1:]:
        count, parts = cv2.connectedComponents((soft >= limit).view(np.uint8), connectivity=8)
        is_cable = np.zeros(count, np.bool_)
        is_cable[parts[sure]] = True
        yield limit, is_cable[parts]


def sureness(lines: Sequence[Centerline]) -> float:
    """Return the share of objects that are expected to be whole cables; 0 without any."""
    return sum(line.confidence for line in lines) / max(len(lines), 1)
