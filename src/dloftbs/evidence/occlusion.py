"""Evidence of occlusion: whether something hides a place of the image, or it is in plain sight."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.config import DepthConfig
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_samples import U, sample_curve
from dloftbs.data.depth import ReadableDepth
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.evidence.kernels.appearance_pixels import sample_appearance
from dloftbs.evidence.kernels.gap_depths import EDGE_PX
from dloftbs.evidence.kernels.occlusion_pixels import HIDDEN, look_at_pixels
from dloftbs.kernels.polyline_lengths import arc_parameter
from dloftbs.support.arrays import AnyArray, FloatArray, as_bytes, check_depth, check_image, check_mask
from dloftbs.support.values import DEPTH_UNITS_M, MILLIMETRE_M, check_number, check_type

_NOTHING = np.zeros((0, 0), dtype=np.uint8)
"""Pixels of what is not known, none.

Source: by definition.
"""

_NO_DEPTH = ReadableDepth(np.zeros((0, 0), dtype=np.uint16), 0.0, 0.0, 0.0)
"""Depth that is not known, no pixels, counts.

Source: by definition.
"""

_NO_DEPTH_M = np.zeros(0)
"""Distances of a cable that are not known, no metres.

Source: by definition.
"""


class Appearance(NamedTuple):
    """Colours of an object, BGR.

    Parameters
    ----------
    cable : numpy.ndarray, shape (k, 3)
        Samples along the object, where it is seen.
    colour : numpy.ndarray, shape (3,)
        The median colour of the object; NaN without samples.
    """

    cable: FloatArray
    colour: FloatArray


class OcclusionEvidence:
    """Evidence in a frame that a cable is hidden in a place, or is not: its depth and its mask of occluders.

    Depth comes first: something nearer than the cable hides it; a place where only farther things are seen is in plain
    sight, unless the mask has a cable there: it may lie over another. Where depth says neither, a place under the
    occluders is hidden; they say nothing of other places, where something else may hide a cable. The image has the
    colours of cables, and shows nothing of a place where none is seen: what hides a cable may look like the ground.

    Parameters
    ----------
    occluders : array_like, shape (H, W), bool or any integer type, optional
        See `Frame`.
    mask : array_like, shape (H, W), bool or any integer type, optional
        Of the cables.
    depth : array_like, shape (H, W), optional
        See `Frame`. It judges only objects with a curve in space.
    image : numpy.ndarray, shape (H, W, 3), uint8, optional
        BGR.
    camera : PinholeCamera, optional
        Needed with depth.
    config : DepthConfig, optional
        Meaning of the values of the depth.

    Attributes
    ----------
    size : (int, int)
        ``(H, W)`` px.

    Raises
    ------
    InputError
        If neither occluders nor depth nor an image are given, depth comes without a camera, or shapes or types are
        wrong.
    """

    def __init__(
        self,
        *,
        occluders: npt.ArrayLike | None = None,
        mask: npt.ArrayLike | None = None,
        depth: npt.ArrayLike | None = None,
        image: npt.NDArray[np.uint8] | None = None,
        camera: PinholeCamera | None = None,
        config: DepthConfig | None = None,
        depth_unit_m: float = MILLIMETRE_M,
    ) -> None:
        if occluders is None and depth is None and image is None:
            raise InputError("evidence of occlusion needs occluders, depth or an image, got none of them")
        if depth is not None and camera is None:
            raise InputError("`depth` requires `camera`, got None")
        if camera is not None:
            check_type("camera", camera, PinholeCamera)
        self._occluders = _NOTHING if occluders is None else as_bytes(check_mask(occluders, "occluders"))
        self._mask = _NOTHING if mask is None else as_bytes(check_mask(mask))
        self._image = None if image is None else check_image(image)
        self._camera = camera
        unit = check_number("depth_unit_m", depth_unit_m, *DEPTH_UNITS_M)
        stored = None if depth is None else check_depth(depth)
        self._depth = None if stored is None else ReadableDepth.of(stored, unit, config or DepthConfig())
        arrays = (self._occluders, self._mask, stored, self._image)
        shapes = {array.shape[:2] for array in arrays if array is not None and array is not _NOTHING}
        if len(shapes) > 1:
            raise InputError(f"occluders, mask, depth and image must have the same size, got {sorted(shapes)}")
        (self.size,) = shapes
        self._inside: npt.NDArray[np.uint8] | None = None

    def __repr__(self) -> str:
        arrays = {"occluders": self._occluders, "mask": self._mask, "depth": self._depth, "image": self._image}
        known = [name for name, array in arrays.items() if array is not None and array is not _NOTHING]
        return f"OcclusionEvidence({self.size[1]}x{self.size[0]}, {', '.join(known)})"

    @classmethod
    def of(
        cls, frame: Frame, mask: AnyArray | None, config: DepthConfig, inside: npt.NDArray[np.uint8] | None = None
    ) -> OcclusionEvidence | None:
        """Return the evidence in a frame with the mask that was made of it; None if it has none.

        Places where `inside` (H, W) is 0 count as outside of the image. Without a mask that can be believed everything
        counts as hidden, unless depth shows it in plain sight: where nothing is known to hide a cable, the mask alone
        would say that there is none.
        """
        depth = None if frame.camera is None else frame.depth
        occluders, image = frame.occluders, frame.image
        if mask is None:
            occluders, image, mask = np.ones(frame.size, np.uint8), None, _NOTHING
        if occluders is None and depth is None and image is None:
            return None
        evidence = cls.__new__(cls)  # the frame was checked, and so was the mask
        evidence._occluders = _NOTHING if occluders is None else as_bytes(occluders)
        evidence._depth = None if depth is None else ReadableDepth.of(depth, frame.depth_unit_m, config)
        evidence._mask, evidence._image, evidence._camera = as_bytes(mask), image, frame.camera
        evidence._inside = inside
        evidence.size = frame.size
        return evidence

    @property
    def has_image(self) -> bool:
        """True if there is an image to sample."""
        return self._image is not None

    def sample(self, points: FloatArray, seen: npt.NDArray[np.bool_], width_px: float) -> Appearance | None:
        """Return the colours of a cable; None without an image.

        Parameters
        ----------
        points : numpy.ndarray, shape (n, 2)
            Along the cable, ``(x, y)`` px.
        seen : numpy.ndarray, shape (n,), bool
            False where it is hidden.
        width_px : float
            px; NaN if it is unknown.
        """
        if self._image is None:
            return None
        return Appearance(*sample_appearance(self._image, points, seen, width_px))

    def look(self, points: FloatArray, width_px: float, depth_m: FloatArray | None = None) -> npt.NDArray[np.int64]:
        """Return what depth, occluders and the image's border show of places.

        Parameters
        ----------
        points : numpy.ndarray, shape (n, 2)
            ``(x, y)`` px.
        width_px : float
            Of the cable, px; NaN if it is unknown.
        depth_m : numpy.ndarray, shape (n,), optional
            Distance of the cable there along the optical axis, m; NaN where it is unknown.

        Returns
        -------
        numpy.ndarray, shape (n,)
            `HIDDEN`, `IN_SIGHT` or `UNKNOWN`; places outside of the image, or of a region of interest, are hidden.
        """
        reach = max(EDGE_PX, 0.0 if math.isnan(width_px) else width_px)
        depth, expected = _NO_DEPTH, _NO_DEPTH_M
        if self._depth is not None and depth_m is not None:
            depth, expected = self._depth, depth_m
        rows, columns = self.size
        told = look_at_pixels(points, self._occluders, self._mask, rows, columns, reach, *depth, expected)
        if self._inside is not None:
            x, y = np.clip(np.rint(points), 0.0, (columns - 1, rows - 1)).astype(np.intp).T
            told[self._inside[y, x] == 0] = HIDDEN
        return told

    def project(self, points_m: FloatArray) -> FloatArray | None:
        """Return the image (n, 2) of points (n, 3) in space, px; None without a camera that sees all of them."""
        return None if self._camera is None or not points_m[:, 2].min() > 0.0 else self._camera._project(points_m)

    def depth_along(self, curve_3d: BSplineCurve) -> FloatArray | None:
        """Return the distance (SAMPLES,) of a curve along the optical axis, m, at the samples of its image.

        None without depth, or without a camera that sees all of the curve.
        """
        points, _ = sample_curve(curve_3d)
        seen = None if self._depth is None else self.project(points)
        if seen is None:
            return None
        along = arc_parameter(seen, False)
        return np.interp(U, along, points[:, 2]) if along[-1] > 0.0 else None
