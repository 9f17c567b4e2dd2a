"""Parts of tracks in space."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import curve_through, detection_of, line

from dloftbs import BSplineCurve, PinholeCamera, Tracker
from dloftbs.data.curve_samples import sample_curve
from dloftbs.evidence import OcclusionEvidence
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.reconstruction import EVEN_U, cut, fit_samples

CAMERA = PinholeCamera(600.0, 600.0, 320.0, 240.0)
SIZE = (480, 640)


def curve_at(depths_m: np.ndarray) -> BSplineCurve:
    """Return the curve in space, by its length, of a straight cable from column 20 to 620, at these distances."""
    columns = np.linspace(20.0, 620.0, len(depths_m))
    points = np.stack(((columns - CAMERA.cx) / CAMERA.fx * depths_m, np.zeros(len(depths_m)), depths_m), axis=1)
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    evenly = [np.interp(EVEN_U * along[-1], along, column) for column in points.T]
    return fit_samples(np.stack(evenly, axis=1))


def seen_columns(curve: BSplineCurve, span: tuple[float, float]) -> list[float]:
    """Return the columns in which a camera sees both ends of a span."""
    points = curve(np.array(span))
    return (CAMERA.fx * points[:, 0] / points[:, 2] + CAMERA.cx).tolist()


@pytest.mark.parametrize("span", [(0.0, 0.3), (0.25, 0.6), (0.7, 1.0), (0.0, 1.0)])
@pytest.mark.parametrize(
    "depths_m",
    [
        np.interp(np.linspace(0.0, 1.0, 121), [0.47, 0.53], [0.6, 0.9]),  # it goes over to another cable
        np.linspace(0.4, 1.2, 121),  # it is tilted
    ],
)
def test_a_span_in_space_is_seen_where_the_one_in_the_image_is(depths_m, span):
    view = View(SIZE, OcclusionEvidence(depth=np.ones(SIZE, np.float32), camera=CAMERA))
    curve = curve_at(depths_m)
    expected = [20.0 + 600.0 * u for u in span]
    np.testing.assert_allclose(seen_columns(curve, view.span_in_space(curve, span)), expected, atol=3.0)
    if span != (0.0, 1.0):
        assert np.abs(np.subtract(seen_columns(curve, span), expected)).max() > 15.0  # the same span is seen elsewhere


def tilted() -> tuple[BSplineCurve, BSplineCurve]:
    """Return a straight cable from column 20 to 620, by its length in the image, and in space."""
    return line((20.0, 240.0), (620.0, 240.0)), curve_at(np.linspace(0.5, 1.5, 121))


def test_what_is_hidden_of_a_tilted_cable_is_the_same_stretch_in_the_image_and_in_space():
    curve, curve_3d = tilted()
    ground = np.full(SIZE, 3.0, np.float32)
    tracker = Tracker()
    for k in range(12):
        tracker.update(
            [detection_of(curve, curve_3d)], k / 30, SIZE, occlusion=OcclusionEvidence(depth=ground, camera=CAMERA)
        )
    covered = ground.copy()
    covered[:, :440] = 0.3
    (track,) = tracker.update([], 0.4, SIZE, occlusion=OcclusionEvidence(depth=covered, camera=CAMERA))
    assert 400.0 < track.curve.end[0] < 450.0
    assert seen_columns(track.curve_3d, (0.0, 1.0)) == pytest.approx(
        [track.curve.start[0], track.curve.end[0]], abs=3.0
    )


def test_a_hidden_cable_moves_in_space_as_in_the_image_where_its_motion_there_is_unknown():
    """Its depth jumped in the last frame that showed it."""
    tracker, ground = Tracker(), np.full(SIZE, 3.0, np.float32)
    for k in range(8):
        depth_m = 1.5 if k == 7 else 1.0
        columns = np.linspace(150.0, 450.0, 12) + 4.0 * k
        points = np.stack(((columns - CAMERA.cx) / CAMERA.fx, 0.0 * columns, 1.0 + 0.0 * columns), axis=1) * depth_m
        seen = replace(detection_of(curve_through(CAMERA.project(points)), curve_through(points)), camera=CAMERA)
        (track,) = tracker.update([seen], k / 30, SIZE, occlusion=OcclusionEvidence(depth=ground, camera=CAMERA))
    assert track.velocity_3d is None
    covered = np.full(SIZE, 0.3, np.float32)
    for k in range(8, 12):
        (track,) = tracker.update([], k / 30, SIZE, occlusion=OcclusionEvidence(depth=covered, camera=CAMERA))
    assert track.curve.start[0] > 150.0 + 4.0 * 8
    np.testing.assert_allclose(CAMERA.project(track.curve_3d.start[None])[0], track.curve.start, atol=0.5)


def test_what_is_hidden_is_less_sure_in_space_the_farther_from_what_is_seen():
    curve, curve_3d = tilted()
    tracker, ground = Tracker(), np.full(SIZE, 3.0, np.float32)
    for k in range(12):
        whole = replace(detection_of(curve, curve_3d), camera=CAMERA)
        tracker.update([whole], k / 30, SIZE, occlusion=OcclusionEvidence(depth=ground, camera=CAMERA))
    ground[:, 320:] = 0.3
    evidence = OcclusionEvidence(depth=ground, camera=CAMERA)
    half_3d = cut(curve_3d, View(SIZE, evidence).span_in_space(curve_3d, (0.0, 0.5)))
    seen = replace(detection_of(cut(curve, (0.0, 0.5)), half_3d), camera=CAMERA)
    (track,) = tracker.update([seen], 0.4, SIZE, occlusion=evidence)
    near, far, farther = track.curve_3d_std([0.2, 0.7, 0.95])
    assert track.curve_3d.length > 1.5 * half_3d.length
    assert near < 0.002 < far < farther - 0.002


def test_the_end_of_a_part_is_as_far_as_that_part_ends():
    curve, curve_3d = tilted()
    depth = np.full(SIZE, 3.0, np.float32)
    middle = 0.5 * (0.5 + 1.5)
    depth[:, 320:] = middle + 0.02  # the ground close behind the end; by length, the curve is farther half of the way
    view = View(SIZE, OcclusionEvidence(depth=depth, camera=CAMERA))
    half = sample_curve(curve, 0.0, 0.5)[0]
    assert not view.look_beyond(half, 8.0, curve_3d, (0.0, 0.5))[1].hidden
    depth[:, 320:] = middle - 0.2
    view = View(SIZE, OcclusionEvidence(depth=depth, camera=CAMERA))
    assert view.look_beyond(half, 8.0, curve_3d, (0.0, 0.5))[1].hidden


def test_without_a_camera_a_span_stays_the_same():
    assert View(SIZE).span_in_space(curve_at(np.full(121, 0.8)), (0.2, 0.7)) == (0.2, 0.7)
