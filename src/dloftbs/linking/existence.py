"""The probability that an object of a mask is a cable at all, and no debris or error of the segmentation."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from dloftbs.data.centerline import Centerline
from dloftbs.data.curve_samples import sample_curve
from dloftbs.data.prediction import Prediction
from dloftbs.linking.existence_weights import SIZE
from dloftbs.linking.joint_confidence import EDGE_PX
from dloftbs.linking.temporal_prior import MAX_SAMPLES
from dloftbs.support.arrays import FloatArray
from dloftbs.support.values import varied

_PLACES = 5
"""Number of places of an object that must lie on a predicted curve for it to be expected there.

Source: by definition; both ends, the middle, and half-way between.
"""


def with_existence(lines: Sequence[Centerline]) -> list[Centerline]:
    """Return the centre lines of a frame, each with the probability that it is a cable.

    Debris is small, and so are the errors of a segmentation. An object is judged by its size as a share of the largest
    one's, which is a cable for sure as nothing in a mask speaks against it.
    """
    sizes = [size_of(line) for line in lines]
    largest = max(sizes, default=0.0)
    return [
        line if size == largest else varied(line, existence=existence_of(size / largest))
        for line, size in zip(lines, sizes, strict=True)
    ]


def size_of(line: Centerline) -> float:
    """Return the size of an object, px²: the diagonal of its box, times its width up to the middle of its edges.

    A long cable that lies in a coil is no larger than the place that it takes: what lies beside it is no debris.
    """
    width, height = np.ptp(line.points, axis=0).tolist()
    return (math.hypot(width, height) + EDGE_PX) * (line.width_px + EDGE_PX)


def existence_of(share: float) -> float:
    """Return the probability that an object with this share of the largest one's size is a cable."""
    if share <= 0.0:
        return 0.0
    none, per_log = SIZE
    return 1.0 / (1.0 + math.exp(-(none + per_log * math.log(share))))


def expectations_of(lines: Sequence[Centerline], predicted: Iterable[Prediction]) -> list[float]:
    """Return for each object the confidence of the surest predicted curve that it lies along; 0 if along none.

    What is left in sight of a hidden cable may be as small as debris.
    """
    surest = [0.0] * len(lines)
    for one in predicted if lines else ():
        width = max(one.width_px or 0.0, EDGE_PX)
        count = min(max(int(2.0 * one.curve.length / width), 2), MAX_SAMPLES)
        points, _ = sample_curve(one.curve, 0.0, 1.0, count)
        for k, line in enumerate(lines):
            if one.confidence > surest[k] and _lies_along(line, points, max(width, line.width_px)):
                surest[k] = one.confidence
    return surest


def _lies_along(line: Centerline, points: FloatArray, width: float) -> bool:
    """Return whether places of an object all lie within a width of a curve, given points (m, 2) on it."""
    own = line.points
    if np.abs(points - own[len(own) // 2]).max(axis=1).min() > width:  # of most, the middle shows that they do not
        return False
    places = own[np.rint(np.linspace(0, len(own) - 1, _PLACES)).astype(np.int64)]
    return bool(np.linalg.norm(places[:, None] - points, axis=2).min(axis=1).max() <= width)
