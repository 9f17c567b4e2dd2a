"""A region of interest on frames of one size: the frame cut to it, and the way of points back into the whole image."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.config import Roi
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.support.arrays import AnyArray, ByteArray, FloatArray


@dataclass(frozen=True, eq=False)
class Region:
    """A region of interest on frames of one size: a rectangle, or a polygon in its bounding box.

    Parameters
    ----------
    roi : Roi
        Px of the whole image.
    image_size : (int, int)
        ``(H, W)`` of the whole image.

    Raises
    ------
    InputError
        If it does not lie within the image.
    """

    roi: Roi
    image_size: tuple[int, int]

    def __post_init__(self) -> None:
        (x, y, w, h), (rows, columns) = self.box, self.image_size
        if x < 0 or y < 0 or x + w > columns or y + h > rows:
            left, top, right, bottom = max(x, 0), max(y, 0), min(x + w, columns), min(y + h, rows)
            within = (
                f"the part of it within is {left},{top},{right - left},{bottom - top}"
                if left < right and top < bottom
                else "none of it is within"
            )
            raise InputError(
                f"roi must lie within the image of {columns} x {rows} px, got {x},{y},{w},{h}"
                f"{'' if self.outline is None else ' around its polygon'}: {within}; "
                "a region of interest holds for frames of the size that it was drawn on"
            )

    @cached_property
    def box(self) -> tuple[int, int, int, int]:
        """The rectangle ``(x, y, w, h)`` around the region, px of the whole image."""
        if isinstance(self.roi[0], int):
            x, y, w, h = self.roi
            return x, y, w, h
        low, high = np.min(self.roi, axis=0).tolist(), np.max(self.roi, axis=0).tolist()
        return low[0], low[1], high[0] - low[0] + 1, high[1] - low[1] + 1

    @property
    def origin(self) -> tuple[int, int]:
        """``(x, y)`` in the whole image of the region's top left pixel."""
        return self.box[:2]

    @property
    def size(self) -> tuple[int, int]:
        """``(h, w)`` of the rectangle around the region, px."""
        return self.box[3], self.box[2]

    @cached_property
    def outline(self) -> FloatArray | None:
        """Corners (n, 2) of a polygon, px of the rectangle around it; None of a rectangle."""
        return None if isinstance(self.roi[0], int) else np.array(self.roi, np.float64) - self.origin

    @cached_property
    def inside(self) -> ByteArray | None:
        """1 for the pixels of a polygon, its edges included, shape (h, w); None of a rectangle."""
        if self.outline is None:
            return None
        pixels = np.zeros(self.size, np.uint8)
        cv2.fillPoly(pixels, [self.outline.astype(np.int32)], 1)
        pixels.flags.writeable = False
        return pixels

    @cached_property
    def share(self) -> float:
        """Share of the rectangle around the region that belongs to it."""
        return 1.0 if self.inside is None else np.count_nonzero(self.inside) / self.inside.size

    def cut(self, array: AnyArray) -> AnyArray:
        """Return the rectangle around the region of an array (H, W, ...) of the whole image, as a view."""
        x, y, w, h = self.box
        return array[y : y + h, x : x + w]

    def clear_outside(self, pixels: AnyArray) -> AnyArray:
        """Return a mask (h, w) that is 0 outside of a polygon; of a rectangle it is the mask itself."""
        return pixels if self.inside is None else pixels * self.inside.view(np.bool_)

    def paste(self, pixels: AnyArray) -> AnyArray:
        """Return a mask (h, w) in the whole image, which is 0 outside of the region."""
        whole = np.zeros(self.image_size, pixels.dtype)
        self.cut(whole)[:] = self.clear_outside(pixels)
        return whole

    def crop(self, frame: Frame) -> Frame:
        """Return a frame cut to the rectangle around the region, as views; there is no depth outside of a polygon."""
        image, mask, depth, occluders, instances = (
            None if array is None else self.cut(array)
            for array in (frame.image, frame.mask, frame.depth, frame.occluders, frame.instances)
        )
        if depth is not None and self.inside is not None:
            with np.errstate(invalid="ignore"):  # what is not finite is no depth either
                depth = depth * self.inside
        camera = None if frame.camera is None else self._camera_of(frame.camera)
        return replace(
            frame, image=image, mask=mask, depth=depth, occluders=occluders, instances=instances, camera=camera
        )

    def _camera_of(self, whole: PinholeCamera) -> PinholeCamera:
        """Return the camera of the cut images, the same one for the same camera: a lens is prepared once."""
        kept: tuple[PinholeCamera, PinholeCamera] | None = self.__dict__.get("_camera")
        if kept is None or kept[0] is not whole:
            x, y = self.origin
            kept = whole, replace(whole, cx=whole.cx - x, cy=whole.cy - y, size=self.size)
            self.__dict__["_camera"] = kept
        return kept[1]


def distances_to(outline: FloatArray, points: FloatArray) -> FloatArray:
    """Return the distances (k,) of points (k, 2) to the nearest edge of a polygon with corners (n, 2)."""
    edges = np.concatenate((outline[1:], outline[:1])) - outline
    away = points[:, None] - outline
    along = np.clip((away * edges).sum(axis=2) / (edges**2).sum(axis=1), 0.0, 1.0)
    distances: FloatArray = np.linalg.norm(away - along[..., None] * edges, axis=2).min(axis=1)
    return distances
