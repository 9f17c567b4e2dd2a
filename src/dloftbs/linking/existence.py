"""The probability that an object of a mask is a cable at all, and no debris or error of the segmentation."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from dloftbs.data.centerline import Centerline
from dloftbs.data.curve_samples import sample_curve
from dloftbs.data.prediction import Prediction
from dloftbs.linking.existence_weights import AREA
from dloftbs.linking.joint_confidence import EDGE_PX
from dloftbs.linking.temporal_prior import MAX_SAMPLES

_PLACES = 5
"""Number of places of an object that must lie on a predicted curve for it to be expected there.

Source: by definition; both ends, the middle, and half-way between.
"""


def with_existence(lines: Sequence[Centerline]) -> list[Centerline]:
    """Return the centre lines of a frame, each with the probability that it is a cable.

    Debris is small, and so are the errors of a segmentation. An object is judged by its area as a share of the largest
    one's, which is a cable for sure as nothing in a mask speaks against it.
    """
    areas = [area_of(line) for line in lines]
    largest = max(areas, default=0.0)
    return [
        line if area == largest else line._with_existence(existence_of(area / largest))
        for line, area in zip(lines, areas, strict=True)
    ]


def area_of(line: Centerline) -> float:
    """Return the area of an object, px²: its pixels along the way, times its width up to the middle of its edges."""
    return sum(map(len, line.segments)) * (line.width_px + EDGE_PX)


def existence_of(share: float) -> float:
    """Return the probability that an object with this share of the largest one's area is a cable."""
    if share <= 0.0:
        return 0.0
    none, per_log = AREA
    return 1.0 / (1.0 + math.exp(-(none + per_log * math.log(share))))


def expectation_of(line: Centerline, predicted: Iterable[Prediction]) -> float:
    """Return the confidence of the surest predicted curve that an object lies along, within a width; 0 if along none.

    What is left in sight of a hidden cable may be as small as debris.
    """
    places = line.points[np.rint(np.linspace(0, len(line.points) - 1, _PLACES)).astype(np.int64)]
    surest = 0.0
    for one in predicted:
        width = max(line.width_px if one.width_px is None else one.width_px, EDGE_PX)
        count = min(max(int(2.0 * one.curve.length / width), 2), MAX_SAMPLES)
        points, _ = sample_curve(one.curve, 0.0, 1.0, count)
        distances = np.linalg.norm(places[:, None] - points, axis=2).min(axis=1)
        if distances.max() <= width:
            surest = max(surest, one.confidence)
    return surest
