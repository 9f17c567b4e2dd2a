"""Evidence of occlusion: what depth, occluders and the mask say of a place, and how far along a curve lies."""

from __future__ import annotations

import numpy as np
import pytest
from builders import curve_through
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.camera import PinholeCamera
from dloftbs.config import LiftingConfig
from dloftbs.data.curve_samples import SAMPLES, U
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.evidence import HIDDEN, IN_SIGHT, UNKNOWN, OcclusionEvidence

SIZE = (120, 160)
WIDTH = 8.0
CAMERA = PinholeCamera(100.0, 100.0, 80.0, 60.0)
OCCLUDERS = np.zeros(SIZE, np.uint8)
OCCLUDERS[:, :50] = 7  # any non-zero


def look(evidence: OcclusionEvidence, x: float, y: float = 60.0, depth_m: float | None = None) -> int:
    given = None if depth_m is None else np.array([depth_m])
    return int(evidence.look(np.array([(x, y)]), WIDTH, given)[0])


def depth_of(metres: float) -> np.ndarray:
    return np.full(SIZE, metres, np.float32)


class TestOccluders:
    EVIDENCE = OcclusionEvidence(occluders=OCCLUDERS)

    @pytest.mark.parametrize(("x", "expected"), [(30, HIDDEN), (48, HIDDEN), (53, UNKNOWN), (60, UNKNOWN)])
    def test_under_them_is_hidden_and_elsewhere_something_else_may_hide(self, x, expected):
        assert look(self.EVIDENCE, x) == expected

    @pytest.mark.parametrize("place", [(-3.0, 60.0), (163.0, 60.0), (100.0, -2.0), (100.0, 121.0)])
    def test_outside_of_the_image_is_hidden(self, place):
        assert look(self.EVIDENCE, *place) == HIDDEN

    def test_outside_of_a_region_of_interest_is_hidden(self):
        inside = np.zeros(SIZE, np.uint8)
        inside[:, :120] = 1
        frame = Frame(mask=np.zeros(SIZE, np.uint8), occluders=OCCLUDERS)
        evidence = OcclusionEvidence.of(frame, frame.mask, LiftingConfig(), inside)
        assert [look(evidence, x) for x in (60.0, 119.0, 121.0, 163.0)] == [UNKNOWN, UNKNOWN, HIDDEN, HIDDEN]

    @given(st.floats(-20.0, 180.0), st.floats(-20.0, 140.0))
    def test_a_place_is_told_as_pixel_by_pixel(self, x, y):
        inside = -0.5 < x < SIZE[1] - 0.5 and -0.5 < y < SIZE[0] - 0.5
        covered = OCCLUDERS[int(np.clip(np.rint(y), 0, SIZE[0] - 1)), int(np.clip(np.rint(x), 0, SIZE[1] - 1))]
        assert look(self.EVIDENCE, x, y) == (HIDDEN if covered or not inside else UNKNOWN)


