"""Ends of cables beside other cables: the tip shows in the mask where no other cable explains it."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import draw_cable
from linking_examples import detect

from dloftbs_lab.synthetic import FreeEnd, draw_cable_mask
from dloftbs_lab.synthetic.free_ends import EndStyle

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


def end_misses(style: EndStyle, width: int, bend: float) -> np.ndarray:
    """Return how far the nearest end of a curve is from a true one, px, for 12 cables in all directions."""
    misses = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        heading = np.pi / 6.0 * (seed + rng.random()) + np.linspace(0.0, bend, 24 * width)
        line = 0.5 * np.cumsum(np.stack((np.cos(heading), np.sin(heading)), axis=1), axis=0)
        line += 3.0 * width - line.min(axis=0) + rng.random(2)
        columns, rows = np.ceil(line.max(axis=0) + 3.0 * width).astype(int)
        ends = FreeEnd("round"), FreeEnd.draw(rng, style)
        mask = draw_cable_mask(line, np.full(len(line), float(width)), (rows, columns), ends)
        misses.append(nearest_end(mask, line[-1]))
    return np.array(misses)


@pytest.mark.parametrize("bend", [0.0, 1.5])
@pytest.mark.parametrize("width", [12, 20, pytest.param(40, marks=pytest.mark.large)])
@pytest.mark.parametrize("style", ["flat", "round", "tapered"])
def test_a_cable_ends_where_its_axis_does_whatever_its_end_looks_like(style: EndStyle, width: int, bend: float) -> None:
    assert end_misses(style, width, bend).mean() < 0.05 * width + 1.0


@pytest.mark.large
@pytest.mark.parametrize("bend", [0.0, 1.5])
@pytest.mark.parametrize("width", [20, pytest.param(40, marks=pytest.mark.large)])
def test_a_frayed_cable_ends_where_its_strands_begin(width: int, bend: float) -> None:
    """Strands that lie close to each other part somewhat farther out."""
    misses = end_misses("frayed", width, bend)
    assert misses.mean() < 0.15 * width
    assert misses.max() < 0.4 * width


@pytest.mark.parametrize("width", [16, 20, 24])
@pytest.mark.parametrize("beyond", [0.85, 1.15])
def test_a_tip_beyond_two_cables_that_cross_each_other_shows(width: int, beyond: float) -> None:
    """Too near to their crossing for a branch of its own, and before it lies the mask of both."""
    meet, along = np.array([260.0, 181.0]), np.array((0.986, 0.166))
    crossing = [np.array([(344.0, 56.0), (188.0, 296.0)]), np.array([(178.0, 44.0), (320.0, 266.0)])]
    own = np.array([meet - 180.0 * along, meet + 12.0 * beyond * along])
    scale = width / 12.0
    size = (int(330 * scale), int(400 * scale))
    cables = [draw_cable(scale * line, width, size) for line in (*crossing, own)]
    assert nearest_end(cables[0] | cables[1] | cables[2], scale * own[-1]) < 0.2 * width
