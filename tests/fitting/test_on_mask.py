"""Curves that are kept to the mask."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from fuzz.checks import check_seen
from fuzz.masks import hilbert, stairs, stroke
from linking_examples import circle, draw

import dloftbs
from dloftbs.cleaning import clean
from dloftbs.config import Config, FittingConfig
from dloftbs.data.centerline import Centerline, Segment
from dloftbs.data.curve import BSplineCurve
from dloftbs.fitting import fit, keep_to_mask, on_mask


def kept(
    line: Centerline, mask: np.ndarray, curve: BSplineCurve | None = None, knots: int | None = None
) -> tuple[Centerline, BSplineCurve, BSplineCurve]:
    """Return what becomes of a line and its curve, and the curve before."""
    crop = clean(mask, Config().cleaning)
    assert crop is not None
    config = FittingConfig(knots=knots)
    curve = curve or fit(line.points, line.u, line.closed, config, line.width_px)
    return *keep_to_mask(line, curve, crop, mask, config), curve


def line_through(points: np.ndarray, radius: float, closed: bool = False) -> Centerline:
    return Centerline((Segment(points, np.full(len(points), radius)),), closed=closed)


def gaps(line: Centerline) -> list[tuple[float, float]]:
    return [joint.u for joint in line.joints]


def steps(count: int, step: float) -> np.ndarray:
    """Return points a pixel apart along stairs."""
    corners = 20.0 + step * np.repeat(np.arange(count + 1), 2)[:, None]
    ends = np.stack((corners[1:, 0], corners[:-1, 0]), axis=1)
    return np.concatenate([np.linspace(a, b, int(step), endpoint=False) for a, b in pairwise(ends)])


def test_a_curve_on_the_mask_is_the_same_object() -> None:
    points = np.column_stack((np.arange(30.0, 371.0), 120.0 + 40.0 * np.sin(np.arange(341) / 60.0)))
    line = line_through(points, 3.5)
    after, curve, before = kept(line, draw(points))
    assert after is line
    assert curve is before


def test_around_sharp_bends_a_curve_gets_more_knots() -> None:
    points = steps(6, 28.0)
    line, mask = line_through(points, 3.0), draw(points, width=6.0)
    rough = fit(points, line.u, False, FittingConfig(knots=8), 6.0)
    after, curve, _ = kept(line, mask, rough)
    assert after is line
    assert len(curve.control_points) > len(rough.control_points)
    away = [np.linalg.norm(one(line.u) - points, axis=1).max() for one in (rough, curve)]
    assert away[1] < 3.0 + 3.0 < away[0]


def test_with_a_given_number_of_knots_the_bends_that_it_cuts_are_inferred() -> None:
    points = steps(6, 28.0)
    line, mask = line_through(points, 3.0), draw(points, width=6.0)
    after, curve, before = kept(line, mask, knots=8)
    assert curve is before
    assert len(after.joints) >= 2
    assert sum(map(len, after.segments)) == len(points)
    spans = gaps(after)
    assert all(a[1] <= b[0] for a, b in pairwise(spans))


def test_an_end_on_the_ground_is_inferred() -> None:
    points = np.column_stack((np.arange(30.0, 300.0), np.full(270, 100.0)))
    mask = draw(points[:200])
    after, curve, before = kept(line_through(points, 3.5), mask)
    assert curve is before
    ((low, high),) = gaps(after)
    assert curve(low)[0] == pytest.approx(229.0 + 3.5 + 3.5, abs=1.5)  # the tip is half a width long
    assert high == 1.0


def test_no_knots_are_tried_where_the_centre_line_itself_is_beside_the_mask(monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.column_stack((np.arange(30.0, 300.0), np.full(270, 100.0)))
    mask = draw(points)
    mask[:, 150:190] = 0
    monkeypatch.setattr(on_mask, "fit_with_knots", lambda *_: pytest.fail("knots were tried"))
    after, curve, before = kept(line_through(points, 3.5), mask)
    assert curve is before
    assert len(gaps(after)) == 1


def test_a_crossing_without_points_gets_the_straight_way() -> None:
    """A curve that swings from one side of a junction to the other follows the line between them."""
    arms = [np.linspace((100.0, 30.0), (100.0, 110.0), 81), np.linspace((180.0, 110.0), (180.0, 30.0), 81)]
    points = np.concatenate(arms)
    mask = draw(*arms, [(100, 110), (180, 110)])
    line = line_through(points, 3.5)
    rough = fit(points, line.u, False, FittingConfig(knots=8), 7.0)
    assert rough(np.linspace(0.0, 1.0, 400))[:, 1].max() > 110.0 + 7.5
    _, curve, _ = kept(line, mask, rough)
    assert curve(np.linspace(0.0, 1.0, 400))[:, 1].max() < 110.0 + 7.5


def test_a_loop_that_leaves_the_mask_is_opened_there() -> None:
    points = circle((200.0, 120.0), 80.0)
    mask = draw(points)
    mask[:, 240:] = 0
    line = line_through(points[:-1], 3.5, closed=True)
    after, curve, _ = kept(line, mask)
    assert not after.closed
    assert not curve.closed
    ends = curve(np.array([0.0, 1.0]))
    assert (ends[:, 0] > 236.0).all()
    assert gaps(after)


@pytest.mark.parametrize("step", [20, 28, 40])
@pytest.mark.parametrize("width", [5, 9, 12])
def test_stairs_are_seen_where_they_are(step: int, width: int) -> None:
    mask = stairs(step, width)
    found = dloftbs.detect(mask)
    assert found
    check_seen(found, mask)


@pytest.mark.large
@pytest.mark.parametrize("width", [3, 6])
def test_a_curve_that_fills_the_plane_is_seen_where_it_is(width: int) -> None:
    mask = stroke(np.zeros((300, 400), np.uint8), 20.0 + 16.0 * hilbert(4), width)
    found = dloftbs.detect(mask)
    assert found
    check_seen(found, mask)


def test_in_a_hole_that_the_cleaning_fills_nothing_is_seen_beyond_half_a_width() -> None:
    mask = draw([(30, 120), (370, 120)], width=20.0)
    mask[112:129, 190:210] = 0
    check_seen(dloftbs.detect(mask), mask)