class TestDepth:
    @pytest.mark.parametrize(
        ("metres", "expected"),
        [(0.5, HIDDEN), (0.95, HIDDEN), (0.99, UNKNOWN), (1.01, UNKNOWN), (1.05, IN_SIGHT), (2.0, IN_SIGHT), (0.0, 0)],
    )
    def test_nearer_hides_and_farther_is_in_plain_sight(self, metres, expected):
        evidence = OcclusionEvidence(depth=depth_of(metres), camera=CAMERA)
        assert look(evidence, 80.0, depth_m=1.0) == expected

    def test_it_outranks_occluders_where_it_tells(self):
        for metres, expected in ((0.5, HIDDEN), (1.0, UNKNOWN), (1.5, IN_SIGHT)):
            evidence = OcclusionEvidence(depth=depth_of(metres), camera=CAMERA, occluders=np.zeros(SIZE, np.bool_))
            assert look(evidence, 80.0, depth_m=1.0) == expected
        covered = OcclusionEvidence(depth=depth_of(1.5), camera=CAMERA, occluders=np.ones(SIZE, np.bool_))
        assert look(covered, 80.0, depth_m=1.0) == IN_SIGHT

    def test_it_says_nothing_of_a_curve_without_one(self):
        assert look(OcclusionEvidence(depth=depth_of(0.5), camera=CAMERA), 80.0) == UNKNOWN

    def test_a_part_of_the_width_in_front_is_no_plain_sight(self):
        depth = depth_of(1.5)
        depth[:, 84:] = 0.5
        evidence = OcclusionEvidence(depth=depth, camera=CAMERA)
        assert [look(evidence, x, depth_m=1.0) for x in (70.0, 82.0, 90.0)] == [IN_SIGHT, UNKNOWN, HIDDEN]

    def test_counts_have_their_unit(self):
        evidence = OcclusionEvidence(depth=np.full(SIZE, 5000, np.uint16), camera=CAMERA, depth_unit_m=1e-4)
        assert [look(evidence, 80.0, depth_m=z) for z in (0.3, 0.5, 0.7)] == [IN_SIGHT, UNKNOWN, HIDDEN]

    def test_the_distance_along_a_curve_is_that_at_its_image(self):
        ends = np.array([(-0.2, 0.1, 0.5), (0.6, 0.0, 1.5)])
        curve = curve_through(ends[0] + np.linspace(0.0, 1.0, 40)[:, None] * (ends[1] - ends[0]))
        depth_m = OcclusionEvidence(depth=depth_of(2.0), camera=CAMERA).depth_along(curve)
        dense = curve(np.linspace(0.0, 1.0, 20_001))
        seen = CAMERA.project(dense)
        along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(seen, axis=0).T))))
        assert depth_m.shape == (SAMPLES,)
        np.testing.assert_allclose(depth_m, np.interp(U, along / along[-1], dense[:, 2]), atol=2e-3)
        assert depth_m[SAMPLES // 2] < 0.85  # where in space it would be 1.0

    def test_there_is_none_behind_the_camera_or_without_one(self):
        curve = curve_through(np.linspace((0.0, 0.0, -0.1), (0.1, 0.0, 1.0), 20))
        assert OcclusionEvidence(depth=depth_of(2.0), camera=CAMERA).depth_along(curve) is None
        assert TestOccluders.EVIDENCE.depth_along(curve) is None


def test_without_a_mask_to_believe_all_is_hidden_but_what_depth_shows():
    frame = Frame(mask=OCCLUDERS, occluders=np.zeros(SIZE, np.uint8), depth=depth_of(1.0), camera=CAMERA)
    evidence = OcclusionEvidence.of(frame, None, LiftingConfig())
    assert not evidence.has_image
    assert [look(evidence, 100), look(evidence, 100, depth_m=0.5), look(evidence, 30, depth_m=0.5)] == [
        HIDDEN,
        IN_SIGHT,
        IN_SIGHT,
    ]
    for frame in (Frame(mask=OCCLUDERS), Frame(image=np.zeros((*SIZE, 3), np.uint8))):
        assert look(OcclusionEvidence.of(frame, None, LiftingConfig()), 100) == HIDDEN


def test_the_image_tells_nothing_of_what_hides():
    """A hand looks like the table as often as not."""
    mask, image = np.zeros(SIZE, np.uint8), np.full((*SIZE, 3), 128, np.uint8)
    mask[56:64, :100] = 1
    image[mask > 0], image[40:80, 100:130] = (0, 0, 200), (200, 0, 0)
    evidence = OcclusionEvidence(mask=mask, image=image)
    assert [look(evidence, x) for x in (50.0, 115.0, 145.0, 170.0)] == [UNKNOWN, UNKNOWN, UNKNOWN, HIDDEN]


class TestInput:
    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            ({}, "needs occluders, depth or an image, got none of them"),
            ({"mask": OCCLUDERS}, "needs occluders, depth or an image, got none of them"),
            ({"depth": depth_of(1.0)}, "`depth` requires `camera`, got None"),
            ({"occluders": OCCLUDERS, "depth": depth_of(1.0)[:5], "camera": CAMERA}, "must have the same size"),
            ({"occluders": OCCLUDERS, "mask": OCCLUDERS[:5]}, "must have the same size"),
            ({"occluders": OCCLUDERS / 2.0}, "occluders must be bool or integer, any non-zero being an occluder"),
            ({"depth": depth_of(1.0), "camera": "kinect"}, "camera must be"),
        ],
    )
    def test_what_is_wrong_is_said(self, arguments, message):
        with pytest.raises(InputError, match=message):
            OcclusionEvidence(**arguments)

    def test_a_frame_without_evidence_has_none(self):
        mask = np.ones(SIZE, np.bool_)
        config = LiftingConfig()
        assert OcclusionEvidence.of(Frame(mask=mask), mask, config) is None
        assert OcclusionEvidence.of(Frame(mask=mask, depth=depth_of(1.0)), mask, config) is None
        assert OcclusionEvidence.of(Frame(mask=mask, depth=depth_of(1.0), camera=CAMERA), mask, config).size == SIZE
        assert OcclusionEvidence.of(Frame(mask=mask, occluders=OCCLUDERS), mask, config).size == SIZE
