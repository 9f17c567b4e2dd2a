from dataclasses import replace

import numpy as np
import pytest
from builders import curve_through

from dloftbs_lab.evaluation.curve_matching import match_distances
from dloftbs_lab.evaluation.runner.found import found_in
from dloftbs_lab.evaluation.runner.frame_scores import score
from dloftbs_lab.evaluation.runner.known_frame import KnownFrame, surface_line
from dloftbs_lab.evaluation.runner.space_scores import score_in_space
from dloftbs_lab.evaluation.runner.visible_truth import distances_of
from dloftbs_lab.synthetic import rgbd_artificial
from dloftbs_lab.truth import Truth


@pytest.fixture(scope="module")
def scene():
    sequence = rgbd_artificial(0.01, size=(360, 640))[3]
    return sequence, sequence.frame(1), sequence.truth(1)


def scored(scene, points):
    sequence, frame, truth = scene
    found = found_in([points], frame)
    known = KnownFrame(frame, truth, sequence.radius_m)
    return score_in_space(found, match_distances(distances_of(found, known)[0]), known)


def test_the_surface_line_is_a_radius_before_the_axis_and_across_it(scene):
    sequence, _, truth = scene
    axis = truth.curves_3d[0].sample(1000)
    line = surface_line(axis, sequence.radius_m)
    away = line - axis
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), sequence.radius_m, rtol=1e-9)
    tangents = np.gradient(axis, axis=0)
    assert np.abs((away * tangents).sum(axis=1)).max() < 1e-9
    assert ((away * axis).sum(axis=1) < 0.0).all()


def test_a_cable_that_points_at_the_camera_has_its_tip_in_front():
    axis = np.column_stack((np.zeros(5), np.zeros(5), np.linspace(1.0, 1.4, 5)))
    np.testing.assert_allclose(surface_line(axis, 0.01)[0], (0.0, 0.0, 0.99))


def test_the_axis_and_the_surface_each_have_a_perfect_curve(scene):
    sequence, _, truth = scene
    axis = truth.curves_3d[0].sample(1000)
    on_axis, on_surface = scored(scene, axis), scored(scene, surface_line(axis, sequence.radius_m))
    radius_mm = 1e3 * sequence.radius_m
    assert (on_axis.l3_mm, on_surface.l3_surface_mm) == (pytest.approx(0.0, abs=0.01), pytest.approx(0.0, abs=0.01))
    assert on_axis.l3_surface_mm == pytest.approx(radius_mm, rel=0.05)
    assert on_surface.l3_mm == pytest.approx(radius_mm, rel=0.05)
    # Perfect depth is that of the surface: its pixels are a radius from the axis, and the line lies among them.
    assert on_axis.l2_mm == pytest.approx(radius_mm, rel=0.05)
    assert on_surface.l2_mm < 1.0  # pixels are 1.9 mm apart there
    assert on_surface.l1_mm < on_axis.l1_mm


@pytest.mark.parametrize("count", [2, 20, 5000])
def test_the_cover_of_a_line_does_not_depend_on_how_many_points_it_has(scene, count):
    start, end = scene[2].curves_3d[0].sample(2)
    line, same = (scored(scene, start + np.linspace(0.0, 1.0, n)[:, np.newaxis] * (end - start)) for n in (1000, count))
    assert (same.l1_mm, same.l2_mm) == (pytest.approx(line.l1_mm), pytest.approx(line.l2_mm))


def test_without_space_there_is_nothing_to_say(scene):
    sequence, frame, truth = scene
    flat = truth.curves[0].sample(200)
    assert scored(scene, flat).l3_mm is None
    plain = Truth(truth.curves, truth.visible_masks, truth.ids)
    known = KnownFrame(frame, plain, sequence.radius_m)
    assert score(found_in([truth.curves_3d[0]], frame), known).l1_mm is None


def test_pixels_of_a_probability_in_space_are_those_from_one_half_on(scene):
    sequence, frame, truth = scene
    soft = replace(frame, mask=np.where(frame.mask, 0.9, 0.02))
    hard, seen = (KnownFrame(one, truth, sequence.radius_m).cloud.points for one in (frame, soft))
    assert np.array_equal(seen, hard)


def test_without_a_radius_nothing_is_said_of_the_surface(scene):
    _, frame, truth = scene
    made = score(found_in([curve_through(truth.curves_3d[0].sample(50))], frame), KnownFrame(frame, truth))
    assert made.l3_surface_mm is None
    assert made.l3_mm < 1.0
