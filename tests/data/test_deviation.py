"""Terms of the deviations: which noise of the radii a curve averages out, and which it follows."""

from __future__ import annotations

import numpy as np
from builders import curve_through

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
