"""Places of labels: beside the start of their curve, inside the picture, over as little as can be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dloftbs.support.arrays import FloatArray

Box = tuple[int, int, int, int]
"""Left, top, width, height, px."""

_DIAGONAL = 0.5**0.5
# Right of the start and above it first: where nothing is in the way, labels sit there.
_AROUND = ((1, -1), (1, 1), (-1, -1), (-1, 1), (0, -1), (0, 1), (1, 0), (-1, 0))


def place(
    anchor: FloatArray, distance: float, size: tuple[int, int], *, busy: FloatArray, taken: Sequence[Box], room: Box
) -> Box:
    """Return the box for a label.

    Parameters
    ----------
    anchor : numpy.ndarray, shape (2,)
        Point that it belongs to.
    distance : float
        From there to the nearest edge or corner of the box, px.
    size : (int, int)
        Width and height of the box.
    busy : numpy.ndarray, shape (n, 2)
        Points that should stay visible.
    taken : sequence of Box
        Other labels.
    room : Box
        The picture.
    """
    candidates = [_inside(_beside(anchor, distance, size, way), room) for way in _AROUND]
    corners = np.array(candidates)[:, :2]
    near = busy[_within(busy, corners.min(axis=0), corners.max(axis=0) + size)]
    # The order of the candidates decides between equals.
    return min(candidates, key=lambda box: _hidden(box, near) + sum(len(near) + 1 for t in taken if _overlap(box, t)))


def _beside(anchor: FloatArray, distance: float, size: tuple[int, int], way: tuple[int, int]) -> Box:
    width, height = size
    step = distance * (_DIAGONAL if way[0] and way[1] else 1.0)
    x = anchor[0] + way[0] * (step + width / 2) - width / 2
    y = anchor[1] + way[1] * (step + height / 2) - height / 2
    return round(float(x)), round(float(y)), width, height


def _inside(box: Box, room: Box) -> Box:
    left = max(room[0], min(box[0], room[0] + room[2] - box[2]))
    top = max(room[1], min(box[1], room[1] + room[3] - box[3]))
    return left, top, box[2], box[3]


def _hidden(box: Box, points: FloatArray) -> int:
    low = np.array(box[:2])
    return int(_within(points, low, low + box[2:]).sum())


def _within(points: FloatArray, low: npt.NDArray[np.intp], high: npt.NDArray[np.intp]) -> npt.NDArray[np.bool_]:
    """Return which points (n, 2) lie between two corners (2,), the second one not included."""
    (x, y), (left, top), (right, bottom) = points.T, low, high
    return (x >= left) & (x < right) & (y >= top) & (y < bottom)


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[0] + b[2] and b[0] < a[0] + a[2] and a[1] < b[1] + b[3] and b[1] < a[1] + a[3]
