"""The model: the odds of a reading are e to the power of the weighted sum of what is measured of it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from benchmarks.fit_linking.readings import Choice, Floats
from dloftbs.linking.kernels.joint_features import GAP_SEEN, OTHER_COLOUR
from dloftbs.linking.kernels.weights import JOINT, OPEN

ALWAYS_HELD = (OTHER_COLOUR, GAP_SEEN)
"""Columns whose weights are not fitted here: one is counted, the other one is that of log-odds."""

_PRIOR_SD = 10.0  # of a weight times the root mean square of its column, nats: it keeps unused columns at 0
_MAX_WEIGHT = 3.0  # of a choice of a small source
_WORTH = {"hidden": 3.0, "masks": 4.0}
"""How much more some sources count: a balance, by hand, between gaps that one cable goes on behind and ends of two."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Weights, nats a unit of each column, and their standard deviations, 0 for those that are not fitted."""

    weights: Floats
    deviations: Floats


class Choices:
    """Choices as one array, the readings of each in a row."""

    def __init__(self, choices: Sequence[Choice]) -> None:
        self.rows = np.concatenate([choice.rows for choice in choices])
        counts = np.array([len(choice.rows) for choice in choices])
        self.first = np.concatenate(([0], np.cumsum(counts)[:-1]))
        self.of = np.repeat(np.arange(len(choices)), counts)
        self.true = self.first + np.array([choice.true for choice in choices])

    def probabilities(self, weights: Floats) -> Floats:
        """Return the probability of each reading among those of its choice."""
        score = -(self.rows @ weights)
        score -= np.maximum.reduceat(score, self.first)[self.of]
        odds = np.exp(score)
        shares: Floats = odds / np.add.reduceat(odds, self.first)[self.of]
        return shares


def balance(names: Sequence[str]) -> Floats:
    """Return the weight of each item of a source: sources count alike, as far as they have enough."""
    counts = {name: names.count(name) for name in set(names)}
    even = len(names) / len(counts)
    return np.array([min(even / counts[name], _MAX_WEIGHT) * _WORTH.get(name, 1.0) for name in names])


def fit(choices: Sequence[Choice], held: Collection[int] = ALWAYS_HELD) -> Fit:
    """Return the weights under which the true readings are the most probable; some columns keep those in use."""
    all_of, worth = Choices(choices), balance([choice.source for choice in choices])
    scale = np.sqrt((all_of.rows**2).mean(axis=0))
    scale[scale == 0.0] = np.inf  # the weight of a column that is not used is 0
    rows, prior = all_of.rows / scale, 1.0 / _PRIOR_SD**2

    def loss(scaled: Floats) -> tuple[float, Floats]:
        shares = all_of.probabilities(scaled / scale)
        expected = np.add.reduceat(shares[:, None] * rows, all_of.first)
        value = -(worth * np.log(np.maximum(shares[all_of.true], 1e-300))).sum() + 0.5 * prior * (scaled @ scaled)
        return float(value), (worth[:, None] * (rows[all_of.true] - expected)).sum(axis=0) + prior * scaled

    start = np.ones(rows.shape[1])
    bounds: list[tuple[float | None, float | None]] = [(None, None)] * len(start)
    in_use = np.concatenate((JOINT, OPEN))
    for column in held:
        start[column] = in_use[column] * scale[column] if np.isfinite(scale[column]) else 0.0
        bounds[column] = start[column], start[column]
    found = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 3000}).x
    shares = all_of.probabilities(found / scale)
    expected = np.add.reduceat(shares[:, None] * rows, all_of.first)
    spread = rows - expected[all_of.of]
    curvature = (spread * (shares * worth[all_of.of])[:, None]).T @ spread + prior * np.eye(len(scale))
    free, deviations = np.setdiff1d(np.arange(len(scale)), list(held)), np.zeros(len(scale))
    deviations[free] = np.sqrt(np.diag(np.linalg.inv(curvature[np.ix_(free, free)]))) / scale[free]
    weights = found / scale
    weights[list(held)] = in_use[list(held)]
    return Fit(weights, deviations)


def count_wrong(choices: Sequence[Choice], weights: Floats) -> int:
    """Return in how many choices the best reading is not the true one."""
    return sum(int(np.argmin(choice.rows @ weights)) != choice.true for choice in choices)


def mean_loss(choices: Sequence[Choice], weights: Floats) -> float:
    """Return the mean of minus the logarithm of the true reading's probability, nats."""
    every = Choices(choices)
    return float(-np.log(np.maximum(every.probabilities(weights)[every.true], 1e-300)).mean())
