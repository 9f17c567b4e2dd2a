"""The smooth line through noisy, interrupted and partly wrong values."""

from __future__ import annotations

import numpy as np
import pytest
from bounded import run_bounded
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from dloftbs.lifting.kernels.penalized_spline import deviation_of_line, smooth

N, SPANS = 120, 30
T = np.linspace(0.0, 1.0, N)
PRICES = 10.0 ** np.arange(-3.0, 7.0)
FIRST = 5
HUBER = 2.0


def literal_miss(own: np.ndarray, value: np.ndarray, k: int) -> float:
    """Return how far a known value is from what those around it tell, `own` being the places of the known ones."""
    reach = min(4, k, len(own) - 1 - k)
    if reach >= 2:
        return abs(value[k] - np.median(value[k - reach : k + reach + 1]))
    end = slice(0, 9) if k < len(own) - 1 - k else slice(max(len(own) - 9, 0), None)
    place, level = own[end] - own[k], value[end]
    apart = len(place) // 2
    slope = np.median((level[apart:] - level[: len(level) - apart]) / (place[apart:] - place[: len(place) - apart]))
    return abs(value[k] - np.median(level - slope * place))


def literal(y: np.ndarray, counts: np.ndarray, spans: int, floor: float) -> tuple[np.ndarray, float]:
    """The same with full matrices."""
    n, known = len(y), ~np.isnan(y)
    own, count = np.flatnonzero(known), counts[known]
    mean = (count * y[known]).sum() / count.sum()
    value = np.where(known, y, mean) - mean
    miss = np.array([literal_miss(own, value[own], k) for k in range(len(own))]) * np.sqrt(count / count.mean())
    scale = max(np.median(miss) / 0.6745, floor * abs(mean))
    weight = np.zeros(n)
    weight[own] = count if scale == 0.0 else count / np.maximum(miss / (HUBER * scale), 1.0)

    place = np.minimum(np.arange(n) * spans / (n - 1), spans - 1e-12)
    basis = BSpline.design_matrix(place, np.arange(-3.0, spans + 4.0), 3).toarray()
    bends = np.diff(np.eye(spans + 3), 2, axis=0)
    normal = basis.T @ (weight[:, None] * basis)

    def fit(p: int) -> tuple[float, np.ndarray, float]:
        inverse = np.linalg.inv(normal + PRICES[p] * weight.sum() / (spans + 3) * bends.T @ bends)
        line, freedom = basis @ inverse @ basis.T @ (weight * value), np.trace(inverse @ normal)
        free = weight.sum() / weight.max() - 1.2 * freedom
        return (weight * (value - line) ** 2).sum() / free**2 if free > 0 else np.inf, line, freedom

    fits = [fit(p) for p in range(len(PRICES))]
    best = FIRST
    while best > 0 and fits[best - 1][0] < fits[best][0]:
        best -= 1
    while best >= FIRST and best + 1 < len(PRICES) and fits[best + 1][0] < fits[best][0]:
        best += 1
    _, line, freedom = fits[best]
    return line + mean, float(freedom)


