"""Ends of cables beside other cables: the tip shows in the mask where no other cable explains it."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import draw_cable
from linking_examples import detect

SIZE = (300, 420)
WIDTH = 12


def nearest_end(mask: np.ndarray, tip: np.ndarray) -> float:
    """Return how far the nearest end of any curve is from a true one, px."""
    ends = np.array([one.curve(u) for one in detect(mask) for u in (0.0, 1.0)])
    return float(np.hypot(*(ends - tip).T).min())


@pytest.mark.parametrize("angle_deg", [15, 20, 25])
@pytest.mark.parametrize("away", [0.6, 0.8])
def test_a_tip_that_touches_another_cable_ends_where_it_shows(angle_deg: float, away: float) -> None:
    """The skeleton of the touching tip leads into the axis of the other cable."""
    straight = np.array([(20.0, 150.0), (400.0, 150.0)])
    direction = np.array((np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))))
    tip = np.array((230.0, 150.0 - away * WIDTH))
    mask = draw_cable(straight, WIDTH, SIZE) | draw_cable(np.array([tip - 160.0 * direction, tip]), WIDTH, SIZE)
    assert nearest_end(mask, tip) < 0.4 * WIDTH


@pytest.mark.parametrize(("slope", "away"), [(0.0, 0.75), (0.006, 0.6)])
def test_a_cable_that_ends_beside_another_one_ends_where_it_shows(slope: float, away: float) -> None:
    """The middle of the mask leads over to the other cable there."""
    x = np.linspace(20.0, 260.0, 60)
    straight = np.array([(20.0, 150.0), (400.0, 150.0)])
    beside = 150.0 - away * WIDTH - 0.002 * np.maximum(200.0 - x, 0.0) ** 2 - slope * (x - 20.0)
    coming = np.column_stack((x, beside))
    mask = draw_cable(straight, WIDTH, SIZE) | draw_cable(coming, WIDTH, SIZE)
    assert nearest_end(mask, coming[-1]) < 0.55 * WIDTH
