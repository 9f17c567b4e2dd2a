import pickle

import numpy as np
import pytest
from scipy import ndimage

from dloftbs import BSplineCurve, Frame
from dloftbs.errors import InputError
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.synthetic import Degradation, DegradedSequence, DemoSequence, KindSequence, draw_tube_mask
from dloftbs_lab.synthetic.blemishes import gaps_along, smooth_field, spots_on
from dloftbs_lab.truth import Truth

SIZE = (240, 640)
LINE = BSplineCurve([0, 0, 1, 1], [[20, 120], [620, 120]], 1)
TUBE = draw_tube_mask(LINE, 12.0, SIZE)
KEY = (3, 5)


def test_nothing_is_done_unless_asked_for():
    before = TUBE.copy()
    after = Degradation().apply(TUBE, (LINE,), KEY)
    np.testing.assert_array_equal(after, before)
    assert after is not TUBE
    Degradation(salt_and_pepper=0.1, pinholes=9, discs=2, jitter_px=1).apply(TUBE, (LINE,), KEY)
    np.testing.assert_array_equal(TUBE, before)


@pytest.mark.parametrize("share", [0.001, 0.02, 1.0])
def test_salt_and_pepper_turns_the_exact_share_of_pixels(share):
    flipped = Degradation(salt_and_pepper=share).apply(TUBE, (LINE,), KEY) ^ TUBE
    assert flipped.sum() == round(share * TUBE.size)
    # Cable and background alike.
    assert flipped[TUBE].mean() == pytest.approx(share, abs=4 * np.sqrt(share / TUBE.sum()))


@pytest.mark.parametrize("correlation", [2.0, 6.0, 15.0])
def test_the_field_has_its_deviation_and_correlation(correlation):
    field = smooth_field((600, 600), 1.7, correlation, np.random.default_rng(0))
    assert field.std() == pytest.approx(1.7, rel=0.06)
    shift = int(correlation)
    assert np.corrcoef(field[:, :-shift].ravel(), field[:, shift:].ravel())[0, 1] == pytest.approx(np.exp(-1), abs=0.06)


@pytest.mark.parametrize("sigma", [1.0, 2.0])
def test_the_border_moves_by_its_deviation_and_stays_in_place_on_average(sigma):
    band = np.zeros((200, 4000), bool)
    band[100:] = True
    moved = Degradation(jitter_px=sigma, jitter_correlation_px=12.0).apply(band, (), KEY)
    border = 200 - moved.sum(axis=0)
    assert border.mean() == pytest.approx(100, abs=0.3)
    assert border.std() == pytest.approx(sigma, rel=0.15)
    assert not moved[:80].any()


def test_masks_without_a_border_have_none_to_move():
    worse = Degradation(jitter_px=2.0)
    for mask in (np.zeros(SIZE, bool), np.ones(SIZE, bool)):
        np.testing.assert_array_equal(worse.apply(mask, (), KEY), mask)


@pytest.mark.parametrize("share", [0.05, 0.1, 0.2])
def test_missing_stretches_take_their_share_of_the_length(share):
    for index in range(5):
        hidden = Degradation(missing=share).hidden((LINE,), SIZE, (0, index))
        assert hidden[120, 20:621].mean() == pytest.approx(share, abs=0.01)
        seen = Degradation(missing=share).apply(TUBE, (LINE,), (0, index))
        np.testing.assert_array_equal(seen, TUBE & ~hidden)


def test_gaps_do_not_overlap_and_are_shared_out_over_several_curves():
    other = BSplineCurve([0, 0, 1, 1], [[20, 30], [320, 30]], 1)
    on_other = 0
    for seed in range(20):
        centres, radii = gaps_along((LINE, other), 0.3, (12.0, 24.0), np.random.default_rng(seed))
        assert 2 * radii.sum() == pytest.approx(0.3 * 900)
        for row in (120, 30):
            x, r = centres[centres[:, 1] == row, 0], radii[centres[:, 1] == row]
            assert (np.diff(x) >= r[1:] + r[:-1] - 1e-6).all()
        on_other += (centres[:, 1] == 30).mean()
    assert 0.15 < on_other / 20 < 0.55


def test_discs_lie_on_the_cables_and_have_their_size():
    worse = Degradation(discs=2, disc_radius_px=(20.0, 20.0))
    areas = []
    for index in range(10):
        hidden = worse.hidden((LINE,), SIZE, (1, index))
        labels, count = ndimage.label(hidden)
        assert count in (1, 2)
        areas.append(hidden.sum() / count)
        for row, _ in ndimage.center_of_mass(hidden, labels, range(1, count + 1)):
            assert row == pytest.approx(120, abs=0.6)
    assert min(areas) == pytest.approx(np.pi * 400, rel=0.06)
    spots = spots_on((LINE,), np.full(2000, 30.0), np.random.default_rng(0))
    assert spots[:, 0].mean() == pytest.approx(320, abs=12)
    # Both ends stay visible.
    assert spots[:, 0].min() == pytest.approx(65, abs=2)
    assert spots[:, 0].max() == pytest.approx(575, abs=2)