def noisy(seed: int, sigma: float = 0.002) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a smooth line, what is measured of it, and of how many measurements each value is."""
    rng = np.random.default_rng(seed)
    true = 1.0 + rng.uniform(-0.2, 0.2) * T + rng.uniform(0.0, 0.05) * np.sin(rng.uniform(2.0, 10.0) * T)
    return true, true + rng.normal(0.0, sigma, N), rng.integers(3, 16, N).astype(float)


@given(st.integers(0, 2**31), st.sampled_from([0.0, 0.001, 0.1]))
def test_it_agrees_with_the_literal_twin(seed: int, floor: float) -> None:
    _, y, counts = noisy(seed)
    rng = np.random.default_rng(seed + 1)
    start = int(rng.integers(0, N - 20))
    y[start : start + int(rng.integers(0, 20))] = np.nan
    y[rng.random(N) < rng.choice([0.0, 0.3, 0.9])] = np.nan
    y[rng.choice(N, 4, replace=False)] = 1.0  # enough to be a line
    y[rng.random(N) < 0.1] += 0.1
    line, freedom = smooth(y, counts, SPANS, floor)
    expected, expected_freedom = literal(y, counts, SPANS, floor)
    np.testing.assert_allclose(line, expected, atol=1e-7)
    assert freedom == pytest.approx(expected_freedom, abs=1e-5)


@given(st.integers(0, 2**31), st.floats(-2.0, 2.0), st.integers(2, 60))
def test_a_straight_line_comes_back_whatever_is_missing(seed: int, slope: float, known: int) -> None:
    rng = np.random.default_rng(seed)
    line = 3.0 + slope * T
    y = np.full(N, np.nan)
    chosen = rng.choice(N, known, replace=False)
    y[chosen] = line[chosen]
    found, freedom = smooth(y, np.ones(N), SPANS, 1e-6)
    np.testing.assert_allclose(found, line, atol=1e-5)
    assert freedom >= 2.0 - 1e-6


def test_noise_is_smoothed_away() -> None:
    off = []
    for seed in range(100):
        true, y, counts = noisy(seed, sigma=0.002)
        line, _ = smooth(y, counts, SPANS, 0.0)
        off.append(np.sqrt(((line - true) ** 2).mean()))
    assert np.mean(off) < 0.0007
    assert np.max(off) < 0.0017


def test_the_more_a_line_bends_the_more_parameters_it_has() -> None:
    noise = np.random.default_rng(0).normal(0.0, 0.001, (30, N))
    freedoms = []
    for waves in (0.0, 1.0, 3.0, 6.0):
        line = 1.0 + 0.1 * np.sin(2.0 * np.pi * waves * T)
        freedoms.append(np.median([smooth(line + one, np.ones(N), SPANS, 0.0)[1] for one in noise]))
    assert freedoms[0] == pytest.approx(2.0, abs=0.5)
    assert (np.diff(freedoms) > 3.0).all()


@given(st.integers(0, 2**31), st.integers(10, 95), st.integers(1, 12))
def test_gaps_are_bridged(seed: int, start: int, long: int) -> None:
    true, y, counts = noisy(seed)
    y[start : start + long] = np.nan
    line, _ = smooth(y, counts, SPANS, 0.0)
    assert np.abs(line - true).max() < 0.02


@pytest.mark.parametrize(("off", "pull"), [(0.04, 0.008), (-0.04, 0.008), (1.0, 0.02), (-1.0, 0.02), (100.0, 0.08)])
def test_single_outliers_hardly_matter_however_far_off_they_are(off: float, pull: float) -> None:
    for seed in range(200):
        true, y, counts = noisy(seed)
        without, _ = smooth(y, counts, SPANS, 0.0)
        y[int(np.random.default_rng(seed + 1).integers(0, 12)) :: 12] += off  # now and then the first one, or the last
        line, _ = smooth(y, counts, SPANS, 0.0)
        assert np.abs(line - without).max() < pull
        assert np.abs(line - true).max() < pull + 0.005


@pytest.mark.parametrize("slope", [0.0, 1.0, 5.0, 20.0, 50.0])
def test_a_slope_is_as_good_as_any(slope: float) -> None:
    true, off = 1.0 + slope * T, []
    for seed in range(100):
        line, _ = smooth(true + np.random.default_rng(seed).normal(0.0, 0.002, N), np.ones(N), SPANS, 0.0)
        off.append(np.sqrt(((line - true) ** 2).mean()))
    assert np.mean(off) < 0.0004
    assert np.max(off) < 0.0012


@pytest.mark.parametrize("slope", [-5.0, -2.0, 2.0, 5.0])
@pytest.mark.parametrize("ease", [0.03, 0.1])
def test_a_bend_into_a_steep_slope_is_followed(slope: float, ease: float) -> None:
    """Neither the level part, as the larger one, nor the steep one is taken for wrong."""
    for seed in range(30):
        rng = np.random.default_rng(seed)
        true = 1.0 + slope * ease * np.logaddexp(0.0, (T - rng.uniform(0.3, 0.8)) / ease)
        line, _ = smooth(true + rng.normal(0.0, 0.002, N), np.ones(N), SPANS, 0.001)
        assert np.abs(line - true).max() < 0.006


@given(st.integers(0, 2**31))
def test_the_other_way_round_gives_the_same_line(seed: int) -> None:
    _, y, counts = noisy(seed)
    y[30:40] = np.nan
    forwards, backwards = smooth(y, counts, SPANS, 0.001), smooth(y[::-1], counts[::-1], SPANS, 0.001)
    np.testing.assert_allclose(forwards[0], backwards[0][::-1], atol=1e-8)
    assert forwards[1] == pytest.approx(backwards[1])


ENDLESS = """
import sys
import numpy as np
from dloftbs.lifting.kernels.penalized_spline import deviation_of_line, smooth

