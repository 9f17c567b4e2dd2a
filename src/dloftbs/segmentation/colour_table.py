"""A bit for each of the 16.7 million colours, looked up for the pixels of an image."""

from __future__ import annotations

import numpy as np

from dloftbs.segmentation.kernels import colour_table as kernels
from dloftbs.support.arrays import ByteArray, check_image

LEVELS = 256
"""Levels of a channel.

Source: by definition.
"""


class ColourTable:
    """A callable ``image -> mask`` that looks each pixel's colour up; its cost does not depend on what it holds.

    Parameters
    ----------
    bits : numpy.ndarray, shape (256 red, 256 green, 32 bytes of 8 blues), uint8
        Bit ``blue & 7`` of byte ``blue >> 3`` is set where the colour is in the table.
    """

    def __init__(self, bits: ByteArray) -> None:
        self._fine = bits.ravel()
        self._coarse = _coarse_table(bits)

    def __call__(self, image: ByteArray) -> ByteArray:
        """Segment an image.

        Parameters
        ----------
        image : numpy.ndarray, shape (H, W, 3), uint8
            BGR.

        Returns
        -------
        numpy.ndarray, shape (H, W), uint8
            1 where the colour is in the table, else 0.

        Raises
        ------
        InputError
            If it is no such image.
        """
        image = check_image(image)
        mask = np.empty(image.shape[0] * image.shape[1], dtype=np.uint8)
        kernels.look_up(np.ascontiguousarray(image).reshape(-1), self._coarse, self._fine, mask)
        return mask.reshape(image.shape[:2])


def _coarse_table(table: ByteArray) -> ByteArray:
    """Say of each cell of 8 reds, 4 greens and 8 blues whether none, all or some are in the table, shape (65536,)."""
    cells = table.reshape(32, 8, 64, 4, 32)
    common, any_of = np.bitwise_and.reduce(cells, axis=(1, 3)), np.bitwise_or.reduce(cells, axis=(1, 3))
    coarse = np.where(common == 0xFF, kernels.ALL, np.where(any_of != 0, kernels.MIXED, kernels.NONE))
    return coarse.astype(np.uint8).ravel()
