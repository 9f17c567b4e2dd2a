"""The baseline's tracker: it follows what it was told the start of, and says what is wrong with its input."""

import numpy as np
import pytest
from builders import curve_through

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs_lab import synthetic
from dloftbs_lab.evaluation import curve_l3
from dloftbs_lab.evaluation.baselines import LENGTHS, CoherentPointDrift
from dloftbs_lab.evaluation.baselines.coherent_point_drift import (
    NODES,
    STRETCH,
    points_in_image,
    points_in_space,
    thin_out,
    visibility,
)
from dloftbs_lab.truth import Truth

SIZE = (180, 320)


@pytest.fixture(scope="module")
def deep():
    """A slow cable in space."""
    return synthetic.rgbd_artificial(1.0, seed=7, size=SIZE)[0]


def test_a_cable_in_space_is_followed_within_its_width(deep):
    tracker = CoherentPointDrift()
    tracker.start(deep.frame(0), deep.truth(0))
    errors = [curve_l3(tracker(deep.frame(i))[0], deep.truth(i).curves_3d[0]) for i in range(12)]
    assert max(errors) < 0.02
    still = curve_l3(deep.truth(0).curves_3d[0], deep.truth(11).curves_3d[0])
    assert errors[-1] < still


def test_a_cable_in_the_image_is_followed():
    kind = synthetic.KindSequence("high curvature", 120, SIZE)
    tracker = CoherentPointDrift()
    tracker.start(kind.frame(0), kind.truth(0))
    (points,) = (tracker(kind.frame(i))[0] for i in [0])
    assert points.shape[1] == 2
    errors = [curve_l3(tracker(kind.frame(i))[0], kind.truth(i).curves[0]) for i in range(1, 10)]
    assert max(errors) < 4.0


def test_it_is_deterministic(deep):
    found = []
    for _ in range(2):
        tracker = CoherentPointDrift(0.9)
        tracker.start(deep.frame(0), deep.truth(0))
        found.append([tracker(deep.frame(i))[0] for i in range(3)])
    np.testing.assert_array_equal(found[0], found[1])


@pytest.mark.parametrize("length", LENGTHS)
def test_no_length_is_exceeded_by_more_than_the_limit(deep, length):
    tracker = CoherentPointDrift(length)
    tracker.start(deep.frame(0), deep.truth(0))
    for i in range(3):
        tracker(deep.frame(10 * i))
        edges = np.linalg.norm(np.diff(tracker._cable.nodes, axis=0), axis=1)
        limit = STRETCH * length * deep.truth(0).curves_3d[0].length / (NODES - 1)
        assert edges.max() <= limit * (1.0 + 1e-6)


def test_without_points_it_stays_where_it_was(deep):
    tracker = CoherentPointDrift()
    tracker.start(deep.frame(0), deep.truth(0))
    before = tracker(deep.frame(0))[0]
    frame = deep.frame(1)
    empty = Frame(mask=np.zeros(SIZE, bool), depth=frame.depth, camera=frame.camera)
    np.testing.assert_array_equal(tracker(empty)[0], before)


def test_a_hand_before_a_node_makes_it_count_less(deep):
    frame, truth = deep.frame(0), deep.truth(0)
    nodes = truth.curves_3d[0].sample(NODES)
    assert visibility(nodes, frame).min() > 0.9
    columns, rows = np.rint(frame.camera.project(nodes[:5])).astype(int).T
    low, high = np.array([rows.min() - 12, columns.min() - 12]).clip(0), np.array([rows.max(), columns.max()]) + 13
    mask, depth = frame.mask.copy(), frame.depth.copy()
    mask[low[0] : high[0], low[1] : high[1]] = False
    depth[low[0] : high[0], low[1] : high[1]] = 0.3
    covered = visibility(nodes, Frame(mask=mask, depth=depth, camera=frame.camera))
    assert covered[:5].max() < 0.1
    assert covered.max() > 0.9


def test_points_are_thinned_out_to_the_means_of_cells():
    points = np.array([[0.0, 0.0], [0.2, 0.0], [1.5, 0.0], [0.0, 1.2]])
    thinned = thin_out(points, 1.0)
    assert sorted(map(tuple, thinned.tolist())) == [(0.0, 1.2), (0.1, 0.0), (1.5, 0.0)]


def test_depth_in_counts_is_metres(deep):
    frame = deep.frame(0)
    counts = Frame(mask=frame.mask, depth=np.rint(1e3 * frame.depth).astype(np.uint16), camera=frame.camera)
    np.testing.assert_allclose(points_in_space(counts), points_in_space(frame), atol=2e-3)


def test_a_saturated_count_is_no_measurement(deep):
    frame = deep.frame(0)
    counts = np.rint(1e3 * frame.depth).astype(np.uint16)
    saturated = np.random.default_rng(0).random(counts.shape) < 0.3
    absent, full = (
        Frame(mask=frame.mask, depth=np.where(saturated, value, counts).astype(np.uint16), camera=frame.camera)
        for value in (0, 65535)
    )
    np.testing.assert_array_equal(points_in_space(full), points_in_space(absent))
    nodes = deep.truth(0).curves_3d[0].sample(NODES)
    np.testing.assert_array_equal(visibility(nodes, full), visibility(nodes, absent))


def line():
    return curve_through(np.column_stack((np.linspace(20.0, 180.0, 30), np.full(30, 60.0))))


@pytest.mark.parametrize("length", [0.0, -1.0, float("nan"), float("inf")])
def test_a_length_that_is_none_is_refused(length):
    with pytest.raises(InputError, match="length must be a positive share"):
        CoherentPointDrift(length)


def test_several_cables_are_refused():
    with pytest.raises(InputError, match="follows one cable that is known, got 2"):
        CoherentPointDrift().start(Frame(mask=np.ones(SIZE, bool)), Truth((line(), line()), (), (0, 1)))


def test_it_must_be_told_the_start(deep):
    with pytest.raises(InputError, match=r"call start\(frame, truth\)"):
        CoherentPointDrift()(deep.frame(0))


def test_in_space_it_needs_depth(deep):
    flat = Frame(mask=deep.frame(0).mask)
    with pytest.raises(InputError, match="needs frames with depth and a camera"):
        CoherentPointDrift().start(flat, deep.truth(0))
    tracker = CoherentPointDrift()
    tracker.start(deep.frame(0), deep.truth(0))
    with pytest.raises(InputError, match="needs frames with depth and a camera"):
        tracker(flat)


def test_the_points_of_a_probability_are_those_from_one_half_on():
    soft = np.full(SIZE, 0.02)
    soft[10, 20:24] = 0.9
    assert points_in_image(Frame(mask=soft)).tolist() == [[x, 10.0] for x in range(20, 24)]


def test_it_needs_a_mask():
    tracker = CoherentPointDrift()
    tracker.start(Frame(mask=np.ones(SIZE, bool)), Truth((line(),), (), (0,)))
    with pytest.raises(InputError, match="needs a mask"):
        tracker(Frame(image=np.zeros((*SIZE, 3), np.uint8)))
