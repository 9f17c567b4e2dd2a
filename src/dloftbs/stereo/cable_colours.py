"""Colours of cables in images as evidence of which is which."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dloftbs.data.detection import Detection
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.support.arrays import AnyArray, FloatArray

_STD = 0.05
"""Standard deviation of a cable's share of blue, green or red in two views.

Source: by hand; the white balance of two cameras differs by as much.
"""

_MOST_COST = 1.0
"""Largest cost of a difference, mean squared standard deviations of a point of the curve.

Source: by hand; two thirds of what keeps two curves apart, so that colour alone does not.
"""


def colour_costs(results: Sequence[FrameResult], frames: Sequence[Frame]) -> dict[tuple[int, int], FloatArray]:
    """Return for two views with images each the costs of pairing a detection of one with one of the other."""
    if any(frame.image is None for frame in frames) or all(len(result.detections) < 2 for result in results):
        return {}
    colours = []
    for result, frame in zip(results, frames, strict=True):
        assert frame.image is not None
        colours.append(np.array([_colour(one, frame.image) for one in result.detections]).reshape(-1, 3))
    costs = {}
    for first in range(len(colours)):
        for second in range(first + 1, len(colours)):
            apart = ((colours[first][:, None] - colours[second][None]) ** 2).sum(axis=2)
            costs[first, second] = np.minimum(apart / _STD**2, _MOST_COST)
    return costs


def _colour(detection: Detection, image: AnyArray) -> FloatArray:
    """Return the median shares of blue, green and red along a centre line."""
    points = detection.centerline.points
    columns, rows = np.rint(points[:: max(len(points) // 50, 1)]).astype(np.intp).T
    rows, columns = np.clip(rows, 0, image.shape[0] - 1), np.clip(columns, 0, image.shape[1] - 1)
    values = image[rows, columns].astype(np.float64) + 1.0
    shares: FloatArray = np.median(values / values.sum(axis=1, keepdims=True), axis=0)
    return shares
