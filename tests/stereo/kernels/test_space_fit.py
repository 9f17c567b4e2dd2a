"""The fit in space: dense linear algebra is the slow twin of the bands."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline
from stereo_views import BENT, beside

from dloftbs.stereo.kernels.band_equations import BAND
from dloftbs.stereo.kernels.compare_widths import compare_widths
from dloftbs.stereo.kernels.deviations import deviations
from dloftbs.stereo.kernels.observations import CLEAR, COLUMNS, DEPTH, RADIUS, WEIGHT
from dloftbs.stereo.kernels.space_fit import fit_views
from dloftbs.stereo.kernels.start_curve import start_curve
from dloftbs.stereo.space_fit import _basis

N = 12
KNOTS, ROUGHNESS = _basis(N)
POSES = (np.eye(4), np.linalg.inv(beside(0.1, 0.1)))
ROTATIONS, SHIFTS = np.stack([pose[:3, :3] for pose in POSES]), np.stack([pose[:3, 3] for pose in POSES])
FOCAL_PX = 300.0


def observations(noise_px: float = 0.0, seed: int = 0, count: int = 150):
    """Return places, rows and views of what two views see of a curve."""
    rng = np.random.default_rng(seed)
    t, rows, views = [], [], []
    for view in range(2):
        index = np.linspace(0, len(BENT) - 1, count).astype(int)
        seen = BENT @ ROTATIONS[view].T + SHIFTS[view]
        flat = seen[:, :2] / seen[:, 2:]
        tangent = np.gradient(flat, axis=0)[index]
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        normal = np.stack((-tangent[:, 1], tangent[:, 0]), axis=1)
        at = flat[index] + normal * rng.normal(0.0, noise_px / FOCAL_PX, (count, 1))
        weight = np.full((count, 1), (FOCAL_PX / max(noise_px, 0.1)) ** 2)
        wide = 0.006 / seen[index, 2:]
        rows.append(np.hstack((at, normal, weight, wide, np.ones((count, 1)), np.zeros((count, 2)))))
        t.append(index / (len(BENT) - 1))
        views.append(np.full(count, view))
    return np.concatenate(t), np.concatenate(rows), np.concatenate(views)


def fitted(t, rows, views, prior=1e-3):
    start = np.linspace(BENT[0], BENT[-1], N) + np.array([0.0, 0.0, 0.02])
    control, factor = start.copy(), np.empty((3 * N, BAND))
    residuals, depths = np.empty(len(t)), np.empty(len(t))
    assert fit_views(
        control, KNOTS, t, rows, views, ROTATIONS, SHIFTS, ROUGHNESS, prior, 1.0, 30, residuals, depths, factor
    )
    return control, factor, residuals, depths


def test_a_curve_is_found_from_afar():
    control, _, residuals, depths = fitted(*observations())
    points = BSpline(KNOTS, control, 3)(np.linspace(0, 1, 50))
    apart = np.sqrt(((points[:, None] - BENT[None]) ** 2).sum(axis=2)).min(axis=1)
    assert np.median(apart) < 1e-3
    assert apart.max() < 4e-3
    assert np.abs(residuals).max() * FOCAL_PX < 0.3
    assert depths.min() > 0.5


def test_the_deviation_is_that_of_the_dense_inverse_and_of_many_draws():
    t, rows, views = observations(0.3)
    control, factor, _, _ = fitted(t.copy(), rows, views)
    calm = np.zeros(len(t))
    lower = np.zeros((3 * N, 3 * N))
    for k in range(BAND):
        lower[np.arange(k, 3 * N), np.arange(3 * N - k)] = factor[: 3 * N - k, k]
    dense = np.linalg.inv(lower @ lower.T)
    std = deviations(control, KNOTS, t, rows, views, calm, ROTATIONS, SHIFTS, np.zeros(2), 0.0, factor, 21)
    at = np.linspace(0, 1, 21)
    spline = BSpline(KNOTS, control, 3)
    for place, found in zip(at, std, strict=True):
        weights = BSpline(KNOTS, np.eye(N), 3)(min(place, 1 - 1e-12))
        basis = np.concatenate([weight * np.eye(3) for weight in weights], axis=1)
        covariance = basis @ dense @ basis.T
        tangent = spline(place, 1) / np.linalg.norm(spline(place, 1))
        assert found == pytest.approx(np.sqrt(np.trace(covariance) - tangent @ covariance @ tangent), rel=1e-6)
    draws = []
    for seed in range(40):
        again, _, _, _ = fitted(*observations(0.3, seed))
        moved = BSpline(KNOTS, again, 3)(at) - spline(at)
        tangent = spline(at, 1) / np.linalg.norm(spline(at, 1), axis=1)[:, None]
        draws.append(moved - (moved * tangent).sum(axis=1)[:, None] * tangent)
    spread = np.sqrt(np.array(draws).var(axis=0).sum(axis=1))
    assert np.median(std[2:-2] / spread[2:-2]) == pytest.approx(1.0, abs=0.25)


def test_errors_of_the_rig_add_up():
    t, rows, views = observations(0.3)
    control, factor, _, _ = fitted(t, rows, views)
    given = control, KNOTS, t, rows, views, np.zeros(len(t)), ROTATIONS, SHIFTS
    plain = deviations(*given, np.zeros(2), 0.0, factor, 11)
    turned = deviations(*given, np.zeros(2), 0.01, factor, 11)
    twice = deviations(*given, np.zeros(2), 0.02, factor, 11)
    assert np.allclose(twice**2 - plain**2, 4.0 * (turned**2 - plain**2))
    assert (turned > plain).all()


def test_residuals_beyond_their_noise_make_the_deviation_as_much_larger_there():
    t, rows, views = observations(0.3)
    control, factor, _, _ = fitted(t, rows, views)
    given = KNOTS, t, rows, views
    residuals = np.where(t < 0.3, 3.0, 0.5) / np.sqrt(rows[:, WEIGHT])
    calm = deviations(control, *given, np.zeros(len(t)), ROTATIONS, SHIFTS, np.zeros(2), 0.0, factor, 11)
    found = deviations(control, *given, residuals, ROTATIONS, SHIFTS, np.zeros(2), 0.0, factor, 11)
    assert found[0] == pytest.approx(3.0 * calm[0])
    assert np.array_equal(found[5:], calm[5:])


def test_a_depth_is_an_observation():
    t, rows, views = observations()
    level = views == 0
    measured = np.zeros((20, COLUMNS))
    index = np.linspace(0, len(BENT) - 1, 20).astype(int)
    measured[:, :2] = BENT[index, :2] / BENT[index, 2:]
    measured[:, DEPTH], measured[:, WEIGHT] = BENT[index, 2], 1.0 / 0.001**2
    one_view = t[level], rows[level], views[level]
    alone = fitted(*one_view)[0]
    at = np.concatenate((t[level], index / (len(BENT) - 1)))
    both = fitted(at, np.concatenate((rows[level], measured)), np.zeros(len(at), np.int64))[0]
    for control, least, most in ((alone, 5e-3, 1.0), (both, 0.0, 2e-3)):
        points = BSpline(KNOTS, control, 3)(np.linspace(0, 1, 50))
        apart = np.sqrt(((points[:, None] - BENT[None]) ** 2).sum(axis=2)).min(axis=1)
        assert least <= np.median(apart) < most


def test_nothing_in_front_is_no_start():
    control, length = start_curve(
        np.ascontiguousarray(BENT[:10, :2]), np.full(10, -1.0), np.ones(10), 1.0, 10.0, 0.2, *_basis(8), KNOTS,
        ROUGHNESS,
    )  # fmt: skip
    assert length == 0.0
    assert not control.any()


def test_widths_that_contradict_each_other_are_found():
    t, rows, views = observations()
    _, _, _, depths = fitted(t, rows, views)
    shown = np.empty(9, bool)
    focals = np.full(2, FOCAL_PX)
    assert compare_widths(t, rows, depths, views, focals, 9, 0.1, 0.3, 3.0, shown)[0] == 0
    assert shown.all()
    rows[20:40, RADIUS] *= 4.0
    found, width_m = compare_widths(t, rows, depths, views, focals, 9, 0.1, 0.3, 3.0, shown)
    assert found >= 20
    assert not rows[20:40, CLEAR].any()
    assert width_m == pytest.approx(0.012, rel=0.02)
    assert not shown.all()
