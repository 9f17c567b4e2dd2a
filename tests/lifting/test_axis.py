"""Depth to the axes of objects, on tubes that are drawn from known ones."""

from __future__ import annotations

import numpy as np
import pytest
from bounded import run_bounded
from tubes import CAMERA, RADIUS_M, SIZE, away, coil, draw_tubes, ring, straight

from dloftbs import Detection, Frame, PinholeCamera, detect
from dloftbs.cleaning import clean
from dloftbs.config import CleaningConfig, LiftingConfig
from dloftbs.data.depth import ReadableDepth, to_metres
from dloftbs.fitting import find_crossings
from dloftbs.lifting import Lifted, lift

SLANTED = straight((-0.3, -0.05, 0.7), (0.3, 0.08, 1.1))
STEEP = straight((-0.05, 0.0, 0.6), (0.25, 0.1, 1.4))
LYING = straight((-0.3, -0.03, 0.9), (0.3, 0.04, 0.9))
INSIDE = slice(2, -2)
"""Sections more than half a width from the ends, where a tube shows its round end."""
OVER = straight((-0.02, -0.2, 0.875), (0.03, 0.2, 0.875))


def lift_all(
    mask: np.ndarray,
    depth: np.ndarray,
    camera: PinholeCamera = CAMERA,
    config: LiftingConfig | None = None,
    unit_m: float = 0.001,
) -> tuple[list[Detection], list[Lifted | str]]:
    """Lift what is found in a mask; the longest object comes first."""
    config = LiftingConfig() if config is None else config
    found = sorted(detect(mask), key=lambda detection: -detection.curve.length)
    crossings = find_crossings(found, Frame(mask=mask, depth=depth, depth_unit_m=unit_m), config)
    crop = clean(mask, CleaningConfig())
    assert crop is not None
    return found, lift(found, crossings, crop, ReadableDepth.of(depth, unit_m, config), camera)


def lift_first(mask: np.ndarray, depth: np.ndarray, **how: object) -> Lifted:
    lifted = lift_all(mask, depth, **how)[1][0]
    assert isinstance(lifted, Lifted), lifted
    return lifted


