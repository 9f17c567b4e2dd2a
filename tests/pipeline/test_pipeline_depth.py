"""From frames with depth to curves in space."""

from __future__ import annotations

import numpy as np
import pytest
import tubes
from drawings import draw_cable, random_masks, wave
from hypothesis import given
from hypothesis import strategies as st

import dloftbs
from dloftbs import Config, Frame, InputError, PinholeCamera, Pipeline

PAPER = Config.paper()
DEFAULT = Config()
SIZE = (240, 400)
CAMERA = PinholeCamera(fx=600.0, fy=600.0, cx=200.0, cy=120.0)


def test_a_cable_of_the_paper_lies_in_its_plane() -> None:
    depth = np.full(SIZE, 0.8, dtype=np.float32)
    (detection,) = dloftbs.detect(draw_cable(wave(SIZE), 9, SIZE), config=PAPER, depth=depth, camera=CAMERA)
    curve = detection.curve_3d
    assert curve is not None
    np.testing.assert_allclose(curve.sample(50)[:, 2], 0.8, atol=1e-6)
    assert np.abs(CAMERA.project(curve.sample(50)) - detection.curve.sample(50)).max() < 0.5
    assert detection.inferred_3d == ()


def test_the_paper_s_curve_in_space_has_the_knots_and_the_parameter_of_that_in_the_image() -> None:
    depth = np.broadcast_to(np.linspace(0.5, 1.5, SIZE[1]), SIZE)
    (detection,) = dloftbs.detect(draw_cable(wave(SIZE), 9, SIZE), config=PAPER, depth=depth, camera=CAMERA)
    assert detection.curve_3d is not None
    np.testing.assert_array_equal(detection.curve_3d.knots, detection.curve.knots)
    t = np.linspace(0.0, 1.0, 50)
    expected = np.interp(detection.curve.spline(t)[:, 0], np.arange(SIZE[1]), depth[0])
    np.testing.assert_allclose(detection.curve_3d.spline(t)[:, 2], expected, atol=0.01)


def test_holes_in_the_depth_are_left_out_of_the_paper_s_fit() -> None:
    rng = np.random.default_rng(0)
    depth = np.full(SIZE, 0.8)
    depth[rng.random(SIZE) < 0.3] = np.nan
    depth[rng.random(SIZE) < 0.1] = 0.0
    (detection,) = dloftbs.detect(draw_cable(wave(SIZE), 9, SIZE), config=PAPER, depth=depth, camera=CAMERA)
    assert detection.curve_3d is not None
    np.testing.assert_allclose(detection.curve_3d.sample(50)[:, 2], 0.8, atol=1e-6)


def test_a_stretch_with_depth_everywhere_has_no_hole_in_the_paper_s_curve() -> None:
    mask, depth = np.zeros(SIZE, np.uint8), np.zeros(SIZE)
    mask[100:105, 50:350] = 1
    depth[:, 180:225] = 0.8
    (detection,) = dloftbs.detect(mask, config=PAPER, depth=depth, camera=CAMERA)
    assert detection.curve_3d is not None
    assert detection.inferred_3d == ()
    depth[:, 195:210] = 0.0
    (detection,) = dloftbs.detect(mask, config=PAPER, depth=depth, camera=CAMERA)
    assert np.array(detection.inferred_3d) == pytest.approx(np.array([[15 / 45, 30 / 45]]), abs=0.05)