def test_specks_pinholes_and_strokes_are_as_many_as_asked_for():
    holes = TUBE & ~Degradation(pinholes=6, pinhole_radius_px=(1.0, 1.5)).apply(TUBE, (LINE,), KEY)
    assert 1 <= ndimage.label(holes, np.ones((3, 3)))[1] <= 6
    specks = Degradation(specks=8).apply(np.zeros(SIZE, bool), (), KEY)
    assert 6 <= ndimage.label(specks, np.ones((3, 3)))[1] <= 8
    strokes = Degradation(false_positives=3).apply(np.zeros(SIZE, bool), (), KEY)
    assert 1 <= ndimage.label(strokes, np.ones((3, 3)))[1] <= 3
    assert 30 < strokes.sum() < 3 * 85 * 12
    assert not Degradation(pinholes=5).apply(np.zeros(SIZE, bool), (), KEY).any()


def test_more_of_one_effect_leaves_the_others_as_they_are():
    few, many = Degradation(discs=2), Degradation(discs=2, specks=20, missing=0.1)
    a, b = few.hidden((LINE,), SIZE, KEY), many.hidden((LINE,), SIZE, KEY)
    assert not (a & ~b).any()
    c, d = Degradation(specks=20).apply(TUBE, (LINE,), KEY), many.apply(TUBE, (LINE,), KEY)
    np.testing.assert_array_equal(c & ~TUBE & ~d, np.zeros(SIZE, bool))


def test_scaling_concerns_lengths_only():
    twice = Degradation(jitter_px=1.0, missing=0.1, discs=3, specks=4).scaled(2.0)
    assert (twice.jitter_px, twice.jitter_correlation_px, twice.disc_radius_px) == (2.0, 4.0, (36.0, 68.0))
    assert (twice.missing, twice.discs, twice.specks) == (0.1, 3, 4)


def test_a_degraded_sequence_keeps_the_curves_and_loses_what_is_hidden():
    base = KindSequence("three cables", 4, (360, 640))
    worse = DegradedSequence(base, Degradation(missing=0.1, discs=1, specks=5, salt_and_pepper=0.01), 7)
    assert (worse.name, len(worse), worse.fps) == ("three cables, degraded", 4, base.fps)
    truth, clean = worse.truth(2), base.truth(2)
    assert truth.curves == clean.curves
    assert truth.ids == clean.ids
    hidden = worse.degradation.hidden(clean.curves, (360, 640), (7, 2))
    for mask, whole in zip(truth.visible_masks, clean.visible_masks, strict=True):
        np.testing.assert_array_equal(mask, whole & ~hidden)
    frame = worse.frame(2)
    assert (frame.index, frame.stamp, frame.name) == (2, base.frame(2).stamp, "three cables, degraded#0002")
    assert (frame.mask & hidden).mean() < 0.01


def test_the_same_seed_and_index_give_the_same_mask_in_any_order_and_after_pickling():
    worse = Degradation(0.01, 1.0, missing=0.1, discs=2, specks=5, pinholes=5, false_positives=2)
    one = DegradedSequence(KindSequence("one loop", 4, (180, 320)), worse, 1)
    other = pickle.loads(pickle.dumps(one))
    other.frame(0)
    np.testing.assert_array_equal(one.frame(3).mask, other.frame(3).mask)
    np.testing.assert_array_equal(one.truth(3).mask, other.truth(3).mask)
    again = DegradedSequence(one.sequence, worse, 2)
    assert (again.frame(3).mask != one.frame(3).mask).any()


def test_the_true_mask_stands_in_where_a_frame_has_none():
    demo = DemoSequence(2, (144, 256), width_px=3.0)
    frame = DegradedSequence(demo, Degradation()).frame(1)
    assert frame.image is None
    np.testing.assert_array_equal(frame.mask, demo.truth(1).mask)


class Soft(KnownSequence):
    name = "soft"
    length = 1

    def frame(self, index):
        return Frame(mask=np.where(self.truth(index).mask, 0.9, 0.02))

    def truth(self, index):
        return DemoSequence(2, (144, 256), width_px=3.0).truth(index)


def test_a_probability_is_degraded_as_its_cable():
    np.testing.assert_array_equal(DegradedSequence(Soft(), Degradation()).frame(0).mask, Soft().truth(0).mask)


class Blind(KnownSequence):
    name = "blind"
    length = 1

    def frame(self, index):
        return Frame(image=np.zeros((*SIZE, 3), np.uint8))

    def truth(self, index):
        return Truth((LINE,), (), (0,))


def test_without_any_mask_there_is_nothing_to_degrade():
    blind = DegradedSequence(Blind(), Degradation(discs=1))
    assert blind.truth(0).curves == (LINE,)
    with pytest.raises(InputError, match="blind has no masks to degrade"):
        blind.frame(0)
    with pytest.raises(InputError, match="seed must not be negative, got -1"):
        DegradedSequence(Blind(), Degradation(), -1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"salt_and_pepper": 1.5}, r"salt_and_pepper must be a number in 0\.\.1, got 1.5"),
        ({"missing": 0.95}, r"missing must be a number in 0\.\.0.9"),
        ({"jitter_px": -1.0}, "jitter_px must be a number"),
        ({"jitter_px": float("inf")}, "jitter_px must be a number"),
        ({"jitter_correlation_px": 0.0}, "jitter_correlation_px must be positive"),
        ({"missing": float("nan")}, r"missing must be a number in 0\.\.0.9, got nan"),
        ({"discs": -1}, "discs must be a number that is not negative, got -1"),
        ({"disc_radius_px": (9.0, 3.0)}, "disc_radius_px must be a positive range"),
    ],
)
def test_strengths_out_of_range_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        Degradation(**change)
