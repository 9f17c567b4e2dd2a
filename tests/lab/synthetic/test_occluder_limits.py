import numpy as np
import pytest

from dloftbs.data.curve import BSplineCurve
from dloftbs_lab.synthetic import OCCLUDED, DegradedSequence, KindSequence
from dloftbs_lab.synthetic.occluder_limits import leaves_enough
from dloftbs_lab.synthetic.strand import integrate

STRAIGHT = integrate(np.zeros(1201), 600.0).moved(np.array([20.0, 100.0])).curve()


def bent(angle: float, radius: float = 25.0) -> BSplineCurve:
    """Straight, an arc about (320, 100 + radius), straight."""
    count = round(abs(angle) * radius / 0.5)
    heading = np.concatenate((np.zeros(600), np.linspace(0.0, angle, count), np.full(600, angle)))
    return integrate(heading, 0.5 * (len(heading) - 1)).moved(np.array([20.0, 100.0])).curve()


def enough(curve, *discs, least_px=18.0):
    x, y, radius = np.array(discs, float).T
    return leaves_enough((STRAIGHT, curve), np.column_stack((x, y)), radius, least_px)


@pytest.mark.parametrize(
    ("discs", "expected"),
    [
        ([(320.0, 100.0, 30.0)], True),
        ([(260.0, 100.0, 30.0), (320.0, 100.0, 34.0), (380.0, 100.0, 30.0)], True),  # what is straight may be long
        ([(30.0, 100.0, 30.0)], False),  # an end
        ([(610.0, 100.0, 30.0)], False),
        ([(65.0, 100.0, 30.0)], False),  # 15 px of an end are left, too little
        ([(70.0, 100.0, 30.0)], True),  # 20 px
        ([(320.0, 300.0, 30.0)], True),  # somewhere else
    ],
)
def test_both_ends_must_show(discs, expected):
    assert enough(STRAIGHT, *discs) is expected


@pytest.mark.parametrize(("turns", "expected"), [(0.45, True), (0.55, False), (1.0, False), (-1.0, False)])
def test_no_more_than_a_half_turn_may_be_hidden(turns, expected):
    curve = bent(2.0 * np.pi * turns)
    assert enough(curve, (320.0, 100.0 + np.sign(turns) * 25.0, 34.0)) is expected


def test_what_shows_between_two_discs_counts_from_a_least_length_on():
    curve = bent(1.2 * np.pi, radius=60.0)
    # Each disc hides a part of the bend; both and what is between are more than a half turn.
    along = np.linspace(0.0, 1.0, 2001)
    points = curve(along)
    bend = points[(along * curve.length > 300.0) & (along * curve.length < 300.0 + 1.2 * np.pi * 60.0)]
    discs = [(*bend[int(share * len(bend))], 40.0) for share in (0.24, 0.76)]
    shown = ~(np.linalg.norm(bend[:, None] - np.array(discs)[None, :, :2], axis=2) <= 40.0).any(axis=1)
    assert 30.0 < shown.mean() * 1.2 * np.pi * 60.0 < 90.0
    assert enough(curve, *discs, least_px=1.0)
    assert not enough(curve, *discs, least_px=40.0)


def test_the_loops_of_the_suite_are_never_hidden_as_a_whole():
    loops = KindSequence("one loop", 12)
    worse = DegradedSequence(loops, OCCLUDED)
    for index in range(12):
        truth, clean = worse.truth(index), loops.truth(index)
        (curve,) = truth.curves
        for end in curve.sample(2).round().astype(int):
            assert truth.mask[end[1], end[0]]
        hidden = clean.mask & ~truth.mask
        assert hidden.any()
