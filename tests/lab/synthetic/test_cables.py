import pickle

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dloftbs.errors import InputError
from dloftbs_lab.synthetic import (
    KINDS,
    NOISY,
    OCCLUDED,
    KindSequence,
    StrewnSequence,
    TangleSequence,
    draw_tube_mask,
    kinds,
    several_cables,
)

SIZE = (360, 640)
SMALL = (180, 320)


def closest(first, second, n=300):
    return cKDTree(first.sample(n)).query(second.sample(n))[0]


def test_there_are_62_images_of_2_to_8_cables():
    groups = several_cables()
    assert [group.name for group in groups] == [f"{n} cables" for n in range(2, 9)]
    assert sum(len(group) for group in groups) == 62
    assert [len(group) for group in several_cables(0.01, 3, SMALL)] == [1] * 7


@pytest.mark.parametrize("cables", [2, 3, 5, 8])
def test_images_have_their_cables_inside_and_touching(cables):
    images = TangleSequence(cables, 4, SIZE)
    for index in range(4):
        truth = images.truth(index)
        assert len(truth.curves) == len(truth.visible_masks) == cables
        assert truth.ids == tuple(range(cables))
        assert images.frame(index).stamp is None
        np.testing.assert_array_equal(images.frame(index).mask, truth.mask)
        for number, curve in enumerate(truth.curves):
            points = curve.sample(300)
            assert (points > images.width_px / 2).all()
            assert (points < np.array(SIZE[::-1]) - images.width_px / 2).all()
            speed = np.linalg.norm(curve(np.linspace(0, 1, 200), 1), axis=1)
            np.testing.assert_allclose(speed, curve.length, rtol=0.02)
            others = [other for i, other in enumerate(truth.curves) if i != number]
            assert min(closest(curve, other).min() for other in others) < 1.2 * images.width_px


def test_some_cables_run_side_by_side_and_some_end_under_others():
    images = TangleSequence(4, 5, SIZE)
    beside = under = 0
    for index in range(5):
        curves = images.truth(index).curves
        for curve in curves:
            for other in curves:
                if other is not curve:
                    near = closest(other, curve)
                    width = images.width_px
                    beside += ((near > 0.85 * width) & (near < 1.2 * width)).mean() * curve.length > 5 * width
                    under += min(near[0], near[-1]) < 0.1 * width
    assert beside >= 5
    assert under >= 5


def test_every_pixel_belongs_to_the_topmost_cable_over_it():
    images = TangleSequence(5, 1, SIZE)
    truth = images.truth(0)
    owner = np.full(SIZE, -1)
    for number, curve in enumerate(truth.curves):
        owner[draw_tube_mask(curve, images.width_px, SIZE)] = number
    wrong = sum(np.count_nonzero(mask ^ (owner == i)) for i, mask in enumerate(truth.visible_masks))
    assert wrong <= 0.005 * truth.mask.sum()


def test_strewn_cables_lie_apart_and_some_are_cut_by_the_border():
    images = StrewnSequence(6, 12, SIZE)
    cut = crossings = 0
    for index in range(12):
        curves = images.truth(index).curves
        assert len(curves) == 6
        for curve in curves:
            ends = np.array([curve.start, curve.end])
            cut += (np.minimum(ends, np.array(SIZE[::-1]) - 1.0 - ends).min(axis=1) < 1.0).sum()
            others = [other for other in curves if other is not curve]
            near = np.min([closest(other, curve) for other in others], axis=0)
            crossings += near.min() < images.width_px / 2.0
            assert (near < 0.7 * images.width_px).mean() < 0.3
    assert 10 < cut < 72
    assert 20 < crossings < 72


def test_cables_are_strewn_where_nowhere_beside_another_shows_enough():
    assert len(several_cables(1.0, 1)[0].truth(4).curves) == 2


@pytest.mark.parametrize(
    "make", [lambda seed: TangleSequence(4, 3, SMALL, seed), lambda seed: several_cables(0.3, seed, SMALL)[3]]
)
def test_images_are_the_same_bit_for_bit_in_any_order_and_after_pickling(make):
    one, other = make(0), pickle.loads(pickle.dumps(make(0)))
    other.truth(0)
    np.testing.assert_array_equal(one.frame(2).mask, other.frame(2).mask)
    assert one.truth(2).curves == other.truth(2).curves
    assert (one.frame(1).mask != one.frame(2).mask).any()
    assert (make(1).frame(2).mask != one.frame(2).mask).any()


