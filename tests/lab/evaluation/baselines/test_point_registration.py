"""The registration against a slow, direct form of its equations, and on motions that are known."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from dloftbs_lab.evaluation.baselines import point_registration as registration
from dloftbs_lab.evaluation.baselines.point_registration import Weights, limit_stretch, register


def chain(count=20, bend=0.4, dims=2):
    t = np.linspace(-0.5, 0.5, count)
    columns = [t, bend * (t**2 - 0.1), 0.3 * np.sin(3.0 * t)]
    return np.stack(columns[:dims], axis=1)


def slow_responsibilities(nodes, points, variance, outliers, prior):
    dims = nodes.shape[1]
    noise = (2.0 * math.pi * variance) ** (dims / 2.0) * outliers / (1.0 - outliers) / len(points)
    shares = np.zeros((len(nodes), len(points)))
    for n, x in enumerate(points):
        of_nodes = [p * math.exp(-sum((x - y) ** 2) / (2.0 * variance)) for p, y in zip(prior, nodes, strict=True)]
        shares[:, n] = [one / (sum(of_nodes) + noise) for one in of_nodes]
    return shares


def objective(coefficients, nodes, points, shares, kernel, local, variance, weights):
    """What the M-step makes least, times the variance: the expectation, coherent motion, and local linearity."""
    moved = nodes + kernel @ coefficients
    fit = sum(shares[m, n] * sum((x - y) ** 2) / 2.0 for m, y in enumerate(moved) for n, x in enumerate(points))
    smooth = weights.coherence * variance / 2.0 * np.trace(coefficients.T @ kernel @ coefficients)
    linear = weights.linearity * variance / 2.0 * np.trace(moved.T @ local @ moved)
    return fit + smooth + linear


@pytest.mark.parametrize("dims", [2, 3])
def test_responsibilities_are_those_of_the_direct_form(dims):
    rng = np.random.default_rng(dims)
    nodes, points = chain(9, dims=dims), rng.normal(0.0, 0.3, (13, dims))
    prior = rng.uniform(0.1, 1.0, 9)
    prior /= prior.sum()
    found = registration.responsibilities(nodes, points, 0.01, 0.1, prior)
    np.testing.assert_allclose(found, slow_responsibilities(nodes, points, 0.01, 0.1, prior), atol=1e-12)
    assert (found.sum(axis=0) < 1.0).all()


def test_equal_priors_are_the_published_formula():
    """With 1 / M for each node, the noise has the factor M / N of the paper."""
    nodes, points = chain(9), chain(13) + 0.02
    found = registration.responsibilities(nodes, points, 0.02, 0.1, np.full(9, 1.0 / 9.0))
    squared = ((nodes[:, None] - points[None]) ** 2).sum(axis=2)
    likely = np.exp(-squared / 0.04)
    noise = 2.0 * math.pi * 0.02 * 0.1 / 0.9 * 9.0 / 13.0
    np.testing.assert_allclose(found, likely / (likely.sum(axis=0) + noise), atol=1e-12)


def test_the_motion_makes_the_objective_least():
    rng = np.random.default_rng(5)
    nodes, points = chain(8), chain(11) + rng.normal(0.0, 0.03, (11, 2))
    weights, variance = Weights(width=0.3, coherence=0.7, linearity=2.0), 0.01
    kernel, local = registration.coherence_kernel(nodes, weights.width), registration.local_linearity(nodes)
    shares = registration.responsibilities(nodes, points, variance, 0.1, np.full(8, 0.125))
    rest = (nodes, points, shares, kernel, local, variance, weights)
    found = registration.solve_motion(*rest)
    least = objective(found, *rest)
    for _ in range(40):
        assert objective(found + rng.normal(0.0, 0.01, found.shape), *rest) > least


def test_local_linearity_is_blind_to_rigid_motion_and_scale():
    nodes = chain(12, dims=3)
    local = registration.local_linearity(nodes)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    kept = np.trace(nodes.T @ local @ nodes)
    moved = 1.0 * nodes @ turn.T + np.array([1.0, -2.0, 3.0])
    assert np.trace(moved.T @ local @ moved) == pytest.approx(kept, rel=1e-6, abs=1e-12)
    np.testing.assert_allclose(local.sum(axis=1), 0.0, atol=1e-9)
    bent = nodes.copy()
    bent[6] += 0.05
    assert np.trace(bent.T @ local @ bent) > kept + 1e-3


def cable_points(line, count=300):
    at = np.linspace(0.0, len(line) - 1.0, count)
    return np.stack([np.interp(at, np.arange(len(line)), values) for values in line.T], axis=1)


@pytest.mark.parametrize("dims", [2, 3])
def test_a_rigid_motion_is_recovered(dims):
    nodes, angle = chain(40, dims=dims), 0.06
    turn = np.eye(dims)
    turn[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    moved = nodes @ turn.T + 0.05 * np.eye(dims)[1]
    points = cable_points(moved)
    found = register(nodes, points, Weights())
    # Along the cable nothing but its ends tells how far it went: there the errors are larger than across.
    assert cKDTree(points).query(found)[0].mean() < 0.004
    assert np.linalg.norm(found - moved, axis=1).mean() < 0.02 < np.linalg.norm(nodes - moved, axis=1).mean()


def test_a_bending_motion_is_recovered():
    nodes, moved = chain(40, bend=0.3), chain(40, bend=0.7)
    found = register(nodes, cable_points(moved), Weights())
    assert np.linalg.norm(found - moved, axis=1).mean() < 0.01 < np.linalg.norm(nodes - moved, axis=1).mean()


def test_hidden_nodes_go_with_their_neighbours():
    """Points of the first half alone: nodes that are told to be hidden stay out of it."""
    nodes = chain(40, bend=0.0)
    moved = nodes + np.array([0.0, 0.04])
    seen = np.where(np.arange(40) < 20, 1.0, 1e-6)
    found = register(nodes, cable_points(moved[:20]), Weights(), seen)
    assert np.abs(found[20:, 0] - nodes[20:, 0]).max() < 0.05
    assert found[30:, 1].mean() > 0.01


@given(st.integers(0, 10**6), st.integers(3, 30))
def test_stretch_limits_hold(seed, count):
    rng = np.random.default_rng(seed)
    nodes = rng.normal(0.0, rng.choice([0.01, 1.0, 100.0]), (count, rng.integers(2, 4)))
    lengths = rng.uniform(0.01, 2.0, count - 1)
    limited = limit_stretch(nodes, lengths)
    assert (np.linalg.norm(np.diff(limited, axis=0), axis=1) <= lengths * (1.0 + 1e-6)).all()


def test_what_keeps_the_limits_is_left_alone():
    nodes = chain(20)
    lengths = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
    np.testing.assert_array_equal(limit_stretch(nodes, lengths), nodes)


def test_two_nodes_too_far_apart_meet_in_the_middle():
    limited = limit_stretch(np.array([[0.0, 0.0], [4.0, 0.0], [8.0, 0.0]]), np.array([2.0, 2.0]))
    np.testing.assert_allclose(limited[1], (4.0, 0.0), atol=1e-6)
    np.testing.assert_allclose(limited[[0, 2], 0], (2.0, 6.0), atol=1e-4)