@pytest.mark.parametrize("axis", [tubes.coil(), tubes.ring()], ids=["open", "closed"])
def test_the_curve_in_space_is_the_axis_by_its_own_arc_length(axis: np.ndarray) -> None:
    mask, depth = tubes.draw_tubes([axis])
    (detection,) = dloftbs.detect(mask, depth=depth, camera=tubes.CAMERA)
    curve = detection.curve_3d
    assert curve is not None
    assert curve.closed == detection.curve.closed
    assert tubes.away(curve.sample(200)[3:-3], axis).max() < 0.15 * tubes.RADIUS_M
    speed = np.linalg.norm(curve(np.linspace(0.0, 1.0, 101), 1), axis=1)
    np.testing.assert_allclose(speed, curve.length, rtol=0.03)
    start = tubes.CAMERA.project(curve(0.0))
    assert np.linalg.norm(start - detection.curve(0.0)) < 1.0
    length = np.linalg.norm(np.diff(axis, axis=0), axis=1).sum()
    assert curve.length == pytest.approx(length, rel=0.01)


def test_the_number_of_knots_may_be_given() -> None:
    mask, depth = tubes.draw_tubes([tubes.coil()])
    config = DEFAULT.replace({"fitting.knots": 20})
    (detection,) = dloftbs.detect(mask, config=config, depth=depth, camera=tubes.CAMERA)
    assert detection.curve_3d is not None
    assert len(np.unique(detection.curve_3d.knots)) == 20


def test_what_is_bridged_is_inferred() -> None:
    mask, depth = tubes.draw_tubes([tubes.coil()])
    depth[:, 140:170] = 0.0
    (detection,) = dloftbs.detect(mask, depth=depth, camera=tubes.CAMERA)
    ((low, high),) = detection.inferred_3d
    assert detection.curve_3d is not None
    x = tubes.CAMERA.project(detection.curve_3d(np.array([low, high])))[:, 0]
    np.testing.assert_allclose(np.sort(x), [140.0, 170.0], atol=6.0)
    assert detection.inferred == ()


@pytest.mark.parametrize("config", [PAPER, DEFAULT], ids=["paper", "default"])
def test_too_little_depth_leaves_the_curve_in_the_image_and_says_why(config: Config) -> None:
    (detection,) = dloftbs.detect(
        draw_cable(wave(SIZE), 9, SIZE), config=config, depth=np.zeros(SIZE, np.uint16), camera=CAMERA
    )
    assert detection.curve_3d is None
    assert detection.no_3d_reason is not None
    assert detection.no_3d_reason.startswith("only 0 of ")


def test_a_cable_beyond_the_field_of_the_lens_model_has_no_curve_in_space() -> None:
    mask, lens = np.zeros((100, 200), np.uint8), PinholeCamera(90.0, 90.0, 100.0, 50.0, distortion=(-0.4, 0, 0, 0))
    mask[48:53, 20:180] = 1
    assert np.isnan(lens.deproject([[25.0, 50.0]], [0.5])).any()
    (detection,) = dloftbs.detect(mask, depth=np.full((100, 200), 0.5), camera=lens)
    assert detection.curve_3d is None
    assert "beyond the field of the lens model" in str(detection.no_3d_reason)
    (detection,) = dloftbs.detect(mask, config=PAPER, depth=np.full((100, 200), 0.5), camera=lens)
    assert detection.curve_3d is not None
    assert np.isfinite(detection.curve_3d.sample(50)).all()


def test_a_curve_too_far_away_to_be_stored_is_none() -> None:
    """What is published can always be written and read again."""
    config = Config.paper().replace({"lifting.max_depth_m": 1e9})
    far = PinholeCamera(fx=0.1, fy=0.1, cx=0.0, cy=0.0)
    (detection,) = dloftbs.detect(draw_cable(wave(SIZE), 9, SIZE), config=config, depth=np.full(SIZE, 9e8), camera=far)
    assert detection.curve_3d is None
    assert "reaches farther than 1e+12 m" in str(detection.no_3d_reason)


def test_depth_without_a_camera_says_so() -> None:
    (detection,) = dloftbs.detect(draw_cable(wave(SIZE), 9, SIZE), depth=np.ones(SIZE))
    assert detection.no_3d_reason == "the frame has depth, but no camera (camera=, --camera)"