def test_images_that_cannot_be_are_refused():
    with pytest.raises(InputError, match=r"cables must be in 2\.\.20, got 1"):
        TangleSequence(1)
    with pytest.raises(InputError, match=r"width_px must be in 1\.\.48 here, got 60"):
        TangleSequence(3, width_px=60.0)
    with pytest.raises(InputError, match="scale must be positive"):
        several_cables(0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_kinds_keep_length_and_radius_move_smoothly_and_stay_inside(kind):
    for seed in (0, 7):
        one = KindSequence(kind, 120, SIZE, seed)
        strands = [one._strands(index) for index in range(0, 120, 5)]
        for number in range(len(strands[0])):
            cable = [moment[number] for moment in strands]
            np.testing.assert_allclose([c.curve().length for c in cable], cable[0].length, rtol=1e-3)
            points = np.array([c.points[:: len(c.points) // 50] for c in cable])
            steps = np.linalg.norm(np.diff(points, axis=0), axis=2).max(axis=1) / 5.0
            assert steps.max() < (40.0 if "rapid" in kind else 16.0)
            assert points.min() > one.width_px / 2
            assert (points < np.array(SIZE[::-1]) - one.width_px / 2).all()
            assert min(1 / np.abs(c.bending).max() for c in cable) > 2.0 * one.width_px


def test_kinds_do_what_their_names_say():
    sharpest = {
        kind: [
            1 / np.abs(s.bending).max() / 6 for i in range(0, 120, 6) for s in KindSequence(kind, 120, SIZE)._strands(i)
        ]
        for kind in KINDS[:3]
    }
    assert min(sharpest["one loop"]) < 2.5
    assert min(sharpest["high curvature"]) < 3.5
    unties = KindSequence("a loop that unties", 30, SIZE)
    covered = [unties.truth(i).mask.sum() / (unties.truth(i).curves[0].length * unties.width_px) for i in (0, 29)]
    # Where the cable lies over itself its area is counted once.
    assert covered[0] < covered[1]
    assert len(KindSequence("three cables", 3, SIZE).truth(0).curves) == 3
    assert len(KindSequence("five cables", 3, SIZE).truth(0).curves) == 5


def test_rapid_moves_keep_their_speed_and_others_their_whole():
    for kind, same in (("rapid moves 1", True), ("high curvature", False)):
        few, many = KindSequence(kind, 12, SIZE), KindSequence(kind, 120, SIZE)
        assert (few._strands(3)[0].points == many._strands(3)[0].points).all() == same
        assert few.fps == (30.0 if same else 3.0)
    np.testing.assert_array_equal(few._strands(3)[0].points, many._strands(30)[0].points)


def test_kinds_come_clean_and_degraded():
    suite = {one.name: one for one in kinds(0.01, 2, SIZE)}
    one_cable = list(KINDS[:5])
    assert list(suite) == [
        *one_cable,
        *(f"{kind}, noisy" for kind in one_cable),
        "high curvature, occluded",
        "one loop, occluded",
        "three cables",
        "three cables, occluded",
        "five cables",
        "five cables, noisy",
    ]
    assert all(len(one) == 3 for one in suite.values())
    for name, worse in suite.items():
        kind, _, how = name.partition(", ")
        if not how:
            continue
        clean = suite[kind]
        # Lengths go in proportion with the image, which has half the size of an HD one.
        assert worse.degradation == {"noisy": NOISY, "occluded": OCCLUDED}[how].scaled(0.5)
        assert worse.truth(1).curves == clean.truth(1).curves
        assert (worse.frame(1).mask != clean.frame(1).mask).any()
        if how == "occluded":
            assert worse.truth(1).mask.sum() < clean.truth(1).mask.sum()
            np.testing.assert_array_equal(worse.frame(1).mask, worse.truth(1).mask)
        else:
            np.testing.assert_array_equal(worse.truth(1).mask, clean.truth(1).mask)


@pytest.mark.parametrize("seed", range(4))
def test_a_loop_closes_down_to_a_radius_of_two_widths(seed):
    loops = KindSequence("one loop", 120, seed=seed)
    strands = [loops._strands(i)[0] for i in range(0, 120, 4)]
    tightest = min(1.0 / np.abs(strand.bending).max() / loops.width_px for strand in strands)
    assert 2.0 <= tightest < 2.4
    assert all(approach(strand.points[::8], 60.0, 8.0 * strand.spacing) < loops.width_px for strand in strands)


def approach(points, apart_px, spacing):
    """How near a cable comes to itself, places along it that are less than so far apart aside."""
    least = round(apart_px / spacing)
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    return distance[np.triu_indices(len(points), least)].min()


def test_kinds_can_be_pickled_and_are_the_same_again():
    suite = kinds(0.05, 5, SMALL)
    assert len(suite) > 10
    for one in suite:
        other = pickle.loads(pickle.dumps(one))
        np.testing.assert_array_equal(one.frame(4).mask, other.frame(4).mask)
    with pytest.raises(InputError, match="kind must be one of 'high curvature'"):
        KindSequence("knot")
    with pytest.raises(InputError, match="more tightly than two widths"):
        KindSequence("one loop", width_px=20.0)
