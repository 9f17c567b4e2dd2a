"""Places at which cables are expected in an image, for segmenters that are prompted."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError
from dloftbs.support.array_likes import as_array
from dloftbs.support.arrays import AnyArray, FloatArray, as_points, check_mask
from dloftbs.support.values import set_fields


def _nothing(columns: int) -> FloatArray:
    return np.empty((0, columns))


@dataclass(frozen=True, eq=False)
class Prompt:
    """Clicks and boxes where tracking expects cables in an image, for a segmenter such as SAM.

    Coordinates are pixels of the image that the segmenter gets. Only what the last frame showed is in it: a point on a
    hidden part would be one on what hides it. Before there are confirmed tracks, there are no points and no boxes.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, 2)
        ``(x, y)`` on the predicted curves.
    owner : numpy.ndarray, shape (n,), intp
        Row of `boxes` of the object that each point is on.
    negative : numpy.ndarray, shape (m, 2)
        ``(x, y)`` beside the predicted curves, on none of them.
    boxes : numpy.ndarray, shape (k, 4)
        ``(x0, y0, x1, y1)`` around each object.
    mask : numpy.ndarray, shape (H, W), bool, optional
        Mask of the last frame; None where there is none of the image's size.

    Raises
    ------
    InputError
        If a shape or a type is another, or an owner is no row of `boxes`.
    """

    points: FloatArray = field(default_factory=lambda: _nothing(2))
    owner: npt.NDArray[np.intp] = field(default_factory=lambda: np.empty(0, np.intp))
    negative: FloatArray = field(default_factory=lambda: _nothing(2))
    boxes: FloatArray = field(default_factory=lambda: _nothing(4))
    mask: AnyArray | None = None

    def __post_init__(self) -> None:
        points, boxes = as_points("points", self.points, (2,)), as_points("boxes", self.boxes, (4,))
        owner = as_array("owner", self.owner)
        if owner.shape != (len(points),) or owner.dtype.kind not in "iu":
            raise InputError(f"owner must be an integer for each of the {len(points)} points, got {owner.shape}")
        if owner.size and not 0 <= owner.min() <= owner.max() < len(boxes):
            raise InputError(f"owner must be rows of the {len(boxes)} boxes, got {owner.min()} to {owner.max()}")
        owner = owner.astype(np.intp)
        owner.setflags(write=False)
        set_fields(self, points=points, owner=owner, negative=as_points("negative", self.negative, (2,)), boxes=boxes)
        if self.mask is not None:
            mask = check_mask(self.mask) != 0
            mask.setflags(write=False)
            set_fields(self, mask=mask)
