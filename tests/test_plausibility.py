"""Hints about input that is hardly meant."""

from __future__ import annotations

import numpy as np
import pytest

from dloftbs.config import LiftingConfig
from dloftbs.plausibility import unit_hint


@pytest.mark.parametrize(("unit_m", "hints"), [(1.0, False), (0.001, True)])
@pytest.mark.parametrize("known", [1.0, 0.3])
def test_millimetres_in_floating_point_are_hinted_at(unit_m: float, hints: bool, known: float) -> None:
    rng = np.random.default_rng(0)
    depth = rng.uniform(0.5, 0.9, (240, 320)) / unit_m
    depth[rng.random(depth.shape) > known] = rng.choice([0.0, np.nan, np.inf])
    assert ("multiply millimetres by 0.001" in unit_hint(depth, LiftingConfig())) is hints


def test_nothing_is_hinted_at_without_depth_or_of_counts() -> None:
    assert unit_hint(np.zeros((24, 32)), LiftingConfig()) == ""
    assert unit_hint(np.full((24, 32), 60_000, np.uint16), LiftingConfig()) == ""
