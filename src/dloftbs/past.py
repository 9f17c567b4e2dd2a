"""What was seen before, as far as the linking of the next frame makes use of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.curve import BSplineCurve
from dloftbs.kernels.continuity import follow
from dloftbs.patch import Patch

_STEP_WIDTHS = 0.5
_MOST_SAMPLES = 2000  # of a curve


@dataclass(frozen=True, eq=False)
class Past:
    """Where curves are expected, in the pose of a patch.

    Parameters
    ----------
    points, tangents : numpy.ndarray, shape (m, 2)
        Evenly spaced samples of all curves, one after the other, and directions of length 1.
    first : numpy.ndarray, shape (c + 1,)
        Where the samples of each curve start.
    steps : numpy.ndarray, shape (c,)
        From sample to sample, px.
    closed : numpy.ndarray, shape (c,)
    trust : numpy.ndarray, shape (c,)
        In 0..1.
    """

    points: FloatArray
    tangents: FloatArray
    first: npt.NDArray[np.int64]
    steps: FloatArray
    closed: npt.NDArray[np.bool_]
    trust: FloatArray

    @classmethod
    def of(cls, expected: Sequence[tuple[BSplineCurve, float]], patch: Patch, width: float) -> Past:
        """Sample curves in the image, each with its trust, for cables of a width in px."""
        points, tangents, steps = [], [], []
        for curve, _ in expected:
            # The polygon of the control points is somewhat longer than the curve, and at hand.
            about = float(np.hypot(*np.diff(curve.control_points, axis=0).T).sum())
            count = min(max(math.ceil(about / (_STEP_WIDTHS * width)), 8), _MOST_SAMPLES)
            posed = patch.to_posed(curve.sample(count))
            along = np.empty_like(posed)
            along[1:-1] = posed[2:] - posed[:-2]
            along[0], along[-1] = posed[1] - posed[0], posed[-1] - posed[-2]
            length = np.hypot(along[:, 0], along[:, 1])
            points.append(posed)
            tangents.append(along / np.maximum(length, 1e-9)[:, None])
            steps.append(float(length[1:-1].sum() + length[0] + length[-1]) / (2 * (count - 1)))
        return cls(
            np.concatenate(points),
            np.concatenate(tangents),
            np.cumsum([0, *map(len, points)]),
            np.array(steps),
            np.array([curve.closed for curve, _ in expected], np.bool_),
            np.array([trust for _, trust in expected], np.float64),
        )

    def continuity(
        self, arms: FloatArray, rows: npt.NDArray[np.int64], columns: npt.NDArray[np.int64], width: float
    ) -> FloatArray:
        """Return how well pairs of ends continue each other along one of the curves, each in 0..1."""
        return follow(
            arms, rows, columns, self.points, self.tangents, self.first, self.steps, self.closed, self.trust, width
        )
