"""Shapes and deviations of objects, and the answers that go with a result."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from builders import arc, line

import dloftbs
from dloftbs.data.answers import BendLimit, with_answers
from dloftbs.data.centerline import Centerline, Segment
from dloftbs.data.detection import Detection
from dloftbs.data.object_shape import width_in_space
from dloftbs.data.tracks import Track, TrackState
from dloftbs.errors import InputError
from dloftbs.pipeline.thickness import thickness_m


def detection(curve, width=10.0):
    points = curve.sample(400)
    return Detection(Centerline((Segment(points, np.full(400, 0.5 * width)),)), curve)


def found(gap: bool = False):
    mask = np.zeros((200, 400), np.uint8)
    cv2.ellipse(mask, (200, 150), (90, 90), 0, 180, 360, 255, 9)
    if gap:
        mask[:, 190:215] = 0
    return dloftbs.detect(mask)


def test_a_drawn_bend_has_its_radius():
    (one,) = found()
    assert one.tightest_bend()[1] == pytest.approx(90.0, rel=0.03)
    assert one.bend_radius([0.3, 0.7]) == pytest.approx(90.0, rel=0.05)
    with pytest.raises(InputError, match="no curve in space: the frame has no depth"):
        one.tightest_bend_3d()


def test_objects_touch_where_their_edges_do():
    one, near, far = (detection(line((0.0, y), (200.0, y))) for y in (0.0, 11.0, 12.5))
    assert one.touches(near)
    assert not one.touches(far)
    with pytest.raises(InputError, match="other must be a Detection or a Track"):
        one.touches(one.curve)  # type: ignore[arg-type]


def test_deviations_grow_into_a_gap_and_by_noise():
    (clean,), (gapped,) = found(), found(gap=True)
    ((low, high),) = gapped.inferred
    assert gapped.curve_std(0.5 * (low + high)) > 3.0 * gapped.curve_std(0.5 * low)
    assert clean.curve_std(0.5) < 0.2
    assert clean.curve_std([[0.2, 0.3], [0.4, 0.5]]).shape == (2, 2)
    np.testing.assert_allclose(clean.reversed().curve_std([0.2, 0.9]), clean.curve_std([0.8, 0.1]), rtol=0.05)
    with pytest.raises(InputError, match=r"u must be within 0\.\.1"):
        clean.curve_std(1.1)
    with pytest.raises(InputError, match="no curve in space"):
        clean.curve_3d_std(0.5)


WIDE = dloftbs.PinholeCamera(220.0, 220.0, 320.0, 320.0, (0.0, 0.0, 0.0, 0.0), "fisheye")
PINHOLE = dloftbs.PinholeCamera(300.0, 300.0, 320.0, 320.0)
LONG = dloftbs.PinholeCamera(200.0, 400.0, 320.0, 320.0)


def seen_tube(camera, middle, along, radius_m=0.01, half_m=0.15):
    """Return mask and depth of a straight round cable, exactly as rays of a camera meet it."""
    pixels = np.stack(np.meshgrid(np.arange(640.0), np.arange(640.0)), axis=-1)
    rays = camera.deproject(pixels, np.ones((640, 640)))
    across, apart = rays - (rays @ along)[..., None] * along, middle - (middle @ along) * along
    a, b, c = np.maximum((across**2).sum(axis=-1), 1e-12), across @ apart, apart @ apart - radius_m**2
    depth = (b - np.sqrt(np.maximum(b**2 - a * c, 0.0))) / a
    mask = (b**2 > a * c) & (b > 0.0) & (np.abs((depth[..., None] * rays - middle) @ along) < half_m)
    return mask, np.where(mask, depth, 0.0)


@pytest.mark.parametrize("along", ["across", "outwards", "away"])
@pytest.mark.parametrize(("camera", "degrees"), [(WIDE, 65.0), (PINHOLE, 45.0), (LONG, 0.0)])
def test_the_width_in_space_is_the_cables_wherever_and_however_it_lies(camera, degrees, along):
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    middle = 0.6 * np.array([sine, 0.0, cosine])
    away = np.array([sine, 0.5, cosine])
    directions = {"across": (0.0, 1.0, 0.0), "outwards": (cosine, 0.0, -sine), "away": away / np.linalg.norm(away)}
    mask, depth = seen_tube(camera, middle, np.array(directions[along]))
    (one,) = dloftbs.detect(mask, depth=depth, camera=camera)
    pixel_m = one.width_m / one.width_px
    assert one.width_m == pytest.approx(0.02, abs=1.5 * pixel_m)
    track = Track(1, TrackState.CONFIRMED, one.curve, one.curve_3d, 3, 0, one, camera=camera, width_px=one.width_px)
    assert track.width_m == one.width_m
    assert thickness_m(one)[0] == one.width_m


def test_a_curve_that_is_not_seen_has_no_width():
    behind, beyond, endwise = (
        line(start, end)
        for start, end in (
            ((0.0, 0.0, -1.0), (1.0, 0.0, -1.0)),
            ((9.0, 0.0, 1.0), (9.0, 1.0, 1.0)),
            ((0.0, 0.0, 1.0), (0.0, 0.0, 2.0)),
        )
    )
    assert width_in_space(5.0, behind, PINHOLE) is None
    assert width_in_space(5.0, endwise, PINHOLE) is None
    lens = dloftbs.PinholeCamera(300.0, 300.0, 320.0, 320.0, (-0.4, 0.0, 0.0, 0.0))
    assert width_in_space(5.0, beyond, lens) is None
    across = line((-1.0, 0.1, -1.0), (1.0, 0.1, 1.0))  # of which a half is in front
    assert width_in_space(5.0, across, PINHOLE) > 0.0


def test_deviations_in_space_are_those_of_the_image_and_of_depth():
    mask = np.zeros((200, 400), np.uint8)
    cv2.ellipse(mask, (200, 150), (90, 90), 0, 180, 360, 255, 9)
    camera = dloftbs.PinholeCamera(400.0, 400.0, 199.5, 99.5)
    noise = np.random.default_rng(0).normal(0.0, 0.005, mask.shape)
    still, noisy = (
        dloftbs.detect(mask, depth=(np.where(mask > 0, 0.8, 0.9) + part).astype(np.float32), camera=camera)[0]
        for part in (0.0, noise)
    )
    assert still.curve_3d_std(0.5) == pytest.approx(still.curve_std(0.5) * 0.8 / 400.0, rel=0.5)
    assert 2.0 * still.curve_3d_std(0.5) < noisy.curve_3d_std(0.5) < 0.005
    np.testing.assert_allclose(noisy.reversed().curve_3d_std([0.2]), noisy.curve_3d_std([0.8]), rtol=0.05)
    assert still.width_m == pytest.approx(still.width_px * 0.8 / 400.0, rel=0.03)
    assert still.tightest_bend_3d()[1] == pytest.approx(90.0 * 0.8 / 400.0, rel=0.05)
    track = Track(1, TrackState.CONFIRMED, still.curve, still.curve_3d, 3, 0, still, camera=camera)
    assert track.curve_3d_std(0.5) == pytest.approx(still.curve_3d_std(0.5))
    assert with_answers(dloftbs.detect(mask), ["std"])["detections"][0]["std"]["m"] is None


def test_deviations_in_space_are_those_of_the_places_in_the_image():
    mask = np.zeros((120, 400), np.uint8)
    mask[58:63, 40:361] = 255
    camera = dloftbs.PinholeCamera(400.0, 400.0, 199.5, 59.5)
    away = np.linspace(0.4, 2.0, 400, dtype=np.float32)[None, :].repeat(120, axis=0)  # it recedes to the right
    result = dloftbs.detect(mask, depth=away, camera=camera)
    (one,) = result
    std = with_answers(result, ["std"])["detections"][0]["std"]
    middle = one.u_3d(0.5)
    assert not 0.45 < middle < 0.55
    assert std["m"][5] == pytest.approx(one.curve_3d_std(middle))
    assert std["px"][5] == pytest.approx(one.curve_std(0.5))


def test_a_track_has_the_deviations_of_its_detection_and_more_where_it_is_hidden():
    (one,) = found()
    same = Track(1, TrackState.CONFIRMED, one.curve, None, 3, 0, one)
    np.testing.assert_array_equal(same.curve_std([0.1, 0.6]), one.curve_std([0.1, 0.6]))
    longer = Track(
        1, TrackState.CONFIRMED, one.curve.transformed(np.eye(2), [0.0, 0.5]), None, 3, 0, one, ((0.8, 1.0),)
    )
    assert longer.curve_std(0.95) > 3.0 * one.curve_std(0.95)
    unseen = Track(1, TrackState.HIDDEN, one.curve, None, 3, 1, None)
    with pytest.raises(InputError, match="without a detection"):
        unseen.curve_std(0.5)


def test_answers_go_with_each_object():
    result = found()
    row = with_answers(result, ["shape", "std"])
    (one,) = row["detections"]
    assert one["shape"]["bend_radius_px"] == pytest.approx(90.0, rel=0.03)
    assert one["shape"]["bend_radius_m"] is None
    assert len(one["std"]["px"]) == 11
    assert one["std"]["m"] is None
    assert with_answers(result, ()) == result.to_dict()
    with pytest.raises(InputError, match="answers are topology, shape, std, got 'knots'"):
        with_answers(result, ["knots"])


def test_topology_is_a_key_of_the_result():
    assert "topology" in with_answers(found(), ["topology"])


def test_a_limit_names_the_object_that_bends_more():
    result = found()
    (line_,) = BendLimit.parse("95px").violations(result)
    assert line_.startswith("detection 0 bends to ")
    assert line_.endswith(", below 95 px")
    assert not list(BendLimit.parse("80px").violations(result))
    assert BendLimit.parse("95px").is_tighter(result[0], [0.5]) == [True]
    assert BendLimit.parse("0.03").is_tighter(result[0], [0.5]) == [False]
    assert BendLimit.parse("95px").unknown(result) == {}
    for text in ("wide", "-1", "nan", "0px"):
        with pytest.raises(InputError, match="expected a radius in metres"):
            BendLimit.parse(text)


def test_bends_without_a_curve_in_space_are_unknown_in_metres():
    mask = np.zeros((200, 400), np.uint8)
    cv2.ellipse(mask, (200, 150), (90, 90), 0, 180, 360, 255, 9)
    camera = dloftbs.PinholeCamera(400.0, 400.0, 199.5, 99.5)
    depth = np.where(mask > 0, 0.8, 0.9).astype(np.float32)
    limit = BendLimit.parse("10")
    for given, why in (
        ({}, "the frame has no depth"),
        ({"depth": depth}, "no camera"),
        ({"depth": np.zeros_like(depth), "camera": camera}, "depth"),
    ):
        result = dloftbs.detect(mask, **given)
        assert list(limit.violations(result)) == []
        ((name, reason),) = limit.unknown(result).items()
        assert name == "detection 0"
        assert why in reason
    seen = dloftbs.detect(mask, depth=depth, camera=camera)
    assert limit.unknown(seen) == {}
    assert len(list(limit.violations(seen))) == 1
    hidden = Track(1, TrackState.HIDDEN, seen[0].curve, None, 3, 1, None)
    (reason,) = limit.unknown(replace(seen, detections=(), crossings=(), tracks=(hidden,))).values()
    assert "does not show it" in reason


def test_short_waves_of_a_thick_object_are_noise():
    assert math.isclose(detection(arc(100.0, 2.0), 30.0).tightest_bend()[1], 100.0, rel_tol=0.02)
