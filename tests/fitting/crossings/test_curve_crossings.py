"""Crossings of curves of which the crossings, and the order in which they were drawn, are known."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders import curve_through, detection_of, line, loop
from drawings import EIGHT_VERSIONS, draw_cable, turn_points
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

import dloftbs
from dloftbs import BSplineCurve, Crossing, Detection, Frame, Joint, JointKind, Pipeline
from dloftbs.config import LiftingConfig
from dloftbs.fitting import find_crossings

SIZE = (240, 320)
MASK = np.zeros(SIZE, np.uint8)
WIDTH = 10.0
FLAT = line((40, 120), (280, 120))
STEEP = line((130, 30), (190, 210))
BLUE, RED = (200.0, 120.0, 40.0), (50.0, 40.0, 210.0)


def detect(*curves: BSplineCurve, width: float = WIDTH) -> list[Detection]:
    return [detection_of(curve, radius=width / 2) for curve in curves]


def crossings(
    *curves: BSplineCurve, width: float = WIDTH, config: LiftingConfig | None = None, **frame: np.ndarray
) -> tuple[Crossing, ...]:
    config = LiftingConfig() if config is None else config
    return find_crossings(detect(*curves, width=width), Frame(**(frame or {"mask": MASK})), config)


def bent(*points: tuple[float, float]) -> BSplineCurve:
    """Return a smooth curve through a few points."""
    return curve_through(np.array(points, dtype=float))


def looped() -> BSplineCurve:
    """Return a cable that makes one loop and crosses itself at a right angle."""
    t = np.linspace(-1.6, 1.6, 80)
    return curve_through(np.stack((160 + 90 * (t**3 - t), 60 + 60 * t**2), axis=1))


def figure_eight(shift: float = 0.3) -> BSplineCurve:
    t = shift + 2 * np.pi * np.arange(80) / 80
    return curve_through(np.stack((160 + 100 * np.sin(t), 120 + 60 * np.sin(2 * t)), axis=1), closed=True)


class TestWhere:
    def test_two_cables_cross_once_on_both_curves(self) -> None:
        (crossing,) = crossings(FLAT, STEEP)
        assert crossing.position == pytest.approx((160, 120), abs=0.05)
        (a, u_a), (b, u_b) = crossing.passes
        assert (a, b) == (0, 1)
        np.testing.assert_allclose(FLAT(u_a), (160, 120), atol=0.05)
        np.testing.assert_allclose(STEEP(u_b), (160, 120), atol=0.05)
        assert (crossing.top, crossing.confidence) == (None, 0.0)

    def test_passes_are_shares_of_the_length(self) -> None:
        """Whatever the speed of the spline: this one is slow at first and fast in the end."""
        uneven = BSplineCurve([0, 0, 0, 0, 0.5, 1, 1, 1, 1], [(60, 120), (64, 120), (80, 120), (120, 120), (260, 120)])
        (crossing,) = crossings(uneven, STEEP)
        ((_, u), (_, u_b)) = crossing.passes
        assert u == pytest.approx(0.5, abs=2e-3)
        (_, t), (_, t_b) = crossing._fitted_passes(())
        np.testing.assert_allclose(uneven.spline(t), crossing.position, atol=0.3)
        assert t > 0.6
        stated = Crossing(crossing.position, crossing.passes)
        ((_, found), (_, found_b)) = stated._fitted_passes([detection_of(uneven), detection_of(STEEP)])
        assert (found, found_b) == (pytest.approx(t, abs=1e-9), pytest.approx(t_b, abs=1e-9))
        assert u_b == pytest.approx(STEEP.u_at(t_b), abs=1e-12)
        with pytest.raises(AttributeError, match="'Crossing' object has no attribute 'pass_'"):
            crossing.pass_  # noqa: B018

    @pytest.mark.parametrize("width", [2.0, 5.0, 10.0, 20.0])
    def test_places_are_exact_to_a_small_share_of_the_width(self, width: float) -> None:
        arcs = loop(3 * width, (100, 120)), loop(3 * width, (100 + 4 * width, 120), start=1.0)
        found = crossings(*arcs, width=width)
        assert len(found) == 2
        for crossing in found:
            for index, u in crossing.passes:
                assert np.linalg.norm(arcs[index](u) - crossing.position) < 0.06 * width

    def test_a_loop_crosses_itself_once_with_the_lower_u_first(self) -> None:
        curve = looped()
        (crossing,) = crossings(curve)
        (a, low), (b, high) = crossing.passes
        assert (a, b) == (0, 0)
        assert low < 0.5 < high
        assert crossing.position == pytest.approx((160, 120), abs=0.3)
        np.testing.assert_allclose(curve([low, high]), [crossing.position] * 2, atol=0.3)

    @pytest.mark.parametrize("shift", [0.3, 0.0, np.pi, 1.57, 3.1])
    def test_a_closed_figure_eight_crosses_itself_once_wherever_its_seam_is(self, shift: float) -> None:
        (crossing,) = crossings(figure_eight(shift))
        assert crossing.position == pytest.approx((160, 120), abs=0.5)

    def test_a_ring_and_a_hairpin_do_not_cross_themselves(self) -> None:
        assert crossings(loop(60, (160, 120))) == ()
        assert crossings(bent((40, 100), (150, 100), (240, 105), (250, 110), (240, 115), (150, 120), (40, 120))) == ()

    def test_a_cable_folded_upon_itself_does_not_cross_itself(self) -> None:
        x = np.concatenate((np.linspace(40, 240, 40), np.linspace(241, 40, 40)))
        y = 120 + np.random.default_rng(3).normal(0, 0.4, 80)
        assert crossings(curve_through(np.stack((x, y), axis=1))) == ()

    def test_curves_apart_do_not_cross(self) -> None:
        assert crossings(FLAT, line((40, 140), (280, 140))) == ()
        assert crossings(FLAT) == crossings() == ()

    @pytest.mark.parametrize(("beyond", "count"), [(-3, 0), (0.3, 0), (4, 0), (7, 1), (40, 1)])
    @pytest.mark.parametrize("first", [True, False])
    def test_an_end_crosses_only_if_it_goes_beyond_by_half_a_width(
        self, beyond: float, count: int, first: bool
    ) -> None:
        end = line((150, 40), (150, 120 + beyond))
        assert len(crossings(*((end, FLAT) if first else (FLAT, end)))) == count

    def test_a_gap_can_cross_too(self) -> None:
        u = 0.5
        gap = Joint(JointKind.GAP, (u - 0.1, u + 0.1), 1.0, 1.0)
        detections = [detection_of(FLAT, joints=(gap,), radius=5), *detect(STEEP)]
        assert len(find_crossings(detections, Frame(mask=MASK), LiftingConfig())) == 1

    @pytest.mark.parametrize(("spacing", "count"), [(4, 0), (10, 0), (30, 2), (60, 2)])
    def test_two_crossings_close_together_are_a_touch(self, spacing: float, count: int) -> None:
        x = np.linspace(-1, 1, 60)
        dip = curve_through(np.stack((160 + 100 * x, 120 + np.abs(100 * x) - spacing / 2), axis=1))
        assert len(crossings(FLAT, dip)) == count

    def test_a_shallow_dip_over_a_long_stretch_is_a_touch(self) -> None:
        dip = bent((40, 80), (100, 110), (140, 122), (160, 123), (180, 122), (220, 110), (280, 80))
        assert crossings(FLAT, dip) == ()

    def test_a_cable_can_cross_another_again_and_again(self) -> None:
        x = np.linspace(45, 275, 60)
        assert len(crossings(FLAT, curve_through(np.stack((x, 120 + 40 * np.sin(x / 10)), axis=1)))) == 7

    @given(st.integers(0, 2**31), st.booleans(), st.booleans())
    def test_a_shared_stretch_is_one_crossing_if_it_is_left_on_the_other_side(
        self, seed: int, swaps: bool, backwards: bool
    ) -> None:
        rng = np.random.default_rng(seed)
        shared = rng.uniform(20, 140)
        s = np.linspace(-150, 150, 50)
        outside = np.clip((np.abs(s) - shared / 2) / 60, 0, None) ** 1.5 * 60
        side = np.where((s > 0) & swaps, -1.0, 1.0)
        weave = rng.normal(0, 0.05 * WIDTH, (2, 50))
        middle = 120 + 15 * np.sin(s / 60)
        one, other = (
            curve_through(np.stack((160 + s, middle + sign * side * outside + noise), axis=1))
            for sign, noise in zip((1, -1), weave, strict=True)
        )
        found = crossings(one, other.reversed() if backwards else other)
        assert len(found) == swaps
        assert all(abs(crossing.position[0] - 160) < shared / 2 + 2 * WIDTH for crossing in found)

    def test_the_very_same_points_are_shared_without_a_crossing(self) -> None:
        assert crossings(FLAT, FLAT) == ()
        assert crossings(FLAT, FLAT.reversed()) == ()

    @given(st.integers(0, 2**31), st.sampled_from(EIGHT_VERSIONS))
    def test_crossings_turn_with_the_picture(self, seed: int, how: tuple[int, int, int]) -> None:
        rng = np.random.default_rng(seed)
        points = [rng.uniform(20, 220, (rng.integers(4, 9), 2)) for _ in range(3)]
        straight = crossings(*map(curve_through, points))
        turned = crossings(*(curve_through(turn_points(p, SIZE, *how)) for p in points))
        assert len(straight) == len(turned)
        for one, other in zip(straight, turned, strict=True):
            np.testing.assert_allclose(turn_points(np.array([one.position]), SIZE, *how)[0], other.position, atol=1e-4)
            np.testing.assert_allclose(one.passes, other.passes, atol=1e-6)

    def test_the_passes_are_in_order_and_so_are_the_crossings(self) -> None:
        found = crossings(looped(), FLAT, STEEP, figure_eight())
        passes = [crossing.passes for crossing in found]
        assert len(passes) >= 5
        assert passes == sorted(passes)
        assert all(first < second for first, second in passes)


def distance_to(curve: BSplineCurve) -> np.ndarray:
    """Return the distance of every pixel (H, W) to a curve."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    return cKDTree(curve.sample(2000)).query(np.stack((x, y), axis=2))[0]


