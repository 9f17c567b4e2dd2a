"""Widths of branches at their ends."""

from __future__ import annotations

import numpy as np
import pytest
from linking_examples import beside, distances, draw

import dloftbs
from dloftbs.linking.end_widths import gain_by_width
from dloftbs.linking.matched_ends import Branches

REACH = 30


def branches(*ends: tuple[float, float], points: int = 60, noise: float = 0.0, shared: bool = False) -> Branches:
    """Return branches with the given widths at the first and at the last point."""
    rng = np.random.default_rng(0)
    radius = np.concatenate([0.5 * np.linspace(*widths, points) for widths in ends])
    count = len(ends)
    return Branches(
        np.zeros((count * points, 2)),
        radius + rng.normal(0.0, 0.5 * noise, len(radius)),
        list(range(count)),
        [0] * (2 * count),
        [0.0] * (2 * count),
        [(k * points, (k + 1) * points) for k in range(count)],
        [False] * count,
        np.zeros((2 * count, 6)),
        {0: 1, 1: 0} if shared else {},
    )


def gain(of: Branches) -> float:
    """Return the gain where branches 0 and 1 come in by their last points, and 2 and 3 go out by their first ones."""
    return gain_by_width(of, (1, 3), (4, 6), REACH)


def test_cables_of_different_widths_keep_them() -> None:
    stays, changes = [branches((8, 8), (12, 12), *out) for out in (((8, 8), (12, 12)), ((12, 12), (8, 8)))]
    assert gain(stays) < -10.0
    assert gain(changes) == pytest.approx(-gain(stays))


def test_cables_of_one_width_say_nothing() -> None:
    assert gain(branches((10, 10), (10, 10), (10, 10), (10, 10))) == pytest.approx(0.0, abs=1e-9)


def test_the_width_counts_where_they_meet() -> None:
    """In perspective a cable is thicker where it is near."""
    assert gain(branches((14, 10), (6, 12), (10, 6), (12, 16))) < -5.0


def test_noisy_edges_say_less() -> None:
    clean, noisy = (gain(branches((9, 9), (11, 11), (9, 9), (11, 11), noise=noise)) for noise in (0.0, 2.0))
    assert clean < 2.0 * noisy < 0.0


@pytest.mark.parametrize("unknown", [{"points": 20}, {"shared": True}])
def test_what_is_short_or_shared_says_nothing(unknown: dict[str, object]) -> None:
    assert gain(branches((8, 8), (12, 12), (12, 12), (8, 8), **unknown)) == 0.0


@pytest.mark.parametrize("length_widths", [4, 8])
@pytest.mark.parametrize("crosses", [False, True])
def test_a_thin_cable_leaves_a_bundle_with_a_thick_one_as_a_thin_one(length_widths: int, crosses: bool) -> None:
    thin, thick = beside(9 * length_widths, 9, crosses)
    found = dloftbs.detect(draw(thin, width=8.0) | draw(thick, width=12.0))
    assert len(found.detections) == 2
    assert max(distances(list(found.detections), [thin, thick])) < 6.0