y = np.ones(30)
y[5] = float(sys.argv[1])
line, freedom = smooth(y, np.ones(30), 6, 0.01)
print(len(line), freedom > 0.0)
"""


@pytest.mark.parametrize("value", ["1e160", "-1e200", "1e308", "inf"])
def test_it_ends_whatever_the_scores_are(value: str) -> None:
    assert run_bounded(ENDLESS, value) == "30 True\n"


def literal_deviation(y: np.ndarray, line: np.ndarray, seen: np.ndarray, freedom: float) -> float:
    off = np.where(seen, y - line, np.nan)
    alike = 1.0
    for lag in range(1, len(y)):
        products = off[lag:] * off[:-lag]
        own = products[np.isfinite(products)]
        if not own.sum() > 0.0:
            break
        alike += 2.0 * own.mean() / np.nanmean(off**2)
    return np.nanmean(np.abs(off)) / 0.7979 * np.sqrt(alike * freedom / seen.sum())


@given(st.integers(0, 2**32 - 1))
def test_the_deviation_of_a_line_is_that_of_the_slow_twin(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 80))
    y = np.convolve(rng.normal(size=n + 4), np.ones(5) if seed % 2 else [0, 0, 1, 0, 0], "valid")
    seen = rng.random(n) < rng.choice((0.3, 0.9, 1.0))
    seen[int(rng.integers(n))] = True
    y[~seen & (rng.random(n) < 0.5)] = np.nan
    line = 0.1 * rng.normal(size=n)
    assert deviation_of_line(y, line, seen, 5.0) == pytest.approx(literal_deviation(y, line, seen, 5.0), rel=1e-9)


def test_a_line_that_goes_through_all_values_has_no_deviation():
    assert deviation_of_line(T, T, np.ones(N, dtype=np.bool_), 4.0) == 0.0


@pytest.mark.parametrize("grain", [0.0, 0.5])
def test_the_deviation_of_a_line_is_that_of_its_errors(grain):
    """Neighbours err alike by the sigma of a Gaussian; where they do so more, the line follows them."""
    taps = np.exp(-0.5 * (np.arange(-8, 9) / max(grain, 1e-3)) ** 2)
    taps /= np.linalg.norm(taps)
    rng, true = np.random.default_rng(5), 1.0 + 0.2 * np.sin(5.0 * T)
    errors, stated = [], []
    for _ in range(200):
        y = true + 0.01 * np.convolve(rng.normal(size=N + 16), taps, "valid")
        line, freedom = smooth(y, np.ones(N), SPANS, 0.0)
        errors.append(np.mean((line - true) ** 2))
        stated.append(deviation_of_line(y, line, np.ones(N, dtype=np.bool_), freedom) ** 2)
    assert 0.75 < np.sqrt(np.mean(stated) / np.mean(errors)) < 1.25
