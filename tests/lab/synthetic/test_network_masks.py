import numpy as np
import pytest
from builders import curve_through

from dloftbs.errors import InputError
from dloftbs_lab.synthetic import NETWORK, NetworkFaults, draw_tube_mask, several_cables

SIZE = (360, 640)
LINES = tuple(curve_through(np.column_stack((np.linspace(80, 560, 40), np.full(40, y)))) for y in (120.0, 240.0))
WIDTH = 12.0
CLEAN = np.logical_or.reduce([draw_tube_mask(line, WIDTH, SIZE) for line in LINES])
NONE = NetworkFaults(lost_ends=0.0, gaps=0.0, connectors=0.0, strays=0.0, unsure=0.0)


def faults(**change):
    """Faults of one sort alone."""
    return NetworkFaults(**{**dict.fromkeys(("lost_ends", "gaps", "connectors", "strays", "unsure"), 0.0), **change})


def seen(one, index=0, curves=LINES, mask=CLEAN):
    return one.apply(mask, curves, (3, index))


def test_a_sure_network_leaves_all_but_corners():
    assert (seen(NONE) ^ CLEAN).sum() < 0.04 * CLEAN.sum()
    assert not NONE.hides


def test_a_slit_between_neighbours_closes_and_a_wide_one_stays():
    for slit, merged in ((2, True), (10, False)):
        mask = np.zeros(SIZE, bool)
        mask[100:112, 50:600] = mask[112 + slit : 124 + slit, 50:600] = True
        assert seen(NONE, curves=(), mask=mask)[112 : 112 + slit, 100:500].all() == merged


def test_ends_are_lost_and_hidden_in_the_truth():
    one = faults(lost_ends=1.0)
    for index in range(5):
        hidden = one.hidden(LINES, SIZE, (3, index))
        assert not (seen(one, index) & hidden)[:, 200:400].any()
        for line in LINES:
            for end in (line.start, line.end):
                assert hidden[round(end[1]), round(end[0])]
        assert 40 < (CLEAN & hidden).sum() < 0.3 * CLEAN.sum()
    assert one.hides


def test_an_end_at_the_border_is_no_end():
    cut = (curve_through(np.column_stack((np.linspace(0, 639, 40), np.full(40, 200.0)))),)
    mask = draw_tube_mask(cut[0], WIDTH, SIZE)
    assert not faults(lost_ends=1.0).hidden(cut, SIZE, (0, 0)).any()
    np.testing.assert_array_equal(seen(faults(connectors=1.0), 0, cut, mask), seen(NONE, 0, cut, mask))


def test_connectors_are_blobs_at_the_ends():
    grown = seen(faults(connectors=1.0)) & ~seen(NONE)
    rows, columns = np.nonzero(grown)
    assert len(rows) > 100
    assert (np.minimum(np.abs(columns - 80), np.abs(columns - 560)) < 20).all()


def test_some_images_have_a_stray_stroke_and_most_have_none():
    strays = [(seen(faults(strays=0.25), index) & ~seen(NONE, index)).any() for index in range(80)]
    assert 8 < sum(strays) < 36


def test_the_border_wanders_with_how_sure_the_network_is():
    moved = [(seen(faults(unsure=share)) ^ seen(NONE)).sum() for share in (0.05, 0.3)]
    assert 0 < moved[0] < moved[1]


def test_it_is_the_same_again_and_scales_with_the_image():
    np.testing.assert_array_equal(seen(NETWORK), seen(NETWORK))
    assert (seen(NETWORK, 0) != seen(NETWORK, 1)).any()
    half = NETWORK.scaled(0.5)
    assert (half.blur_px, half.lost_px, half.lost_ends) == (1.0, (4.0, 18.0), NETWORK.lost_ends)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lost_ends": 1.2}, r"lost_ends must be a number in 0\.\.1, got 1\.2"),
        ({"gaps": 0.95}, r"gaps must be a number in 0\.\.0\.9"),
        ({"unsure": -0.1}, r"unsure must be a number in 0\.\.0\.4"),
        ({"blur_px": 0.0}, "blur_px must be positive and below 1000, got 0.0"),
        ({"patch_px": float("nan")}, "patch_px must be positive and below 1000"),
        ({"stray_width_px": (1.0, 2e3)}, "stray_width_px must be a positive range below 1000"),
        ({"lost_px": (9.0, 3.0)}, "lost_px must be a positive range"),
    ],
)
def test_what_cannot_be_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        NetworkFaults(**change)


def test_masks_of_the_suite_are_worse_than_the_truth_but_not_by_much():
    groups = several_cables(0.01, 1, SIZE)
    assert len(groups) == 7
    for group in groups:
        mask, truth, clean = group.frame(0).mask, group.truth(0).mask, group.sequence.truth(0).mask
        assert group.frame(0).image is None
        assert not (truth & ~clean).any()
        assert 0.6 < (mask & clean).sum() / (mask | clean).sum() < 0.98
        assert (mask & ~clean).any()
