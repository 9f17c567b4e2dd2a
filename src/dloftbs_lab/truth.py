"""Known truth of a frame: the reference that results are measured against."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.data.curve import BSplineCurve
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs.support.values import check_all, check_integer, shown

_MIN_ID, _LARGEST_ID = -(2**63), 2**63 - 1  # as int64 has them


@dataclass(frozen=True, eq=False)
class Truth:
    """The objects of one frame.

    Parameters
    ----------
    curves : tuple of BSplineCurve
        True centre lines, px, hidden parts included; ``u`` is the normalised arc length, the same end first throughout
        a sequence. Empty where only the masks are known.
    visible_masks : tuple of numpy.ndarray, shape (H, W), bool
        The pixels of each object that no other object and no occluder hides. Empty where they are not known.
    ids : tuple of int
        Identity of each object, the same in every frame of a sequence.
    curves_3d : tuple of BSplineCurve
        The true axes in the camera's frame, metres. Empty where they are not known.

    Raises
    ------
    InputError
        If the counts disagree, an id comes twice, nothing is known of the objects, curves have the wrong dimension, or
        masks are of another type or of different shapes.
    """

    curves: tuple[BSplineCurve, ...]
    visible_masks: tuple[npt.NDArray[np.bool_], ...]
    ids: tuple[int, ...]
    curves_3d: tuple[BSplineCurve, ...] = ()

    def __post_init__(self) -> None:
        for name, kind in (("curves", BSplineCurve), ("visible_masks", np.ndarray), ("curves_3d", BSplineCurve)):
            object.__setattr__(self, name, check_all(name, getattr(self, name), kind))
        ids = (check_integer("an id", number, _MIN_ID, _LARGEST_ID) for number in check_all("ids", self.ids, object))
        object.__setattr__(self, "ids", tuple(ids))
        count = len(self.ids)
        if len(set(self.ids)) != count:
            raise InputError(f"ids must differ, got {self.ids}")
        for name in ("curves", "visible_masks", "curves_3d"):
            if len(getattr(self, name)) not in (0, count):
                raise InputError(f"{name} must be none or one for each of {count} ids, got {len(getattr(self, name))}")
        if count and not self.curves and not self.visible_masks:
            raise InputError(f"{count} ids need curves or visible_masks, got neither")
        if self.curves_3d and not self.curves:
            raise InputError("curves_3d need the curves in the image too, got none")
        _check_dimension("curves", self.curves, 2)
        _check_dimension("curves_3d", self.curves_3d, 3)
        _check_masks(self.visible_masks)

    def to_dict(self) -> dict[str, Any]:
        """Return ids and curves as plain values, ready for JSON; masks are left out, since they belong in images."""
        return {
            "ids": list(self.ids),
            "curves": [curve.to_dict() for curve in self.curves],
            "curves_3d": [curve.to_dict() for curve in self.curves_3d],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], visible_masks: tuple[npt.NDArray[np.bool_], ...] = ()) -> Truth:
        """Build the truth from what `to_dict` gave, without loss, and the masks that it left out.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        if not isinstance(data, Mapping):
            raise InputError(f"a truth needs a dictionary as of to_dict, got {shown(data)}")
        try:
            curves, curves_3d = (
                tuple(BSplineCurve.from_dict(curve) for curve in data[key]) for key in ("curves", "curves_3d")
            )
            ids = tuple(data["ids"])
        except KeyError as error:
            raise InputError(f"a truth needs the key {error.args[0]!r}, got {shown(list(data))}") from error
        except TypeError as error:
            raise InputError(f"a truth needs lists of ids and curves: {error}") from error
        return cls(curves, visible_masks, ids, curves_3d)

    @cached_property
    def mask(self) -> npt.NDArray[np.bool_] | None:
        """The visible pixels of all objects, shape (H, W); None where they are not known."""
        return np.logical_or.reduce(self.visible_masks) if self.visible_masks else None

    @cached_property
    def shown_spans(self) -> tuple[tuple[tuple[float, float], ...], ...]:
        """For each curve the intervals of ``u``, ascending, over which `mask` has it; the whole where no mask is known.

        What lies outside of the image or behind an occluder is not in the mask; what lies under another cable is.
        """
        if self.mask is None:
            return (((0.0, 1.0),),) * len(self.curves)
        return tuple(_spans(_in_mask(curve.sample(_samples(curve)), self.mask)) for curve in self.curves)

    @cached_property
    def labels(self) -> npt.NDArray[np.uint16] | None:
        """The visible pixels as an image (H, W): 0 is background, ``i + 1`` object ``i``; None where not known."""
        if not self.visible_masks:
            return None
        labels = np.zeros(self.visible_masks[0].shape, dtype=np.uint16)
        for number, mask in enumerate(self.visible_masks, start=1):
            labels[mask] = number
        return labels


def _samples(curve: BSplineCurve) -> int:
    """Return how many points of a curve lie about a pixel apart."""
    return max(2, math.ceil(curve.length) + 1)


def _in_mask(points: FloatArray, mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    columns, rows = np.rint(points).astype(np.intp).T
    inside = (columns >= 0) & (rows >= 0) & (columns < mask.shape[1]) & (rows < mask.shape[0])
    shown: npt.NDArray[np.bool_] = np.zeros(len(points), np.bool_)
    shown[inside] = mask[rows[inside], columns[inside]]
    return shown


def _spans(shown: npt.NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
    """Return where the flags (n,) of evenly spaced points are set, as shares of the way from the first to the last."""
    edges = np.flatnonzero(np.diff(shown.astype(np.int8), prepend=0, append=0))
    last = len(shown) - 1
    return tuple((start / last, (stop - 1) / last) for start, stop in edges.reshape(-1, 2).tolist())


def _check_dimension(name: str, curves: tuple[BSplineCurve, ...], ndim: int) -> None:
    for curve in curves:
        if curve.ndim != ndim:
            raise InputError(f"{name} must have {ndim} dimensions, got {curve}")


def _check_masks(masks: tuple[npt.NDArray[np.bool_], ...]) -> None:
    for mask in masks:
        if mask.ndim != 2 or mask.dtype != np.bool_ or mask.shape != masks[0].shape:
            raise InputError(
                f"visible_masks must be bool, all of one shape (H, W) such as {masks[0].shape}, "
                f"got {mask.shape} of {mask.dtype}"
            )