def paint(
    strokes: list[tuple[BSplineCurve, tuple[float, float, float]]],
    *,
    shaded: bool,
    width: float = WIDTH,
    noise: float = 4.0,
) -> np.ndarray:
    """Draw tubes, the first one lowest; shaded ones are darker at their borders, all alike in every direction."""
    rng = np.random.default_rng(0)
    image = np.full((*SIZE, 3), 130.0)
    for curve, colour in strokes:
        distance = distance_to(curve)
        inside = distance <= width / 2
        height = np.sqrt(np.clip(1.0 - (2 * distance / width) ** 2, 0, 1)) if shaded else np.ones(SIZE)
        image[inside] = ((0.35 + 0.65 * height)[:, :, None] * colour)[inside]
    return np.clip(image + rng.normal(0, noise, image.shape), 0, 255).astype(np.uint8)


def depth_of(strokes: list[tuple[BSplineCurve, float]], width: float = WIDTH) -> np.ndarray:
    """Return the depth (H, W) m of tubes whose axes lie so deep, above a table at 1 m; 1 px is 1 mm."""
    depth = np.full(SIZE, 1.0)
    for curve, axis_m in strokes:
        distance = distance_to(curve)
        rise = np.sqrt(np.clip((width / 2) ** 2 - distance**2, 0, None)) / 1000.0
        depth = np.where(distance <= width / 2, np.minimum(depth, axis_m - rise), depth)
    return depth


