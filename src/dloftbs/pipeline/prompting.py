"""Prompts for segmenters from the predicted curves of tracks."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from dloftbs.data.curve import BSplineCurve, spans_by_length
from dloftbs.data.curve_samples import sample_curve
from dloftbs.data.prediction import Prediction
from dloftbs.data.prompt import Prompt
from dloftbs.data.spans import Spans, outside
from dloftbs.support.arrays import AnyArray, FloatArray

_POINTS = 8
"""Points on an object, and places beside it, at most.

Source: by hand; promptable networks are trained with a few clicks.
"""

_BESIDE_WIDTHS = 2.0
"""Distance of the points beside a curve from it, in widths of the object.

Source: by hand; a width and a half beyond the edge is ground, also where a prediction is a little off.
"""


def make_prompt(predicted: Sequence[Prediction], mask: AnyArray | None, size: tuple[int, int]) -> Prompt:
    """Return the prompt for an image.

    Parameters
    ----------
    predicted : sequence of Prediction
        In the image, px.
    mask : numpy.ndarray, shape (H, W), optional
        Of the last frame.
    size : (int, int)
        ``(H, W)`` of the image.
    """
    mask = None if mask is None or mask.shape != size else mask
    points, owner, negative = [], [], [np.empty((0, 2))]
    boxes: list[FloatArray] = []
    every = _everything(predicted)
    for one in predicted:
        seen = spans_by_length(one.curve, outside((*one.unseen, *one.inferred)))
        if not seen or one.width_px is None:
            continue
        at = _spread(seen)
        on = one.curve(at)
        is_within = _are_within(on, size)
        if not is_within.any():
            continue
        points.append(on[is_within])
        owner.append(np.full(int(is_within.sum()), len(boxes)))
        boxes.append(_box(one.curve, seen, one.width_px, size))
        beside = _beside(one.curve, at, one.width_px)
        beside = beside[_are_within(beside, size)]
        beside = beside[every.query(beside)[0] > one.width_px]
        negative.append(beside if mask is None else beside[_values_at(mask, beside) == 0])
    if not boxes:
        return Prompt(mask=mask)
    return Prompt(np.concatenate(points), np.concatenate(owner), np.concatenate(negative), np.stack(boxes), mask)


def _everything(predicted: Sequence[Prediction]) -> cKDTree:
    """Return points along all curves, hidden parts included, no farther apart than their width."""
    samples = [np.empty((0, 2))]
    for one in predicted:
        count = 2 + math.ceil(one.curve.length / max(one.width_px or 1.0, 1.0))
        samples.append(sample_curve(one.curve, count=count)[0])
    return cKDTree(np.concatenate(samples))


def _spread(spans: Spans) -> FloatArray:
    """Return the middles of equal parts of what is left of a curve."""
    low, high = np.array(spans).T
    ends = np.cumsum(high - low)
    at = (np.arange(_POINTS) + 0.5) / _POINTS * ends[-1]
    which = np.searchsorted(ends, at)
    spread: FloatArray = high[which] - (ends[which] - at)
    return spread


def _beside(curve: BSplineCurve, at: FloatArray, width_px: float) -> FloatArray:
    """Return points beside a curve, on either side in turn."""
    across = curve.tangent(at)[:, ::-1] * (1.0, -1.0)
    sides = np.where(np.arange(len(at)) % 2, -1.0, 1.0)[:, None]
    beside: FloatArray = curve(at) + _BESIDE_WIDTHS * width_px * sides * across
    return beside


def _box(curve: BSplineCurve, spans: Spans, width_px: float, size: tuple[int, int]) -> FloatArray:
    """Return the box around parts of a curve, with half the width on all sides, as far as it lies in the image."""
    parts = [curve(np.linspace(low, high, 2 + int((high - low) * curve.length))) for low, high in spans]
    points = np.concatenate(parts)
    corners = np.stack((points.min(axis=0) - 0.5 * width_px, points.max(axis=0) + 0.5 * width_px))
    return np.clip(corners, 0.0, np.array(size[::-1]) - 1.0).ravel()


def _are_within(points: FloatArray, size: tuple[int, int]) -> AnyArray:
    return np.asarray(((points >= 0.0) & (points <= np.array(size[::-1]) - 1.0)).all(axis=1))


def _values_at(mask: AnyArray, points: FloatArray) -> AnyArray:
    """Return the values of a mask at the pixels of points within it."""
    columns, rows = np.rint(points).astype(np.intp).T
    return np.asarray(mask[rows, columns])
