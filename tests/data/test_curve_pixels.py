"""Masks drawn from curves."""

import builders
import numpy as np
import pytest

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_pixels import curve_mask, pixels_near

SIZE = (60, 90)


def straight(start, end):
    return BSplineCurve([0, 0, 1, 1], [start, end], 1)


def test_the_ends_are_flat():
    mask = curve_mask(straight([10, 30], [40, 30]), 5.0, SIZE)

    expected = np.zeros(SIZE, dtype=bool)
    expected[28:33, 10:41] = True
    assert (mask == expected).all()


def test_a_slanted_end_is_flat_across_the_curve():
    mask = curve_mask(straight([20, 20], [50, 50]), 9.0, SIZE)

    y, x = np.nonzero(mask)
    assert (x + y).min() == 40
    assert (x + y).max() == 100


def test_only_the_spans_are_drawn():
    mask = curve_mask(straight([10, 30], [50, 30]), 3.0, SIZE, [(0.0, 0.26), (0.49, 1.0)])

    expected = np.zeros(SIZE, dtype=bool)
    expected[29:32, 10:21] = True
    expected[29:32, 30:51] = True
    assert (mask == expected).all()
    assert not curve_mask(straight([10, 30], [50, 30]), 3.0, SIZE, []).any()


def test_a_loop_has_no_ends():
    loop = builders.loop(20.0, (40.0, 30.0))
    mask = curve_mask(loop, 7.0, SIZE)

    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    off = np.abs(np.hypot(x - 40.0, y - 30.0) - 20.0)
    clear = np.abs(off - 3.5) > 0.01
    assert (mask[clear] == (off < 3.5)[clear]).all()
    part = curve_mask(loop, 7.0, SIZE, [(0.0, 0.5)])
    assert part[33, 60]  # u = 0 is at the right, and grows downwards
    assert not part[27, 60]


def test_a_curve_may_leave_the_image():
    mask = curve_mask(straight([-1000, 10], [1000, 10]), 5.0, (20, 30))
    assert mask.sum() == 5 * 30
    assert curve_mask(straight([-1e9, 10], [1e9, 10]), 5.0, (20, 30)).shape == (20, 30)
    assert not curve_mask(straight([-50, -10], [-20, 90]), 5.0, (20, 30)).any()


@pytest.mark.parametrize("width", [1.0, 4.0])
def test_each_pixel_has_its_nearest_point(width):
    points = np.array([[5.0, 5.0], [6.0, 5.0], [7.0, 6.0]])
    rows, columns, nearest = pixels_near(points, width, (20, 20))

    distance = np.hypot(columns - points[:, :1], rows - points[:, 1:])
    assert (distance.argmin(axis=0) == nearest).all()
    assert (distance.min(axis=0) <= width / 2).all()
