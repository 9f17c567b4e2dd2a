"""Terms of the deviations: which noise of the radii a curve averages out, and which it follows."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders import curve_through

from dloftbs import detect
from dloftbs.data.centerline import Centerline, Segment
from dloftbs.data.detection import Detection

LENGTH = 600.0


def deviation_with(radius):
    """Return the deviation in the middle of a straight cable, px, whose knots are a tenth of it apart, by its radii."""
    curve = curve_through(np.linspace((0.0, 0.0), (LENGTH, 0.0), 13))
    line = Centerline((Segment(curve.sample(len(radius)), radius),))
    return float(Detection(line, curve).curve_std(0.5))


def test_noise_that_goes_together_from_knot_to_knot_counts_more_than_that_of_pixels():
    s = np.linspace(0.0, LENGTH, 601)
    waves = np.sin(2.0 * np.pi * s / 160.0)
    noise = np.random.default_rng(0).normal(size=len(s))
    smooth, rough = (deviation_with(5.0 + 0.3 * one / one.std()) for one in (waves, noise))
    assert smooth > 2.0 * rough


def test_a_width_that_grows_along_the_cable_is_no_noise():
    grown, even = (deviation_with(np.linspace(5.0 - part, 5.0 + part, 601)) for part in (2.0, 0.0))
    assert abs(grown / even - 1.0) < 0.05


def loop_from(first):
    """Return a loop whose pixels and radii are rougher in one half, and whose seam lies at its pixel of a number."""
    rng, angle = np.random.default_rng(0), 2.0 * np.pi * np.arange(400) / 400
    rough = 1.0 + (angle > np.pi)
    points = (100.0 + 0.3 * rough * np.sin(20.0 * angle)) * np.array([np.cos(angle), np.sin(angle)])
    points, radius = np.roll(points.T, -first, axis=0), np.roll(5.0 + 0.2 * rough * rng.normal(size=400), -first)
    smooth = 100.0 * np.stack((np.cos(angle[::20]), np.sin(angle[::20])), axis=1)
    curve = curve_through(np.roll(smooth, -first // 20, axis=0), closed=True)
    return Detection(Centerline((Segment(points, radius),), closed=True), curve)


def test_a_loop_has_the_same_deviation_at_a_place_whatever_turn_its_u_is_of():
    found = loop_from(0)
    assert found.curve_std([1.0, -0.25, 1.25]) == pytest.approx(found.curve_std([0.0, 0.75, 0.25]))


def test_the_seam_of_a_loop_changes_no_deviation():
    u = np.linspace(0.0, 1.0, 50, endpoint=False)
    found = loop_from(0).curve_std(u)
    for first in (100, 200):
        assert loop_from(first).curve_std(u - first / 400) == pytest.approx(found, rel=0.02)


def around_a_hidden_turn():
    """Return a cable whose mask is interrupted where it turns back."""
    mask = np.zeros((260, 420), np.uint8)
    cv2.line(mask, (20, 80), (300, 80), 255, 8)
    cv2.line(mask, (20, 180), (300, 180), 255, 8)
    cv2.ellipse(mask, (300, 130), (50, 50), 0.0, -90.0, 90.0, 255, 8)
    mask[:, 310:] = 0
    (found,) = detect(mask, objects=1)
    return found


def test_a_cable_has_the_same_deviation_at_a_place_whichever_way_it_runs():
    found, u = around_a_hidden_turn(), np.linspace(0.0, 1.0, 101)
    assert len(found.inferred) == 1
    np.testing.assert_allclose(found.reversed().curve_std(1.0 - u), found.curve_std(u), rtol=1e-3)


def test_a_cable_that_was_read_lies_on_its_curve():
    found, seen = around_a_hidden_turn(), np.linspace(0.0, 0.3, 31)
    again = Detection.from_dict(found.to_dict())
    line = again.centerline
    np.testing.assert_allclose(line.points, again.curve.spline(line.u), atol=1e-6)
    assert (again.curve_std(seen) <= found.curve_std(seen)).all()
