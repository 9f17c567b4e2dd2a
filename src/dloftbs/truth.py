"""What a frame really shows, where that is known: what results are measured against."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from dloftbs.curve import BSplineCurve
from dloftbs.errors import InputError


@dataclass(frozen=True, eq=False)
class Truth:
    """The objects of one frame.

    Parameters
    ----------
    curves : tuple of BSplineCurve
        True centre lines, px, hidden parts included; ``u`` is the normalised arc length, the same end first throughout
        a sequence.
    visible_masks : tuple of numpy.ndarray, shape (H, W), bool
        The pixels of each object that no other object and no occluder hides. Empty where they are not known.
    ids : tuple of int
        Which object is which, the same in every frame of a sequence.
    curves_3d : tuple of BSplineCurve
        The true axes in the camera's frame, metres. Empty where they are not known.

    Raises
    ------
    InputError
        If the counts disagree.
    """

    curves: tuple[BSplineCurve, ...]
    visible_masks: tuple[npt.NDArray[np.bool_], ...]
    ids: tuple[int, ...]
    curves_3d: tuple[BSplineCurve, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.curves)
        if len(self.ids) != count:
            raise InputError(f"{count} curves need {count} ids, got {len(self.ids)}")
        for name in ("visible_masks", "curves_3d"):
            if len(getattr(self, name)) not in (0, count):
                raise InputError(
                    f"{name} must be none or one for each of {count} curves, got {len(getattr(self, name))}"
                )

    @cached_property
    def mask(self) -> npt.NDArray[np.bool_] | None:
        """The visible pixels of all objects, shape (H, W); None where they are not known."""
        return np.logical_or.reduce(self.visible_masks) if self.visible_masks else None

    @cached_property
    def labels(self) -> npt.NDArray[np.uint8] | None:
        """The visible pixels as an image (H, W): 0 is background, ``i + 1`` object ``i``; None where not known."""
        if not self.visible_masks:
            return None
        labels = np.zeros(self.visible_masks[0].shape, dtype=np.uint8)
        for number, mask in enumerate(self.visible_masks, start=1):
            labels[mask] = number
        return labels
