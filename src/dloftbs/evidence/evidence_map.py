"""Evidence of a frame between the ends of cables: ground, cable, or something that hides it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import AnyArray, FloatArray, as_bytes
from dloftbs.config import DepthConfig
from dloftbs.depth import unit_of
from dloftbs.evidence.kernels.gap_depths import judge_ways, sample_depths
from dloftbs.evidence.kernels.gap_pixels import lay_ways, look_across, mark_covered, measure_ways, sample_references
from dloftbs.evidence.occlusion import DEPTH_NOISE_PER_M, DEPTH_TOLERANCE_M
from dloftbs.frame import Frame
from dloftbs.graph import POSITION, TANGENT
from dloftbs.mask_crop import MaskCrop

_Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class EvidenceMap:
    """Evidence of a frame beside its mask, asked about gaps: depth first, then occluders, then the image.

    Depth tells what is nearer than the cables, and where the ground is seen; occluders hide what they cover, and say
    nothing of other places, where something else may hide a cable.

    Parameters
    ----------
    crop : MaskCrop
    image : numpy.ndarray, shape (H, W, 3), uint8, optional
        BGR.
    depth : numpy.ndarray, shape (H, W), optional
        See `Frame`.
    occluders : numpy.ndarray, shape (H, W), bool or any integer type, optional
        See `Frame`.
    config : DepthConfig, optional
        Meaning of the values of the depth.
    """

    crop: MaskCrop
    image: npt.NDArray[np.uint8] | None = None
    depth: npt.NDArray[Any] | None = None
    occluders: AnyArray | None = None
    config: DepthConfig = field(default_factory=DepthConfig)

    @classmethod
    def of(cls, frame: Frame, crop: MaskCrop, config: DepthConfig) -> EvidenceMap | None:
        """Return the evidence in a frame; None if it has none."""
        if frame.image is None and frame.depth is None and frame.occluders is None:
            return None
        return cls(crop, frame.image, frame.depth, frame.occluders, config)

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
            How much of each way is the ground beside the cables, a cable, and neither, in widths.
        """
        ends, index = np.unique(pairs, return_inverse=True)
        pairs = index.reshape(-1, 2)
        matrix, offset = self.crop.image_transform
        offset = offset - np.array(self.crop.origin, dtype=np.float64)
        placed = points @ matrix.T + offset
        states = np.column_stack((end_states[ends, POSITION] @ matrix.T + offset, end_states[ends, TANGENT] @ matrix.T))
        ways, steps = lay_ways(states, pairs, width)
        told: npt.NDArray[np.uint8] = np.zeros((len(pairs), ways.shape[1]), dtype=np.uint8)
        (h, w), (x0, y0) = self.crop.size, self.crop.origin
        window, mask = np.s_[y0 : y0 + h, x0 : x0 + w], self.crop.pixels[1 : h + 1, 1 : w + 1]
        if self.occluders is not None:
            mark_covered(as_bytes(self.occluders.reshape(self.occluders.shape[:2])[window]), ways, steps, told)
        if self.depth is not None:
            depth = self.depth[window].astype(np.float32, copy=False), unit_of(self.depth, self.config)
            asked = *depth, *self.config.range_m, mask
            known = sample_depths(*asked, placed, spans, ends, width)
            judge_ways(*asked, known, pairs, ways, steps, width, DEPTH_TOLERANCE_M, DEPTH_NOISE_PER_M, told)
        if self.image is not None:
            colours = sample_references(self.image[window], mask, placed, spans, ends, width)
            look_across(self.image[window], mask, pairs, ways, steps, *colours, width, told)
        return measure_ways(states, pairs, steps, told, width)