def test_depth_of_another_size_is_refused() -> None:
    with pytest.raises(InputError, match=r"depth must have the frame's size \(240, 400\).*got \(120, 200\)"):
        dloftbs.detect(np.zeros(SIZE, bool), depth=np.ones((120, 200)), camera=CAMERA)


@given(random_masks, st.integers(0, 2**31))
def test_any_mask_and_any_depth_give_finite_curves_or_a_reason(mask: np.ndarray, seed: int) -> None:
    rng = np.random.default_rng(seed)
    depth = rng.choice([0.0, np.nan, np.inf, 0.5, 1.0, 19.0], mask.shape) + rng.choice([0.0, 0.3]) * rng.random(
        mask.shape
    )
    for detection in dloftbs.detect(mask, depth=depth, camera=CAMERA):
        if detection.curve_3d is None:
            assert detection.no_3d_reason
            continue
        assert np.isfinite(detection.curve_3d.control_points).all()
        bounds = [bound for interval in detection.inferred_3d for bound in interval]
        assert bounds == sorted(bounds)
        assert all(0.0 <= bound <= 1.0 for bound in bounds)


class TestDisplacedDepth:
    """Depth as cameras register it to colour: a pixel or two off."""

    @staticmethod
    def frame(dx: int, dy: int) -> Frame:
        mask, depth = tubes.draw_tubes([tubes.coil()], radius_m=0.005, behind_m=1.1)
        return Frame(mask=mask, depth=np.roll(depth, (dy, dx), axis=(0, 1)), camera=tubes.CAMERA)

    @pytest.mark.parametrize(("dx", "dy"), [(2, 0), (0, -2), (1, 1), (-2, 1)])
    def test_a_thin_cable_is_found_beside_its_mask(self, dx: int, dy: int) -> None:
        (detection,) = Pipeline().detect(self.frame(dx, dy)).detections
        assert detection.curve_3d is not None
        off = tubes.away(detection.curve_3d.sample(100), tubes.coil())[3:-3]
        assert off.mean() < 0.002
        assert off.max() < 0.009  # at the bends of a cable 3 px wide, as without displacement

    def test_a_stream_tells_the_same_as_one_frame_and_reset_forgets_it(self) -> None:
        pipeline, displaced, straight = Pipeline(), self.frame(2, 0), self.frame(0, 0)
        alone = Pipeline().detect(straight).detections[0].curve_3d
        for _ in range(3):
            pipeline.process(displaced)
        pipeline.reset()
        assert pipeline.process(straight).detections[0].curve_3d == alone


@pytest.mark.parametrize("missing", [0.05, 0.25, 0.5])
def test_the_published_curve_in_space_ends_where_depth_does(missing: float) -> None:
    mask, depth = tubes.draw_tubes([tubes.coil()])
    columns = np.flatnonzero(mask.any(axis=0))
    cut = int(columns[0] + missing * np.ptp(columns))
    depth[:, :cut] = 0.0
    (detection,) = dloftbs.detect(mask, depth=depth, camera=tubes.CAMERA, config=PAPER)
    assert detection.curve_3d is not None
    points = detection.curve_3d.sample(200)
    assert tubes.away(points, tubes.coil()).max() < 3.0 * tubes.RADIUS_M  # it lies on the surface
    assert tubes.CAMERA.project(points)[:, 0].min() > cut - 2.0
    assert detection.inferred_3d == ()


def test_the_published_curve_in_space_says_where_depth_is_missing_between() -> None:
    mask, depth = tubes.draw_tubes([tubes.coil()])
    depth[:, 150:180] = 0.0
    (detection,) = dloftbs.detect(mask, depth=depth, camera=tubes.CAMERA, config=PAPER)
    assert detection.curve_3d is not None
    ((low, high),) = detection.inferred_3d
    at = tubes.CAMERA.project(detection.curve_3d(np.array([low, high])))[:, 0]
    np.testing.assert_allclose(np.sort(at), [149.5, 180.5], atol=6.0)
