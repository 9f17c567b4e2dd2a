"""Cables in space: what is drawn agrees with the axis that is said to be true."""

from __future__ import annotations

import pickle
from functools import cache

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dloftbs.data.u_mapping import to_space
from dloftbs.errors import InputError
from dloftbs_lab.synthetic import DepthNoise, RgbdSequence, rgbd_artificial, rgbd_manipulation
from dloftbs_lab.synthetic.signals import steady
from dloftbs_lab.synthetic.space_axis import Bend, SpaceMotion, Wave
from dloftbs_lab.synthetic.space_scene import SpaceScene, View

SIZE = (360, 640)
SAMPLES = 400


@cache
def suites():
    """All 15 sequences, noise left out, and the indices of frames from all over them."""
    sequences = (*rgbd_artificial(0.1, size=SIZE), *rgbd_manipulation(0.1, size=SIZE, noise=DepthNoise()))
    return [(sequence, (0, len(sequence) // 2, len(sequence) - 1)) for sequence in sequences]


def flat_scene(bend=0.0):
    heading = (Wave(0.0, steady(0.3)), Bend(0.2, 0.8, steady(bend), ease=0.2))
    motion = SpaceMotion(0.4, heading)
    return SpaceScene("flat", 5, 0.005, motion, View(0.8, 0.0, 0.006))


@cache
def frame_and_truth(number, which):
    sequence, indices = suites()[number]
    return sequence.frame(indices[which]), sequence.truth(indices[which])


EVERY_SCENE = pytest.mark.parametrize("number", range(15))


@EVERY_SCENE
def test_every_visible_pixel_lies_on_the_surface_around_the_axis(number):
    sequence, _ = suites()[number]
    frame, truth = frame_and_truth(number, 1)
    rows, columns = np.nonzero(frame.mask)
    surface = frame.camera.deproject(np.stack((columns, rows), axis=1), frame.depth[rows, columns])
    distance, _ = cKDTree(truth.curves_3d[0].sample(20000)).query(surface)
    np.testing.assert_allclose(distance, sequence.scene.radius_m, rtol=0, atol=5e-5)
    assert len(rows) > 200


@EVERY_SCENE
def test_the_curve_in_the_image_is_the_projection_of_the_axis(number):
    frame, truth = frame_and_truth(number, 1)
    projected = frame.camera.project(truth.curves_3d[0].sample(SAMPLES))
    dense = truth.curves[0].sample(20000)
    assert cKDTree(dense).query(projected)[0].max() < 0.1
    assert np.abs(projected[[0, -1]] - dense[[0, -1]]).max() < 1e-6
    for curve in (truth.curves[0], truth.curves_3d[0]):
        speed = np.linalg.norm(curve(np.linspace(0.0, 1.0, 101), 1), axis=1)
        np.testing.assert_allclose(speed, curve.length, rtol=0.01)


@EVERY_SCENE
def test_the_cable_keeps_its_length(number):
    sequence, indices = suites()[number]
    lengths = [frame_and_truth(number, which)[1].curves_3d[0].length for which in range(len(indices))]
    np.testing.assert_allclose(lengths, sequence.scene.motion.length_m, rtol=1e-3)


@EVERY_SCENE
def test_the_cable_stays_in_view_and_in_front_of_the_background(number):
    sequence, indices = suites()[number]
    for which in range(len(indices)):
        _, truth = frame_and_truth(number, which)
        axis = truth.curves_3d[0].sample(SAMPLES)
        points, depth = sequence.camera.project(axis), axis[:, 2]
        assert (points > 2).all()
        assert (points < np.array(SIZE[::-1]) - 3).all()
        columns, rows = points.round().astype(int).T
        assert (depth < sequence._background[rows, columns]).all()
        assert 0.45 < depth.min() < depth.max() < 1.55


@EVERY_SCENE
def test_no_bend_is_too_tight_to_be_a_cable(number):
    sequence, indices = suites()[number]
    for which in range(len(indices)):
        curve = frame_and_truth(number, which)[1].curves_3d[0]
        tightest = 1.0 / curve.curvature(np.linspace(0.02, 0.98, 500)).max()
        assert tightest > 2.5 * 2.0 * sequence.scene.radius_m


def self_crossings(curve):
    """Return pairs of parameters at which a plane curve meets itself."""
    u = np.linspace(0.0, 1.0, SAMPLES)
    points = curve(u)
    close = cKDTree(points).query_pairs(1.5 * curve.length / SAMPLES, output_type="ndarray")
    apart = close[np.abs(close[:, 0] - close[:, 1]) > SAMPLES // 20]
    return u[apart]


@pytest.mark.parametrize(
    ("number", "crossed"),
    [(1, (1, 1, 1)), (2, (1, 0, 0)), (7, (0, 1, 0)), (11, (1, 1, 1)), (12, (1, 1, 1)), (13, (1, 0, 0))],
)
def test_passes_are_two_radii_apart_and_the_upper_hides_the_lower(number, crossed):
    sequence, indices = suites()[number]
    seen = 0
    for which in range(len(indices)):
        frame, truth = frame_and_truth(number, which)
        flat, axis = truth.curves[0], truth.curves_3d[0]
        pairs = self_crossings(flat)
        assert (len(pairs) > 0) == crossed[which]
        depth = axis(to_space(pairs, axis, frame.camera))[..., 2]
        assert (np.abs(depth[:, 0] - depth[:, 1]) > 2.0 * sequence.scene.radius_m).all()
        for (x, y), z in zip(flat(pairs).mean(axis=1).round().astype(int), depth.min(axis=1), strict=True):
            if frame.mask[y, x]:
                seen += 1
                assert frame.depth[y, x] < z
    assert seen > 0


def test_the_surface_over_the_axis_is_nearer_by_the_radius():
    sequence = RgbdSequence(flat_scene(2.0), size=(720, 1280))
    frame, truth = sequence.frame(0), sequence.truth(0)
    axis = truth.curves_3d[0].sample(SAMPLES)
    columns, rows = frame.camera.project(axis).round().astype(int).T
    assert frame.mask[rows, columns].all()
    np.testing.assert_allclose(frame.depth[rows, columns], axis[:, 2] - 0.005, rtol=0, atol=2e-4)


def test_the_mask_is_as_wide_as_the_cable_and_the_truth_runs_in_its_middle():
    sequence = RgbdSequence(flat_scene(), size=(720, 1280))
    frame, truth = sequence.frame(0), sequence.truth(0)
    points = truth.curves[0].sample(SAMPLES)[40:-40]
    rows, columns = np.nonzero(frame.mask)
    tangent = truth.curves[0].tangent(0.5)
    across = (columns - points[0, 0]) * -tangent[1] + (rows - points[0, 1]) * tangent[0]
    assert abs(across.mean()) < 0.05
    assert np.ptp(across) == pytest.approx(2 * 0.005 * 900 / 0.8, abs=1.0)


def test_frames_are_the_same_bit_for_bit_in_any_order_and_after_pickling():
    sequence = rgbd_manipulation(0.05, 3, SIZE, with_image=True)[2]
    again = rgbd_manipulation(0.05, 3, SIZE, with_image=True)[2]
    frames = [sequence.frame(index) for index in (5, 2, 5)]
    for other in (again, pickle.loads(pickle.dumps(sequence))):
        frame = other.frame(5)
        for expected in (frames[0], frames[2]):
            np.testing.assert_array_equal(frame.mask, expected.mask)
            np.testing.assert_array_equal(frame.depth, expected.depth)
            np.testing.assert_array_equal(frame.image, expected.image)
        assert other.truth(5).curves == sequence.truth(5).curves
        assert other.truth(5).curves_3d == sequence.truth(5).curves_3d
    assert (frames[1].depth != frames[0].depth).any()


def test_a_pickle_is_small_even_after_use():
    sequence = rgbd_artificial(0.05, size=SIZE)[0]
    sequence.frame(0)
    sequence.truth(0)
    assert len(pickle.dumps(sequence)) < 10_000


def test_another_seed_gives_another_cable():
    first, second = (rgbd_artificial(0.05, seed, SIZE)[0] for seed in (0, 1))
    assert first.truth(0).curves != second.truth(0).curves


def test_frames_carry_what_a_tracker_needs():
    sequence = rgbd_artificial(0.05, size=SIZE)[1]
    frame = sequence.frame(4)
    assert frame.mask.dtype == np.bool_
    assert frame.depth.dtype == np.float32
    assert frame.image is None
    assert frame.camera == sequence.camera
    assert (frame.index, frame.stamp, frame.name) == (4, 4 / 30, "1 high curvature, self-intersection#0004")
    np.testing.assert_array_equal(sequence.truth(4).mask, frame.mask)
    assert [f.index for f in sequence] == list(range(len(sequence)))


def test_scale_multiplies_the_frames_and_leaves_at_least_three():
    full = [len(sequence) for sequence in rgbd_artificial()]
    assert sum(full) == 1400
    assert sum(len(sequence) for sequence in rgbd_manipulation()) == 2500
    assert [len(sequence) for sequence in rgbd_artificial(0.1)] == [round(0.1 * n) for n in full]
    assert {len(sequence) for sequence in rgbd_manipulation(0.001)} == {3}


def test_a_loop_unties_at_any_scale_but_shaking_keeps_its_speed():
    for number in (3, 4):
        short, long = (rgbd_artificial(scale, size=SIZE)[number] for scale in (0.05, 0.2))
        for index in range(5):
            np.testing.assert_array_equal(short.frame(index).depth, long.frame(index).depth)
    for scale in (0.02, 0.2):
        sequence = rgbd_artificial(scale, size=SIZE)[2]
        assert len(self_crossings(sequence.truth(0).curves[0])) > 0
        assert len(self_crossings(sequence.truth(len(sequence) - 1).curves[0])) == 0


@pytest.mark.parametrize("make", [rgbd_artificial, rgbd_manipulation])
@pytest.mark.parametrize("wrong", [{"scale": 0.0}, {"scale": float("nan")}, {"seed": -1}, {"size": (10, 100)}])
def test_values_out_of_range_are_refused(make, wrong):
    with pytest.raises(InputError, match=r"expected|must be"):
        make(**wrong)


@pytest.mark.parametrize("index", [-1, 5])
def test_a_frame_that_is_not_there_is_refused(index):
    sequence = RgbdSequence(flat_scene(), size=SIZE)
    for get in (sequence.frame, sequence.truth):
        with pytest.raises(InputError, match=r"index must be in 0\.\.4"):
            get(index)
