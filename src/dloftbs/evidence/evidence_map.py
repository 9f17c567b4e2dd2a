"""Evidence of an image between the ends of cables: ground, cable, or something that hides it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.evidence.kernels.gap_pixels import look_across, sample_references
from dloftbs.graph import POSITION, TANGENT
from dloftbs.mask_crop import MaskCrop

_Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class EvidenceMap:
    """The image of a frame, asked about gaps.

    Parameters
    ----------
    image : numpy.ndarray, shape (H, W, 3), uint8
        BGR.
    crop : MaskCrop
    """

    image: npt.NDArray[np.uint8]
    crop: MaskCrop

    def across(
        self, points: FloatArray, spans: _Ints, end_states: FloatArray, pairs: _Ints, width: float
    ) -> FloatArray:
        """Return what lies between pairs of ends.

        Parameters
        ----------
        points : numpy.ndarray, shape (m, 2)
            Of all runs, oriented.
        spans : numpy.ndarray, shape (n, 2)
            The points of each run that lie clear of its junctions.
        end_states : numpy.ndarray, shape (2 n, 6)
            Of the branches' ends, oriented.
        pairs : numpy.ndarray, shape (k, 2)
            Ends.
        width : float
            Of the cables, px.

        Returns
        -------
        numpy.ndarray, shape (k, 3)
            How much of each way looks like the ground beside the cables, like the cables, and like neither, in widths.
        """
        crop = self.crop
        (h, w), (x0, y0) = crop.size, crop.origin
        mask = crop.pixels[1 : h + 1, 1 : w + 1]
        image = self.image[y0 : y0 + h, x0 : x0 + w]
        ends, index = np.unique(pairs, return_inverse=True)
        matrix, offset = crop.image_transform
        origin = offset - np.array([x0, y0], dtype=np.float64)
        placed = points @ matrix.T + origin
        known = np.column_stack((end_states[ends, POSITION] @ matrix.T + origin, end_states[ends, TANGENT] @ matrix.T))
        references = sample_references(image, mask, placed, spans, ends, width)
        return look_across(image, mask, known, index.reshape(-1, 2), *references, width)
