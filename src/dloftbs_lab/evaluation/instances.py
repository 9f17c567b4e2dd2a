"""Scores of instance labels, pixel by pixel: images in which each object has a number and 0 is background."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from dloftbs.errors import InputError
from dloftbs.support.array_likes import as_array
from dloftbs.support.arrays import FloatArray


@dataclass(frozen=True)
class InstanceScore:
    """One true instance, and the found one that it was given.

    Parameters
    ----------
    true_label : int
    found_label : int or None
        None where no found instance was left that shares a pixel with it.
    dice : float
        0 to 1; 0 where nothing was found.
    """

    true_label: int
    found_label: int | None
    dice: float


@dataclass(frozen=True)
class DiceScore:
    """The instances of an image against the true ones.

    Parameters
    ----------
    instances : tuple of InstanceScore
        One for each true label, ascending.
    redundant : tuple of int
        The found labels that were given to no true instance, ascending.
    """

    instances: tuple[InstanceScore, ...]
    redundant: tuple[int, ...]

    @property
    def missing(self) -> tuple[int, ...]:
        """The true labels that were given no found one, ascending."""
        return tuple(instance.true_label for instance in self.instances if instance.found_label is None)

    @property
    def mean(self) -> float:
        """Mean DICE over the true instances, the missing ones with 0; NaN where there truly are none."""
        return float(np.mean([instance.dice for instance in self.instances])) if self.instances else math.nan


def dice(found_labels: npt.ArrayLike, true_labels: npt.ArrayLike) -> DiceScore:
    """Overlap of instances with the true ones, by the assignment of labels with the largest total.

    ``DICE(A, B) = 2 |A and B| / (|A| + |B|)`` for sets of pixels (Dice, 1945).

    Parameters
    ----------
    found_labels, true_labels : array_like, shape (H, W), bool or any integer type
        0 is background, every other value an instance; which value does not matter.

    Returns
    -------
    DiceScore

    Raises
    ------
    InputError
        If a shape or type is wrong, a label is negative, or the sizes differ.
    """
    found, true = _as_labels("found_labels", found_labels), _as_labels("true_labels", true_labels)
    if found.shape != true.shape:
        raise InputError(f"found_labels and true_labels must have the same size, got {found.shape} and {true.shape}")
    found_names, found_index = np.unique(found, return_inverse=True)
    true_names, true_index = np.unique(true, return_inverse=True)
    # Numpy 2.0 alone gives the inverse the image's shape.
    overlap = _overlap(true_index.ravel(), len(true_names), found_index.ravel(), len(found_names))
    return _assign(overlap, true_names, found_names)


def _as_labels(name: str, value: npt.ArrayLike) -> npt.NDArray[Any]:
    array = as_array(name, value)
    if array.ndim != 2:
        raise InputError(f"{name} must have shape (H, W), got {array.shape}")
    if array.dtype != np.bool_ and not np.issubdtype(array.dtype, np.integer):
        raise InputError(f"{name} must be bool or integer, got {array.dtype}")
    if array.size and array.min() < 0:
        raise InputError(f"{name} must not be negative, got {array.min()}")
    return array


def _overlap(rows: npt.NDArray[Any], row_count: int, columns: npt.NDArray[Any], column_count: int) -> FloatArray:
    """Return how many pixels have each pair of values, shape (row_count, column_count)."""
    pairs = np.bincount(rows * column_count + columns, minlength=row_count * column_count)
    return pairs.reshape(row_count, column_count).astype(np.float64)


def _assign(overlap: FloatArray, true_names: npt.NDArray[Any], found_names: npt.NDArray[Any]) -> DiceScore:
    areas = overlap.sum(axis=1)[:, None] + overlap.sum(axis=0)[None, :]
    inside = np.ix_(true_names != 0, found_names != 0)
    scores = 2.0 * overlap[inside] / areas[inside]
    true, found = ([int(label) for label in names if label] for names in (true_names, found_names))
    given = {
        true[i]: (found[j], float(scores[i, j]))
        for i, j in zip(*linear_sum_assignment(scores, maximize=True), strict=True)
        if scores[i, j] > 0.0
    }
    instances = tuple(InstanceScore(label, *given.get(label, (None, 0.0))) for label in true)
    taken = {instance.found_label for instance in instances}
    return DiceScore(instances, tuple(label for label in found if label not in taken))
