import pickle
from functools import cache

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dloftbs.errors import InputError
from dloftbs_lab.synthetic import RGB_SCENARIOS, DemoSequence, RgbSequence, rgb

SIZE = (180, 320)


@cache
def sequence(scenario):
    return RgbSequence(scenario, 12, SIZE)


def seen_share(scenario, index):
    """What share of the centre line is seen."""
    truth = sequence(scenario).truth(index)
    points = truth.curves[0].sample(400).round().astype(int)
    inside = ((points >= 0) & (points < np.array(SIZE[::-1]))).all(axis=1)
    return truth.mask[points[inside, 1], points[inside, 0]].sum() / len(points)


def test_there_are_900_frames_at_full_scale_and_three_at_least():
    assert sum(len(one) for one in rgb()) == 900
    small = rgb(0.001, seed=4, size=SIZE)
    assert [len(one) for one in small] == [3] * 7
    assert tuple(one.scenario for one in small) == RGB_SCENARIOS
    assert [one.name for one in small[:2]] == ["0 plain", "1 thick"]
    assert small[0].fps == pytest.approx(3 / 4.3)


@pytest.mark.parametrize("scenario", RGB_SCENARIOS)
def test_frames_are_the_same_bit_for_bit_in_any_order_and_after_pickling(scenario):
    one = sequence(scenario)
    first = one.frame(5)
    data = pickle.dumps(one)
    assert len(data) < 2000
    other = pickle.loads(data)
    other.truth(2)
    again = other.frame(5)
    np.testing.assert_array_equal(first.image, again.image)
    np.testing.assert_array_equal(first.mask, again.mask)
    np.testing.assert_array_equal(one.truth(5).mask, other.truth(5).mask)
    assert one.truth(5).curves == other.truth(5).curves
    assert (one.frame(6).image != first.image).any()
    assert (RgbSequence(scenario, 12, SIZE, seed=1).frame(5).image != first.image).any()


@pytest.mark.parametrize("scenario", RGB_SCENARIOS)
def test_the_hue_finds_the_cable_where_it_is_visible(scenario):
    for index in (0, 4, 8):
        frame, truth = sequence(scenario).frame(index), sequence(scenario).truth(index)
        overlap = (frame.mask & truth.mask).sum() / (frame.mask | truth.mask).sum()
        # At a quarter of HD the thin cable is 1.25 px wide: anti-aliasing takes most of its colour.
        assert overlap > (0.25 if "thin" in scenario else 0.8)
        assert frame.name == f"{RGB_SCENARIOS.index(scenario)} {scenario}#{index:04d}"
        assert truth.ids == (0,)


@pytest.mark.parametrize("scenario", RGB_SCENARIOS)
def test_the_cable_keeps_its_length_moves_smoothly_and_stays_inside_unless_meant(scenario):
    one = RgbSequence(scenario, 129, SIZE, seed=2)
    curves = [one._strand(index).curve() for index in range(0, 129, 4)]
    np.testing.assert_allclose([c.length for c in curves], curves[0].length, rtol=1e-3)
    points = np.array([c.sample(60) for c in curves])
    steps = np.linalg.norm(np.diff(points, axis=0), axis=2).max(axis=1) / 4.0
    assert 0.05 < steps.max() < 30.0 * 0.25
    inside = (points > one.width_px / 2).all() and (points < np.array(SIZE[::-1]) - one.width_px / 2).all()
    assert inside == ("out of the image" not in scenario)


@pytest.mark.parametrize("scenario", ["plain", "thick"])
def test_the_truth_runs_in_the_middle_of_the_mask(scenario):
    for index in (1, 6):
        truth = sequence(scenario).truth(index)
        rows, columns = np.nonzero(truth.mask)
        points = truth.curves[0].sample(2000)
        distance, _ = cKDTree(points).query(np.stack((columns, rows), axis=1))
        half = sequence(scenario).width_px / 2
        assert distance.max() <= half + 0.05
        # Evenly spread from the middle to both edges.
        assert distance.mean() == pytest.approx(half / 2, rel=0.12)


def test_occluders_hide_what_they_should():
    shares = [[seen_share(name, i) for i in range(12)] for name in RGB_SCENARIOS]
    means = [np.mean(of_one) for of_one in shares]
    # As the paper has them: occlusions in 2 to 6, out of view in 3.
    assert min(means[:2]) > 0.95
    assert max(means[2:]) < 0.93
    assert means[5] < means[4] - 0.03
    assert min(shares[3]) < 0.8 < max(shares[3])


def test_only_the_last_scenario_crosses_itself():
    for name in RGB_SCENARIOS:
        curve = sequence(name).truth(6).curves[0]
        points = curve.sample(200)
        apart = np.abs(np.subtract.outer(np.arange(200), np.arange(200))) > 30
        nearest = np.linalg.norm(points[:, None] - points, axis=2)[apart].min()
        assert (nearest < sequence(name).width_px) == (name == RGB_SCENARIOS[6])


def test_widths_differ_as_their_names_say_and_can_be_given():
    thin, plain, thick = (RgbSequence(name).width_px for name in ("thin, occluded", "plain", "thick"))
    assert thin < plain / 2 < thick / 4 + 1e-9
    assert RgbSequence("plain", 3, SIZE, width_px=7.0).width_px == 7.0
    assert RgbSequence("plain", 3, SIZE).width_px == 3.0


def test_the_demo_can_be_pickled_too():
    demo = DemoSequence(6, SIZE, 3, width_px=3.0, fps=12.0)
    again = pickle.loads(pickle.dumps(demo))
    np.testing.assert_array_equal(demo.frame(2).image, again.frame(2).image)
    assert (again.fps, len(again), again.name) == (12.0, 6, demo.name)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scenario": "knot"}, "scenario must be one of 'plain'"),
        ({"frames": 0}, "frames >= 1"),
        ({"seed": -1}, "seed >= 0"),
        ({"size": (20, 400)}, "at least 64 x 64"),
        ({"width_px": 0.2}, "width_px must be at least 1"),
        ({"width_px": 200.0}, "more tightly than two widths"),
    ],
)
def test_what_cannot_be_is_refused_at_once(change, message):
    with pytest.raises(InputError, match=message):
        RgbSequence(**change)


def test_there_is_no_frame_outside_of_the_sequence_and_no_negative_scale():
    for method in (sequence("plain").frame, sequence("plain").truth):
        for index in (-1, 12):
            with pytest.raises(InputError, match=f"index must be in 0..11, got {index}"):
                method(index)
    for scale in (0.0, -1.0, float("nan")):
        with pytest.raises(InputError, match="scale must be positive"):
            rgb(scale)