class TestWhichIsOnTop:
    @pytest.mark.parametrize("top", [0, 1])
    @pytest.mark.parametrize("width", [4.0, 10.0, 24.0])
    def test_colour_tells(self, top: int, width: float) -> None:
        strokes = [(FLAT, BLUE), (STEEP, RED)]
        image = paint(strokes[:: 1 if top else -1], shaded=False, width=width)
        (crossing,) = crossings(FLAT, STEEP, width=width, image=image)
        assert crossing.top == top
        assert crossing.confidence > 0.95

    @pytest.mark.parametrize("top", [0, 1])
    @pytest.mark.parametrize("width", [6.0, 10.0, 24.0])
    def test_the_borders_of_cables_of_one_colour_tell(self, top: int, width: float) -> None:
        strokes = [(FLAT, BLUE), (STEEP, BLUE)]
        image = paint(strokes[:: 1 if top else -1], shaded=True, width=width)
        (crossing,) = crossings(FLAT, STEEP, width=width, image=image)
        assert crossing.top == top
        assert crossing.confidence > 0.9

    @pytest.mark.parametrize(("apart", "is_sure"), [(2.2, False), (3.6, True)])
    def test_an_order_beside_a_third_stretch_of_a_cable_is_hardly_sure(self, apart: float, is_sure: bool) -> None:
        radius, y = 0.5 * apart * WIDTH, np.linspace(40.0, 190.0, 60)
        turn = np.linspace(np.pi, 0.0, 30)[1:-1]
        around = np.stack((150.0 + radius * np.cos(turn), 190.0 + radius * np.sin(turn)), axis=1)
        down, up = (
            np.stack((np.full(60, 150.0 + side * radius), y[::way]), axis=1) for side, way in ((-1, 1), (1, -1))
        )
        hairpin = curve_through(np.concatenate((down, around, up)))
        image = paint([(FLAT, BLUE), (hairpin, BLUE)], shaded=True)
        found = crossings(FLAT, hairpin, image=image)
        assert [one.top for one in found] == [1, 1]
        assert [one.confidence > 0.8 for one in found] == [is_sure, is_sure]

    @pytest.mark.parametrize("top", [0, 1])
    def test_a_loop_lies_on_itself(self, top: int) -> None:
        curve = looped()
        halves = [(curve_through(curve(np.linspace(*span, 60))), BLUE) for span in ((0.0, 0.5), (0.5, 1.0))]
        image = paint(halves[:: 1 if top else -1], shaded=True)
        (crossing,) = crossings(curve, image=image)
        assert crossing.top == top

    @pytest.mark.parametrize("seed", range(5))
    def test_where_nothing_tells_it_is_unknown(self, seed: int) -> None:
        noise = np.random.default_rng(seed).normal(0, 12, (*SIZE, 3))
        image = (paint([(FLAT, BLUE), (STEEP, BLUE)], shaded=False, noise=0) * 0.8 + 30 + noise).clip(0, 255)
        (crossing,) = crossings(FLAT, STEEP, image=image.astype(np.uint8))
        assert (crossing.top, crossing.confidence) == (None, 0.0)

    def test_what_is_outside_of_the_image_or_too_close_to_an_end_is_unknown(self) -> None:
        short = line((160, 105), (160, 240))
        image = paint([(FLAT, BLUE), (short, RED)], shaded=False)
        assert [crossing.top for crossing in crossings(FLAT, short, image=image)] == [None]
        assert [crossing.top for crossing in crossings(FLAT, STEEP, image=image[:130])] == [None]

    @pytest.mark.parametrize("top", [0, 1])
    @pytest.mark.parametrize("kind", ["metres", "millimetres"])
    def test_depth_tells(self, top: int, kind: str) -> None:
        axes = (0.985, 0.995) if top == 0 else (0.995, 0.985)
        depth = depth_of([(FLAT, axes[0]), (STEEP, axes[1])])
        depth = depth + np.random.default_rng(1).normal(0, 0.0015, SIZE)
        if kind == "millimetres":
            depth = np.rint(1000 * depth).astype(np.uint16)
        (crossing,) = crossings(FLAT, STEEP, mask=MASK, depth=depth)
        assert crossing.top == top
        assert crossing.confidence > 0.8

    @pytest.mark.parametrize("top", [0, 1])
    def test_depth_that_hardly_tells_does_not_outvote_a_clear_picture(self, top: int) -> None:
        noise = np.random.default_rng(1).normal(0, 0.004, SIZE)
        against = (0.995, 0.99) if top == 0 else (0.99, 0.995)
        depth = depth_of([(FLAT, against[0]), (STEEP, against[1])]) + noise
        strokes = [(FLAT, BLUE), (STEEP, RED)]
        image = paint(strokes[:: 1 if top else -1], shaded=False)
        (alone,) = crossings(FLAT, STEEP, mask=MASK, depth=depth)
        assert alone.top == 1 - top
        (both,) = crossings(FLAT, STEEP, depth=depth, image=image)
        assert both.top == top
        assert both.confidence < crossings(FLAT, STEEP, image=image)[0].confidence

    def test_depth_within_the_noise_does_not_tell(self) -> None:
        noise = np.random.default_rng(1).normal(0, 0.004, SIZE)
        depth = depth_of([(FLAT, 0.995), (STEEP, 0.9952)]) + noise
        (crossing,) = crossings(FLAT, STEEP, mask=MASK, depth=depth)
        assert crossing.top is None

    @pytest.mark.parametrize("missing", [0.0, np.nan, -1.0, 30.0])
    def test_the_image_helps_where_depth_is_missing(self, missing: float) -> None:
        depth = depth_of([(FLAT, 0.985), (STEEP, 0.995)])
        depth[105:136, 145:176] = missing
        image = paint([(FLAT, BLUE), (STEEP, RED)], shaded=False)
        (alone,) = crossings(FLAT, STEEP, mask=MASK, depth=depth)
        (helped,) = crossings(FLAT, STEEP, image=image, depth=depth)
        assert (alone.top, helped.top) == (None, 1)

    def test_what_the_configuration_calls_invalid_is_missing(self) -> None:
        depth = depth_of([(FLAT, 0.985), (STEEP, 0.995)])
        (crossing,) = crossings(FLAT, STEEP, mask=MASK, depth=depth, config=LiftingConfig(max_depth_m=0.5))
        assert crossing.top is None

    def test_a_very_oblique_crossing_is_found_but_its_order_is_unknown(self) -> None:
        oblique = line((40, 100), (280, 140))
        image = paint([(FLAT, BLUE), (oblique, RED)], shaded=False)
        (crossing,) = crossings(FLAT, oblique, image=image)
        assert crossing.top is None


class TestThroughThePipeline:
    def test_a_drawn_cross_is_one_crossing_with_its_order(self) -> None:
        strokes = [(FLAT, BLUE), (STEEP, RED)]
        image = paint(strokes, shaded=True)
        mask = sum(draw_cable(curve.sample(100), int(WIDTH), SIZE) for curve, _ in strokes)
        result = Pipeline().process(Frame(image=image, mask=np.asarray(mask)))
        (crossing,) = result.crossings
        assert crossing.position == pytest.approx((160, 120), abs=2)
        colours = [image[tuple(np.rint(result.detections[d].curve(0.9)).astype(int)[::-1])] for d, _ in crossing.passes]
        assert crossing.top is not None
        assert colours[crossing.top][2] > colours[1 - crossing.top][2]
        assert list(result.stage_ms).index("crossings") == list(result.stage_ms).index("fitting") + 1

    def test_a_frame_without_a_crossing_has_none(self) -> None:
        mask = cv2.circle(np.zeros(SIZE, np.uint8), (160, 120), 80, 1, 9)
        assert Pipeline().process(Frame(mask=mask)).crossings == ()
        assert dloftbs.Pipeline().process(Frame(mask=MASK)).crossings == ()