def columns(mask: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return where the mask is within a share of its columns."""
    used = np.flatnonzero(mask.any(axis=0))
    x = np.arange(mask.shape[1])
    return mask & (x >= used[0] + low * np.ptp(used)) & (x < used[0] + high * np.ptp(used))


@pytest.mark.parametrize("axis", [SLANTED, STEEP, LYING, coil()], ids=["slanted", "steep", "lying", "coil"])
class TestPerfectDepth:
    def test_the_points_lie_on_the_axis(self, axis: np.ndarray) -> None:
        lifted = lift_first(*draw_tubes([axis]))
        assert away(lifted.points_m, axis)[INSIDE].max() < 0.12 * RADIUS_M
        assert lifted.radius_m == pytest.approx(RADIUS_M, rel=0.04)
        # What points at the camera shows its face at the end, and that is not explained by its side.
        assert sum(high - low for low, high in lifted.inferred) < 0.05

    def test_the_parameter_is_the_arc_length_in_space(self, axis: np.ndarray) -> None:
        lifted = lift_first(*draw_tubes([axis]))
        steps = np.linalg.norm(np.diff(lifted.points_m, axis=0), axis=1)
        np.testing.assert_allclose(np.diff(lifted.u), steps / steps.sum())
        assert (lifted.u[0], lifted.u[-1]) == (0.0, pytest.approx(1.0))

    def test_a_transposed_image_gives_the_transoriented_points(self, axis: np.ndarray) -> None:
        mask, depth = draw_tubes([axis])
        turned = PinholeCamera(CAMERA.fy, CAMERA.fx, CAMERA.cy, CAMERA.cx)
        expected = lift_first(mask, depth).points_m
        points = lift_first(mask.T.copy(), depth.T.copy(), camera=turned).points_m[:, [1, 0, 2]]
        if np.linalg.norm(points[0] - expected[0]) > np.linalg.norm(points[-1] - expected[0]):
            points = points[::-1]
        np.testing.assert_allclose(points, expected, atol=3e-4)

    def test_counts_are_metres_in_their_unit(self, axis: np.ndarray) -> None:
        mask, depth = draw_tubes([axis])
        expected = lift_first(mask, depth).points_m
        millimetres = np.rint(1e3 * depth).astype(np.uint16)
        np.testing.assert_allclose(lift_first(mask, millimetres).points_m[INSIDE], expected[INSIDE], atol=5e-4)
        tenths = np.rint(1e4 * depth).astype(np.uint16)
        off = np.abs(lift_first(mask, tenths, unit_m=1e-4).points_m - expected)
        assert float(np.quantile(off, 0.95)) < 5e-5  # half a step; places that a step tips the other way are few
        assert off.max() < 1.1e-4


def test_a_ring_is_lifted_all_around() -> None:
    mask, depth = draw_tubes([ring()])
    (detection,), (lifted,) = lift_all(mask, depth)
    assert detection.curve.closed
    assert isinstance(lifted, Lifted)
    assert away(lifted.points_m, ring()).max() < 0.1 * RADIUS_M
    assert lifted.u[-1] < 1.0
    hole = depth.copy()
    hole[columns(mask, 0.0, 0.08)] = 0.0
    bridged = lift_first(mask, hole)
    assert away(bridged.points_m, ring()).max() < 0.4 * RADIUS_M
    assert bridged.inferred != ()


@pytest.mark.large
@pytest.mark.parametrize("side", [-1, 1])
def test_a_hole_that_begins_or_ends_at_the_seam_of_a_ring_is_inferred_and_nothing_else(side: int) -> None:
    mask, depth = draw_tubes([ring()])
    y, x = np.indices(SIZE)
    middle, seam = CAMERA.project(np.stack((ring().mean(axis=0), lift_first(mask, depth).points_m[0])))
    angle = np.arctan2(y - middle[1], x - middle[0]) - np.arctan2(*(seam - middle)[::-1])
    for towards in side * np.linspace(0.15, 0.35, 20):
        hole = depth.copy()
        hole[np.abs(np.angle(np.exp(1j * (angle - towards)))) < 0.25] = np.nan
        inferred = lift_first(mask, hole).inferred
        assert 1 <= len(inferred) <= 2  # two about the seam
        assert sum(high - low for low, high in inferred) == pytest.approx(0.5 / (2.0 * np.pi), abs=0.04)


class TestImperfectDepth:
    @pytest.mark.parametrize("seed", range(3))
    def test_noise_holes_and_flying_pixels_do_not_bend_the_curve(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        mask, depth = draw_tubes([coil()])
        edge = mask & ~(np.roll(mask, 1, 0) & np.roll(mask, -1, 0) & np.roll(mask, 1, 1) & np.roll(mask, -1, 1))
        flying = edge & (rng.random(SIZE) < 0.7)
        depth[flying] += rng.uniform(0.0, 1.0, flying.sum())
        depth += rng.normal(0.0, 0.002, SIZE)
        depth[rng.random(SIZE) < 0.1] = np.nan
        off = away(lift_first(mask, depth).points_m, coil())[2:-2]
        assert off.mean() < 0.0008
        assert off.max() < 0.003

    @pytest.mark.parametrize("missing", [0.0, np.nan, np.inf, -np.inf, -1.0, 25.0, 0.05])
    def test_missing_depth_is_bridged_and_inferred(self, missing: float) -> None:
        mask, depth = draw_tubes([SLANTED])
        depth[columns(mask, 0.4, 0.6)] = missing
        lifted = lift_first(mask, depth, config=LiftingConfig(min_depth_m=0.1))
        assert away(lifted.points_m, SLANTED)[INSIDE].max() < 0.1 * RADIUS_M
        ((low, high),) = lifted.inferred
        assert high - low == pytest.approx(0.22, abs=0.06)

    def test_an_end_without_depth_is_led_on_straight(self) -> None:
        mask, depth = draw_tubes([SLANTED])
        depth[columns(mask, 0.88, 1.1)] = 0.0
        lifted = lift_first(mask, depth)
        assert away(lifted.points_m, SLANTED)[INSIDE].max() < 0.2 * RADIUS_M
        ((low, high),) = lifted.inferred
        assert (low, high) in ((0.0, pytest.approx(0.15, abs=0.06)), (pytest.approx(0.85, abs=0.06), 1.0))

    def test_a_longer_end_without_depth_is_too_much(self) -> None:
        mask, depth = draw_tubes([SLANTED])
        depth[columns(mask, 0.7, 1.1)] = 0.0
        (why,) = lift_all(mask, depth)[1]
        assert isinstance(why, str)
        assert why.startswith("the last 3")
        assert why.endswith("% of the curve have no depth, more than 20 %")

    def test_an_end_is_not_led_on_to_the_horizon(self) -> None:
        # What is seen goes away from the camera so steeply that it would be out of sight before its end.
        mask, _ = draw_tubes([LYING])
        x = np.arange(SIZE[1])
        used = np.flatnonzero(mask.any(axis=0))
        share = (x - used[0]) / np.ptp(used)
        depth = np.tile(0.5 / np.clip(1.0 - 1.0 * share, 0.01, None), (SIZE[0], 1))
        depth[columns(mask, 0.84, 1.1)] = 0.0
        (why,) = lift_all(mask, depth)[1]
        assert why == "the extrapolated depth exceeds 2 times the largest measured depth"

    @pytest.mark.parametrize("known", [0, 3], ids=["nothing", "three pixels"])
    def test_too_little_depth_says_how_little(self, known: int) -> None:
        mask, depth = draw_tubes([SLANTED])
        rows, cols = np.nonzero(mask)
        depth[rows[known:], cols[known:]] = np.nan
        (why,) = lift_all(mask, depth)[1]
        assert isinstance(why, str)
        assert why.startswith("only ")
        assert why.endswith(" sections of the curve have depth, fewer than 30 %")

    def test_depth_of_what_is_not_round_is_taken_for_round(self) -> None:
        mask, _ = draw_tubes([LYING])
        lifted = lift_first(mask, np.full(SIZE, 0.9))
        # From a little in front of the plane, the radius farther.
        np.testing.assert_allclose(lifted.points_m[:, 2], 0.9 + RADIUS_M, atol=0.2 * RADIUS_M)

    @pytest.mark.parametrize("step", [-0.05, 0.05], ids=["nearer", "farther"])
    def test_a_stretch_that_no_smooth_line_explains_is_left_out(self, step: float) -> None:
        mask, depth = draw_tubes([coil()])
        depth[columns(mask, 0.45, 0.53)] += step
        lifted = lift_first(mask, depth)
        assert away(lifted.points_m, coil())[INSIDE].max() < 0.2 * RADIUS_M
        ((low, high),) = lifted.inferred
        assert low < 0.47
        assert high > 0.5


def test_a_short_lift_is_followed() -> None:
    x = np.linspace(-0.3, 0.3, 600)
    axis = np.stack((x, 0.02 * x, 0.9 - 0.06 * np.exp(-((x / 0.05) ** 2))), axis=1)
    lifted = lift_first(*draw_tubes([axis]))
    assert away(lifted.points_m, axis)[INSIDE].max() < 0.2 * RADIUS_M
    assert lifted.inferred == ()


class TestHidden:
    def test_the_lower_pass_does_not_jump_on_to_the_upper_one(self) -> None:
        mask, depth = draw_tubes([LYING, OVER])
        found, lifted = lift_all(mask, depth)
        assert len(found) == 2
        for axis, one in zip((LYING, OVER), lifted, strict=True):
            assert isinstance(one, Lifted)
            assert away(one.points_m, axis)[INSIDE].max() < 0.12 * RADIUS_M
        below, above = lifted
        ((low, high),) = below.inferred
        assert low < 0.5 < high
        assert above.inferred == ()

    def test_where_it_is_not_known_which_is_on_top_both_are_inferred(self) -> None:
        mask, depth = draw_tubes([LYING, OVER])
        found, _ = lift_all(mask, depth)
        crop = clean(mask, CleaningConfig())
        assert crop is not None
        unknown = find_crossings(found, Frame(mask=mask), LiftingConfig())
        lifted = lift(found, unknown, crop, ReadableDepth.of(depth, 0.001, LiftingConfig()), CAMERA)
        assert len(lifted) == 2
        for one in lifted:
            assert isinstance(one, Lifted)
            assert len(one.inferred) == 1

    def test_an_occluder_s_depth_is_not_the_cable_s(self) -> None:
        mask, depth = draw_tubes([SLANTED])
        hand = columns(np.ones(SIZE, bool) & mask.any(axis=0), 0.4, 0.5)
        depth[hand], mask[hand] = 0.4, False
        lifted = lift_first(mask, depth)
        assert away(lifted.points_m, SLANTED)[INSIDE].max() < 0.12 * RADIUS_M
        ((low, high),) = lifted.inferred
        assert high - low == pytest.approx(0.12, abs=0.05)


def test_a_thin_cable_keeps_its_depth_among_flying_pixels() -> None:
    rng = np.random.default_rng(0)
    mask, depth = draw_tubes([SLANTED], radius_m=0.0035)
    flying = mask & (rng.random(SIZE) < 0.3)
    depth[flying] += rng.uniform(0.0, 1.5, flying.sum())
    depth += rng.normal(0.0, 0.001, SIZE)
    assert away(lift_first(mask, depth).points_m, SLANTED)[INSIDE].mean() < 0.0025


ENDLESS = """
import sys
import numpy as np
from tubes import CAMERA, draw_tubes, straight
from dloftbs import Frame, Pipeline
from dloftbs.config import LiftingConfig
from dloftbs.config import Config, PixelLiftingConfig

mask, depth = draw_tubes([straight((-0.3, -0.03, 0.9), (0.3, 0.04, 0.9))])
for scale in map(float, sys.argv[1].split(",")):
    stored = (depth * scale).astype(sys.argv[2])
    stored[:, ::7] = 1.0
    for lifting in (LiftingConfig(), PixelLiftingConfig()):
        result = Pipeline(Config(lifting=lifting)).process(Frame(mask=mask, depth=stored, camera=CAMERA))
        (found,) = result.detections
        assert found.curve_3d is None or np.isfinite(found.curve_3d.control_points).all()
"""


@pytest.mark.large
@pytest.mark.parametrize(
    ("dtype", "scales"),
    [("float64", "1e-320,1e-200,1e-160,1e-100,1e-31,1e31,1e160,1e307"), ("float32", "1e-44,1e-38,1e-31,1e31")],
)
def test_it_ends_whatever_the_scale_of_the_depth(dtype: str, scales: str) -> None:
    run_bounded(ENDLESS, scales, dtype)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("stored", [0.0, -1.0, np.nan, np.inf, 1e-40, 1e-31, 1e31])
def test_what_is_no_depth_is_missing_wherever_depth_is_read(stored: float, dtype: type) -> None:
    config = LiftingConfig(max_depth_m=1e9)
    depth = np.full((3, 3), stored, dtype)
    assert np.isnan(to_metres(depth, 0.001, config)).all()
    depth[:] = 2.5
    assert (to_metres(depth, 0.001, config) == 2.5).all()
