"""Distances between curves and the pixels of a mask: criteria 1 and 2, and points that lie beside everything."""

from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.evaluation.kernels.nearest_points import measure_nearest

_CELL_PX = 8.0
"""Length of a cell in which the points of curves are looked up: by hand; half a cable's width fits in two of them."""
_MAX_CELLS = 1 << 20  # by hand: 8 MiB; a curve that leaves the image for good has no grid


class MaskPixels:
    """The pixels of a mask, asked for distances by every method that is scored on its frame.

    Parameters
    ----------
    mask : numpy.ndarray, shape (H, W)
        Any non-zero is cable.
    """

    def __init__(self, mask: npt.NDArray[np.generic]) -> None:
        self._mask = mask.astype(np.bool_, copy=False)

    @cached_property
    def places(self) -> FloatArray:
        """``(x, y)`` of each pixel, shape (n, 2), row by row."""
        rows, columns = np.divmod(np.flatnonzero(self._mask), self._mask.shape[1])
        return np.column_stack((columns, rows)).astype(np.float64)

    @cached_property
    def width_px(self) -> float:
        """Mean width of what the mask shows; see `mean_width`."""
        return mean_width(self._mask)

    @cached_property
    def is_empty(self) -> bool:
        """Whether the mask shows nothing: then there is no distance from it."""
        return not self._mask.any()

    def l1(self, points: FloatArray) -> float:
        """Return criterion 1, `dloftbs_lab.evaluation.l1`, for points (m, 2) px along all curves."""
        return float(nearest_distances(self.places, points).mean())

    def l2(self, points: FloatArray) -> float:
        """Return criterion 2, `dloftbs_lab.evaluation.l2`, for points (m, 2) px along all curves."""
        return float(self.distances(points).mean())

    def distances(self, points: FloatArray) -> FloatArray:
        """Return how far points (n, 2) px are from the nearest pixel, shape (n,)."""
        nearest = np.rint(points)
        shown = shows(self._mask, nearest)
        # Of a point whose pixel is set, nothing is nearer.
        distances: FloatArray = np.sqrt(((points - nearest) ** 2).sum(axis=1))
        if not shown.all():
            distances[~shown], _ = self._outline.query(points[~shown])
        return distances

    def count_beside(self, points: FloatArray) -> int:
        """Return how many points (n, 2) px lie more than a mean width of the cables from anything in the mask.

        Inside of the image, the pixel in which a point lies stands for it.
        """
        if self.is_empty:
            return len(points)
        inside = points.clip(0.0, np.array(self._mask.shape[::-1]) - 1.0)
        columns, rows = np.rint(inside).astype(np.intp).T
        away, outside = np.zeros(len(points)), ~self._mask[rows, columns]
        if outside.any():
            away[outside], _ = self._outline.query(np.column_stack((columns[outside], rows[outside])))
        return int((away + np.linalg.norm(points - inside, axis=1) > self.width_px).sum())

    @cached_property
    def _outline(self) -> cKDTree:
        """The pixels beside which one is not set, or the image ends: one of them is nearest to whatever is outside."""
        inner = cv2.erode(
            self._mask.astype(np.uint8), np.ones((3, 3), np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=0
        )
        rows, columns = np.divmod(np.flatnonzero(self._mask & (inner == 0)), self._mask.shape[1])
        return cKDTree(np.column_stack((columns, rows)).astype(np.float64), balanced_tree=False)


def shows(mask: npt.NDArray[np.bool_], points: FloatArray) -> npt.NDArray[np.bool_]:
    """Return at which points (n, 2) px a mask (H, W) is set; those outside of the image, or without a place, are not.

    Beyond the field of a lens model, points have no place in the image.
    """
    columns, rows = np.rint(np.where(np.isfinite(points), points, -1.0)).astype(np.intp).T
    inside = (columns >= 0) & (rows >= 0) & (columns < mask.shape[1]) & (rows < mask.shape[0])
    shown: npt.NDArray[np.bool_] = np.zeros(len(points), np.bool_)
    shown[inside] = mask[rows[inside], columns[inside]]
    return shown


def nearest_distances(points: FloatArray, others: FloatArray) -> FloatArray:
    """Return the distance of each point (n, 2) from the nearest of others (m, 2), of which there is one, shape (n,)."""
    left, top = others.min(axis=0)
    columns, rows = ((others - (left, top)) // _CELL_PX).astype(np.intp).T
    across, down = int(columns.max()) + 1, int(rows.max()) + 1
    distances = np.full(len(points), np.inf)
    if across * down <= _MAX_CELLS:
        cells = rows * across + columns
        first = np.concatenate(([0], np.cumsum(np.bincount(cells, minlength=across * down))))
        order = np.argsort(cells, kind="stable")
        measure_nearest(
            np.ascontiguousarray(points),
            np.ascontiguousarray(others[order]),
            first,
            left,
            top,
            _CELL_PX,
            across,
            distances,
        )
    far = np.isinf(distances)
    if far.any():
        distances[far], _ = cKDTree(others, balanced_tree=False).query(points[far])
    return distances


def mean_width(mask: npt.NDArray[np.bool_]) -> float:
    """Return the width of a long and thin mask: of 2 r + 1 rows the mean depth is about (r + 1)^2 / (2 r + 1)."""
    x, y, width, height = cv2.boundingRect(mask.astype(np.uint8))
    # With a row and a column of ground around it, where the image has any, depths are those in the whole image.
    crop = mask[max(y - 1, 0) : y + height + 1, max(x - 1, 0) : x + width + 1]
    depth = cv2.distanceTransform(crop.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[crop]
    return max(1.0, 4.0 * float(depth.mean()) - 2.0) if len(depth) else 1.0
