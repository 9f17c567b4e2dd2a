"""The probability that an object of a soft mask is real: how sure the mask is along it, its width and its length."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dloftbs.data.centerline import Centerline
from dloftbs.linking.soft_existence_weights import IS_REAL
from dloftbs.support.arrays import ByteArray, FloatArray
from dloftbs.support.values import varied

_LEAST_SURE = 0.1
"""Share of an object's axis on which the mask is less sure than the value that counts, of the whole axis.

Source: by hand; one hole does not count, a stretch does.
"""

_LEAST_RADIUS_PX = 0.5
"""Least mean radius that a width's deviation is a share of, px.

Source: numerics; no line of pixels is thinner.
"""

_STEADY, _SHORT = 0.05, 0.01
"""Deviation of a width as a share of it, and length as a share of the image's diagonal, that are as good as none.

Source: numerics; the logarithm diverges at 0.
"""


def with_soft_existence(lines: Sequence[Centerline], soft: ByteArray) -> list[Centerline]:
    """Return centre lines whose existence takes a soft mask (H, W) into account."""
    found = []
    for line in lines:
        log_odds = float(reality_features(line, soft) @ np.array(IS_REAL))
        found.append(varied(line, existence=line.existence / (1.0 + math.exp(-log_odds))))
    return found


def reality_features(line: Centerline, soft: ByteArray) -> FloatArray:
    """Return what says whether an object is real, shape (4,).

    These are 1, the log-odds of the mask's least sure tenth along the axis, the logarithm of the standard deviation of
    the width as a share of the width, and that of the length as a share of the image's diagonal.
    """
    rows, columns = (np.clip(np.rint(line.points[:, k]), 0, soft.shape[1 - k] - 1).astype(np.intp) for k in (1, 0))
    values, tenth = soft[rows, columns], int(_LEAST_SURE * len(rows))
    least = float(np.partition(values, tenth)[tenth])  # faster than a quantile
    unsteady = float(np.std(line.radius) / max(float(np.mean(line.radius)), _LEAST_RADIUS_PX))
    length = len(line.points) / math.hypot(*soft.shape)
    return np.array(
        [1.0, math.log((least + 1.0) / (256.0 - least)), math.log(unsteady + _STEADY), math.log(length + _SHORT)]
    )
