"""The smooth line through noisy, interrupted and partly wrong values."""

from __future__ import annotations

import numpy as np
import pytest
from bounded import run_bounded
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from dloftbs.lifting.kernels.penalized_spline import smooth

N, SPANS = 120, 30
T = np.linspace(0.0, 1.0, N)
PRICES = 10.0 ** np.arange(-3.0, 5.0)


def literal(y: np.ndarray, counts: np.ndarray, spans: int, floor: float) -> tuple[np.ndarray, np.ndarray, float]:
    """The same with full matrices."""
    n, known = len(y), ~np.isnan(y)
    knots = np.arange(-3.0, spans + 4.0)
    place = np.minimum(np.arange(n) * spans / (n - 1), spans - 1e-12)
    basis = BSpline.design_matrix(place, knots, 3).toarray()
    prior = np.where(known, counts, 0.0)
    mean = (prior[known] * y[known]).sum() / prior.sum()
    value = np.where(known, y, mean) - mean
    bends = np.diff(np.eye(spans + 3), 2, axis=0)
    weight, price = prior.copy(), 4

    def fit(p: int) -> tuple[np.ndarray, float, float]:
        normal = basis.T @ (weight[:, None] * basis)
        inverse = np.linalg.inv(normal + PRICES[p] * weight.sum() / (spans + 3) * bends.T @ bends)
        line, freedom = basis @ inverse @ basis.T @ (weight * value), np.trace(inverse @ normal)
        free = weight.sum() / weight.max() - 1.2 * freedom
        return line, freedom, (weight * (value - line) ** 2).sum() / free**2 if free > 0 else np.inf

    for turn in range(6):
        if 2 <= turn < 5:
            scores = [fit(p)[2] for p in range(len(PRICES))]
            down = price
            while down > 0 and scores[down - 1] < scores[down]:
                down -= 1
            up = price + 1
            if up < len(PRICES) and scores[up] < scores[down]:
                while up + 1 < len(PRICES) and scores[up + 1] < scores[up]:
                    up += 1
                down = up
            price = down
        line, freedom, _ = fit(price)
        if turn == 5:
            break
        miss = np.abs(value - line) * np.sqrt(prior / (prior.sum() / known.sum()))
        miss /= max(np.median(miss[known]) / 0.6745, floor * abs(mean))
        weight = prior / np.maximum(miss, 1.0) if turn < 2 else prior * np.maximum(1 - (miss / 4.685) ** 2, 0) ** 2
    return line + mean, weight > 0, float(freedom)


def noisy(seed: int, sigma: float = 0.002) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a smooth line, what is measured of it, and of how many measurements each value is."""
    rng = np.random.default_rng(seed)
    true = 1.0 + rng.uniform(-0.2, 0.2) * T + rng.uniform(0.0, 0.05) * np.sin(rng.uniform(2.0, 10.0) * T)
    return true, true + rng.normal(0.0, sigma, N), rng.integers(3, 16, N).astype(float)


@given(st.integers(0, 2**31))
def test_it_agrees_with_the_literal_twin(seed: int) -> None:
    _, y, counts = noisy(seed)
    rng = np.random.default_rng(seed + 1)
    start = int(rng.integers(0, N - 20))
    y[start : start + int(rng.integers(0, 20))] = np.nan
    y[rng.random(N) < 0.1] += 0.1
    line, explained, freedom = smooth(y, counts, SPANS, 0.001)
    expected, kept, expected_freedom = literal(y, counts, SPANS, 0.001)
    np.testing.assert_allclose(line, expected, atol=1e-7)
    np.testing.assert_array_equal(explained, kept)
    assert freedom == pytest.approx(expected_freedom, abs=1e-5)


@given(st.integers(0, 2**31), st.floats(-2.0, 2.0), st.integers(2, 60))
def test_a_straight_line_comes_back_whatever_is_missing(seed: int, slope: float, known: int) -> None:
    rng = np.random.default_rng(seed)
    line = 3.0 + slope * T
    y = np.full(N, np.nan)
    chosen = rng.choice(N, known, replace=False)
    y[chosen] = line[chosen]
    found, explained, freedom = smooth(y, np.ones(N), SPANS, 1e-6)
    np.testing.assert_allclose(found, line, atol=1e-5)
    assert explained.sum() == known
    assert freedom >= 2.0 - 1e-6


def test_noise_is_smoothed_away() -> None:
    off, kept = [], []
    for seed in range(100):
        true, y, counts = noisy(seed, sigma=0.002)
        line, explained, _ = smooth(y, counts, SPANS, 0.0)
        off.append(np.sqrt(((line - true) ** 2).mean()))
        kept.append(explained.mean())
    assert np.mean(off) < 0.0007
    assert np.max(off) < 0.0017
    assert np.min(kept) > 0.9


@given(st.integers(0, 2**31), st.integers(10, 95), st.integers(1, 12), st.sampled_from([-0.04, 0.04]))
def test_gaps_are_bridged_and_single_outliers_do_not_count(seed: int, start: int, long: int, off: float) -> None:
    true, y, counts = noisy(seed)
    y[start : start + long] = np.nan
    rng = np.random.default_rng(seed + 1)
    wrong = rng.random(N) < 0.1
    y[wrong] += off
    line, explained, _ = smooth(y, counts, SPANS, 0.0)
    assert np.abs(line - true).max() < 0.02
    assert not explained[wrong].any()


@given(st.integers(0, 2**31))
def test_the_other_way_round_gives_the_same_line(seed: int) -> None:
    _, y, counts = noisy(seed)
    y[30:40] = np.nan
    forwards, backwards = smooth(y, counts, SPANS, 0.001), smooth(y[::-1], counts[::-1], SPANS, 0.001)
    np.testing.assert_allclose(forwards[0], backwards[0][::-1], atol=1e-8)


ENDLESS = """
import sys
import numpy as np
from dloftbs.lifting.kernels.penalized_spline import smooth

y = np.ones(30)
y[5] = float(sys.argv[1])
line, explained, _ = smooth(y, np.ones(30), 6, 0.01)
print(len(line), len(explained))
"""


@pytest.mark.parametrize("value", ["1e160", "-1e200", "1e308", "inf"])
def test_it_ends_whatever_the_scores_are(value: str) -> None:
    assert run_bounded(ENDLESS, value) == "30 30\n"
