"""What is wrong with the depth of a camera, in the amounts that were asked for; and hands."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from dloftbs.errors import InputError
from dloftbs_lab.synthetic import TYPICAL_NOISE, DepthNoise, RgbdSequence, depth_sigma, rgbd_manipulation, rgbd_noisy
from dloftbs_lab.synthetic.hand import Hand
from dloftbs_lab.synthetic.signals import keyed, steady
from dloftbs_lab.synthetic.space_axis import SpaceMotion, Wave
from dloftbs_lab.synthetic.space_scene import SpaceScene, View

SIZE = (360, 640)


def bar(depth_m=0.8, behind_m=1.2, size=SIZE):
    mask = np.zeros(size, bool)
    mask[100:120, 50:600] = True
    return np.where(mask, np.float32(depth_m), np.float32(behind_m)), mask


def rng():
    return np.random.default_rng(7)


def test_without_noise_depth_is_as_it_was():
    depth, mask = bar()
    assert DepthNoise().apply(depth, mask, rng()) is depth


def test_sigma_is_1_mm_at_half_a_metre_and_4_mm_at_one_and_a_half():
    np.testing.assert_allclose(depth_sigma([0.5, 1.5]), [0.001, 0.004])


@pytest.mark.parametrize("distance", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_noise_is_gaussian_and_grows_with_distance(distance, factor):
    depth = np.full(SIZE, distance, np.float32)
    error = DepthNoise(depth_noise=factor).apply(depth, depth > 0, rng()) - depth
    sigma = factor * float(depth_sigma(distance))
    assert error.std() == pytest.approx(sigma, rel=0.02)
    assert abs(error.mean()) < 0.02 * sigma
    assert (np.abs(error) < sigma).mean() == pytest.approx(0.683, abs=0.01)


@pytest.mark.parametrize("grain_px", [1.0, 3.0])
def test_grain_goes_together_over_its_px_and_keeps_its_size(grain_px):
    depth = np.full(SIZE, 1.0, np.float32)
    error = DepthNoise(depth_noise=1.0, grain_px=grain_px).apply(depth, depth > 0, rng()) - depth
    assert error.std() == pytest.approx(float(depth_sigma(1.0)), rel=0.05)
    assert error[:20].std() == pytest.approx(float(depth_sigma(1.0)), rel=0.25)  # at the border, too
    for lag in (1, 2, round(2 * grain_px)):
        measured = np.corrcoef(error[:, lag:].ravel(), error[:, :-lag].ravel())[0, 1]
        # Two Gaussian windows of sigma s, a lag apart, overlap as exp(-lag^2 / (4 s^2)).
        assert measured == pytest.approx(np.exp(-((lag / (2 * grain_px)) ** 2)), abs=0.05)


def test_white_noise_has_no_grain():
    depth = np.full(SIZE, 1.0, np.float32)
    error = DepthNoise(depth_noise=1.0).apply(depth, depth > 0, rng()) - depth
    assert abs(np.corrcoef(error[:, 1:].ravel(), error[:, :-1].ravel())[0, 1]) < 0.01


def test_steps_are_those_of_disparity():
    depth = np.tile(np.linspace(0.5, 1.5, SIZE[1], dtype=np.float32), (SIZE[0], 1))
    stepped = DepthNoise(quantum_m=0.02).apply(depth, depth > 0, rng())
    levels = np.unique(stepped)
    assert np.diff(1.0 / levels) == pytest.approx(-0.02, rel=1e-3)
    middle = 0.5 * (levels[1:] + levels[:-1])
    assert np.diff(levels) == pytest.approx(0.02 * middle**2, rel=0.01)
    assert (np.abs(stepped - depth) <= 0.5 * 0.02 * depth**2 * 1.02).all()


@pytest.mark.parametrize("name", ["depth_noise", "hole_share", "flying", "grain_px", "quantum_m"])
@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf")])
def test_noise_out_of_range(name, value):
    with pytest.raises(InputError, match=f"{name} must be a finite number"):
        DepthNoise(**{name: value})


@pytest.mark.parametrize("share", [0.02, 0.05, 0.2])
def test_holes_take_the_share_of_the_cable_in_blobs(share):
    depth, mask = bar()
    holes = DepthNoise(hole_share=share).apply(depth, mask, rng()) == 0
    assert holes[mask].mean() == pytest.approx(share, abs=0.002)
    assert holes[~mask].mean() == pytest.approx(share, rel=0.6)
    lone = holes[1:-1, 1:-1] & ~(holes[:-2, 1:-1] | holes[2:, 1:-1] | holes[1:-1, :-2] | holes[1:-1, 2:])
    assert lone.sum() < 0.02 * holes.sum()


def test_holes_need_no_cable():
    depth, mask = bar()
    np.testing.assert_array_equal(DepthNoise(hole_share=0.05).apply(depth, mask & False, rng()), depth)


def test_flying_pixels_are_mixtures_at_edges_on_both_sides():
    depth, mask = bar()
    flown = DepthNoise(flying=0.4).apply(depth, mask, rng())
    changed = flown != depth
    edge = np.zeros_like(mask)
    edge[99:101, 49:601] = edge[119:121, 49:601] = True
    edge[99:121, 49:51] = edge[99:121, 599:601] = True
    assert not changed[~edge].any()
    assert changed[edge].mean() == pytest.approx(0.4, abs=0.04)
    assert changed[mask].any()
    assert changed[~mask].any()
    assert (flown[changed] > 0.8).all()
    assert (flown[changed] < 1.2).all()
    assert flown[changed].std() > 0.1


def test_sequences_have_the_noise_that_was_asked_for():
    noisy = rgbd_manipulation(0.02, 0, SIZE, replace(TYPICAL_NOISE, flying=0.0))[0]
    clean = rgbd_manipulation(0.02, 0, SIZE, DepthNoise())[0]
    frame, exact = noisy.frame(1), clean.frame(1)
    np.testing.assert_array_equal(frame.mask, exact.mask)
    assert (frame.depth[frame.mask] == 0).mean() == pytest.approx(0.05, abs=0.005)
    error = ((frame.depth - exact.depth) / depth_sigma(exact.depth))[frame.depth > 0]
    assert error.std() == pytest.approx(1.0, abs=0.01)
    assert (rgbd_manipulation(0.02, 0, SIZE)[0].frame(1).depth != frame.depth).any()


def test_the_noisy_suite_has_every_scene_by_two_cameras_near_and_far():
    sequences = rgbd_noisy(0.04, 0, SIZE)
    assert [sequence.name for sequence in sequences[:4]] == [
        "0 high curvature, time of flight, near",
        "0 high curvature, time of flight, far",
        "0 high curvature, stereo, near",
        "0 high curvature, stereo, far",
    ]
    assert len({sequence.name for sequence in sequences}) == len(sequences) == 20
    sigma = []
    for sequence in sequences:
        clean = RgbdSequence(sequence.scene, len(sequence), SIZE)
        frame, exact = sequence.frame(1), clean.frame(1)
        np.testing.assert_array_equal(frame.mask, exact.mask)
        assert (frame.depth[frame.mask] == 0).mean() == pytest.approx(0.05, abs=0.01)
        kernel = np.ones((3, 3), np.uint8)
        calm = cv2.dilate(exact.depth, kernel) - cv2.erode(exact.depth, kernel) < 0.003  # where nothing flies
        error = ((frame.depth - exact.depth) / depth_sigma(exact.depth))[calm & (frame.depth > 0)]
        # A step s of disparity has a variance of s^2 / 12 beside that of the noise.
        steps = np.mean(sequence.noise.quantum_m * exact.depth**2 / depth_sigma(exact.depth))
        assert error.std() == pytest.approx(np.sqrt(1.0 + steps**2 / 12.0), abs=0.03)
        (axis,) = sequence.truth(1).curves_3d
        assert axis.length == pytest.approx(clean.scene.motion.length_m, rel=1e-3)
        sigma += depth_sigma(axis.sample(50)[:, 2]).tolist()
    assert 1.2e-3 < min(sigma) < 1.5e-3  # the range of noise is covered, the far end of it too
    assert 3.5e-3 < max(sigma) < 4.0e-3


def test_neighbours_agree_more_by_stereo():
    both = [rgbd_noisy(0.04, 0, (720, 1280))[i] for i in (0, 2)]
    agree = []
    for sequence in both:
        exact = RgbdSequence(sequence.scene, len(sequence), (720, 1280)).frame(1)
        error = np.where(exact.mask, 0.0, np.clip(sequence.frame(1).depth - exact.depth, -0.005, 0.005))[:200]
        agree.append(np.corrcoef(error[:, 1:].ravel(), error[:, :-1].ravel())[0, 1])
    assert agree[1] > agree[0] + 0.1


def held(presence):
    motion = SpaceMotion(0.5, (Wave(0.0, steady(0.1)),))
    hands = (Hand(0.5, np.pi / 2, presence),)
    return RgbdSequence(SpaceScene("held", 3, 0.005, motion, View(0.8, 0.2, 0.006), hands), size=SIZE, with_image=True)


def test_a_hand_hides_the_cable_and_has_a_depth_and_a_colour_of_its_own():
    sequence = held(keyed((0.0, 0.0), (1.0, 1.0)))
    free, gripped = sequence.frame(0), sequence.frame(2)
    lost = free.mask & ~gripped.mask
    assert 20 < lost.sum() < 0.2 * free.mask.sum()
    assert not (gripped.mask & ~free.mask).any()
    assert (gripped.depth[lost] < free.depth[lost]).all()
    assert np.median((free.depth - gripped.depth)[lost]) > 0.005
    blue, _, red = gripped.image[lost].mean(axis=0)
    assert red > blue
    blue, _, red = gripped.image[gripped.mask].mean(axis=0)
    assert blue > red
    assert sequence.truth(2).curves[0].length == pytest.approx(sequence.truth(0).curves[0].length)


def test_hands_hide_some_of_the_cable_in_every_scene_but_never_most_of_it():
    sequences = rgbd_manipulation(0.02, 0, SIZE)
    assert len(sequences) > 2
    for sequence in sequences:
        without = RgbdSequence(_unhanded(sequence.scene), len(sequence), SIZE)
        shares = [
            1.0 - sequence.frame(index).mask.sum() / without.frame(index).mask.sum() for index in range(len(sequence))
        ]
        assert max(shares) > 0.01, sequence.name
        assert max(shares) < 0.35, sequence.name


def _unhanded(scene):
    return SpaceScene(scene.name, scene.frames, scene.radius_m, scene.motion, scene.view)
