"""Cables of a mask that is a probability which it alone would not show, where tracks are expected."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.data.curve_samples import sample_curve
from dloftbs.data.prediction import Prediction
from dloftbs.kernels.shared.soft_masks import HALF, LEAST_PROBABLE
from dloftbs.linking.kernels.soft_borders import ridge_values


def with_expected(soft: npt.NDArray[np.uint8], predicted: Sequence[Prediction]) -> npt.NDArray[np.uint8]:
    """Return a probability in which faint cables are as sure as others, where tracks are expected.

    A cable is there if the log-odds of its mask and of the existence of its track together are positive. Its values are
    scaled, so that its edge stays where it is.

    Parameters
    ----------
    soft : numpy.ndarray, shape (H, W), uint8
        The probability, of 256.
    predicted : sequence of Prediction

    Returns
    -------
    numpy.ndarray, shape (H, W), uint8
        `soft` itself where there is no such cable.
    """
    raised = soft
    for one in predicted:
        if one.width_px is None:
            continue
        points, _ = sample_curve(one.curve)
        value = float(np.median(ridge_values(points, soft, one.width_px)))
        if not LEAST_PROBABLE <= value < HALF or math.log(value / (256.0 - value)) + one.existence < 0.0:
            continue
        near = np.zeros(soft.shape, np.uint8)
        # Half a width of the cable and half a width by which the prediction lies beside its middle, on either side.
        cv2.polylines(near, [np.rint(points).astype(np.int32)], False, 255, max(round(2.0 * one.width_px), 1))
        raised = np.maximum(raised, cv2.convertScaleAbs(soft & near, alpha=255.0 / value))
    return raised
