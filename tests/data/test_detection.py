"""Objects in one frame, and their crossings: their checks, the way back, and plain values."""

from __future__ import annotations

import math
import pickle
from dataclasses import FrozenInstanceError, replace

import cv2
import numpy as np
import pytest
from builders import NOT_SPANS, detection_of, line, through_json, wave

from dloftbs import detect
from dloftbs.data.centerline import Joint, JointKind
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Crossing, Detection
from dloftbs.errors import InputError

CROSSING = Joint(JointKind.CROSSING, (0.2, 0.3), cost=1.0, margin=4.0, confidence=0.8)
GAP = Joint(JointKind.GAP, (0.5, 0.7), cost=2.0, margin=2.0, confidence=0.5)
ALONE = Joint(JointKind.GAP, (0.8, 0.9), cost=1.0, margin=math.inf, alternatives=((4.0, 5.0), None))


class TestDetection:
    def test_width_is_twice_the_median_radius(self):
        assert detection_of(wave(), radius=2.5).width_px == 5.0

    @pytest.mark.parametrize(
        ("joints", "confidence"), [((), 1.0), ((CROSSING,), 0.8), ((CROSSING, GAP), 0.4), ((ALONE,), 1.0)]
    )
    def test_confidence_is_the_probability_that_all_joints_are_right(self, joints, confidence):
        assert detection_of(wave(), joints=joints).confidence == pytest.approx(confidence)

    def test_what_lies_under_gaps_was_inferred(self):
        detection = detection_of(wave(), joints=(CROSSING, GAP, ALONE))
        assert detection.centerline.gaps == ((0.5, 0.7), (0.8, 0.9))
        np.testing.assert_allclose(detection.inferred, wave().u_at([(0.5, 0.7), (0.8, 0.9)]), atol=1e-12)
        assert detection_of(wave(), joints=(CROSSING,)).inferred == ()

    def test_joints_lie_on_the_curve_by_its_length(self):
        """The curve is fitted by the distance along its pixels, and its own length is another in sharp bends."""
        mask = np.zeros((200, 400), np.uint8)
        corners = [(30 + 30 * k, 40 + 110 * (k % 2)) for k in range(12)]
        cv2.polylines(mask, [np.array(corners, np.int32)], False, 255, 10)
        mask[:, 203:216] = 0
        (detection,) = detect(mask, objects=1)
        assert detection.inferred
        for joint, own in zip(detection.joints, detection.centerline.joints, strict=True):
            assert joint.u != own.u
            np.testing.assert_allclose(detection.curve(joint.u), detection.curve.spline(own.u), atol=1e-6)
            assert (joint.kind, joint.cost, joint.margin) == (own.kind, own.cost, own.margin)
        t = np.linspace(0.0, 1.0, 100_001)
        along = np.cumsum(np.linalg.norm(np.diff(detection.curve(t), axis=0), axis=1))
        assert detection.curve.length == pytest.approx(along[-1], rel=1e-4)
        assert np.abs(along / along[-1] - t[1:]).max() < 1e-4

    def test_reversed_turns_everything(self):
        curve_3d = line((0.0, 0.0, 1.0), (1.0, 0.0, 2.0))
        detection = detection_of(wave(), curve_3d, (CROSSING, GAP))
        back = detection.reversed()
        assert back.curve == detection.curve.reversed()
        assert back.curve_3d == curve_3d.reversed()
        ((low, high),) = detection.inferred
        assert back.inferred == (pytest.approx((1.0 - high, 1.0 - low), abs=1e-9),)
        assert [joint.kind for joint in back.joints] == [JointKind.GAP, JointKind.CROSSING]
        np.testing.assert_array_equal(back.centerline.points, detection.centerline.points[::-1])
        assert (back.width_px, back.confidence) == (detection.width_px, detection.confidence)

    def test_what_no_depth_tells_of_turns_with_the_curve_in_space(self):
        made = detection_of(wave(), line((0.0, 0.0, 1.0), (1.0, 0.0, 2.0)))
        detection = Detection(made.centerline, made.curve, made.curve_3d, None, ((0.0, 0.125), (0.5, 0.75)))
        assert detection.reversed().inferred_3d == ((0.25, 0.5), (0.875, 1.0))
        assert detection.reversed().reversed().inferred_3d == detection.inferred_3d
        assert through_json(detection.to_dict())["inferred_3d"] == [[0.0, 0.125], [0.5, 0.75]]
        assert made.inferred_3d == ()

    def test_what_the_stages_found_along_the_spline_is_said_by_its_length(self):
        curve_3d = BSplineCurve([0, 0, 0, 0, 1, 1, 1, 1], [(0, 0, 1), (0, 0, 1.1), (0, 0, 1.2), (1, 0, 2)])
        line_ = detection_of(wave()).centerline
        found = Detection._unchecked(line_, wave(), curve_3d, None, ((0.25, 0.5), (0.75, 1.0)))
        np.testing.assert_allclose(found.inferred_3d, curve_3d.u_at([(0.25, 0.5), (0.75, 1.0)]), atol=1e-12)
        assert found.inferred_3d[1][1] == 1.0
        (first, _), (_, last) = found.reversed().inferred_3d
        assert (first, last) == (0.0, pytest.approx(1.0 - curve_3d.u_at(0.25), abs=1e-9))
        assert pickle.loads(pickle.dumps(found)).inferred_3d == found.inferred_3d
        with pytest.raises(AttributeError, match="'Detection' object has no attribute 'inferred_4d'"):
            found.inferred_4d  # noqa: B018

    def test_reversed_keeps_the_reason_for_no_curve_in_space(self):
        detection = Detection(detection_of(wave()).centerline, wave(), None, "the frame has no depth")
        assert detection.reversed().curve_3d is None
        assert detection.reversed().no_3d_reason == "the frame has no depth"

    def test_the_dictionary_is_strict_json(self):
        curve, curve_3d = wave(), line((0.0, 0.0, 1.0), (1.0, 0.0, 2.0))
        data = through_json(detection_of(curve, curve_3d, (CROSSING, ALONE)).to_dict())
        assert BSplineCurve.from_dict(data["curve"]) == curve
        assert BSplineCurve.from_dict(data["curve_3d"]) == curve_3d
        assert (data["width_px"], data["confidence"], data["no_3d_reason"]) == (6.0, pytest.approx(0.8), None)
        assert data["joints"] == [
            {
                "kind": "crossing",
                "u": pytest.approx(curve.u_at([0.2, 0.3]), abs=1e-12),
                "cost": 1.0,
                "margin": 4.0,
                "confidence": 0.8,
                "alternatives": [None, None],
            },
            {
                "kind": "gap",
                "u": pytest.approx(curve.u_at([0.8, 0.9]), abs=1e-12),
                "cost": 1.0,
                "margin": None,
                "confidence": 1.0,
                "alternatives": [[4.0, 5.0], None],
            },
        ]

    def test_a_detection_cannot_be_changed(self):
        with pytest.raises(FrozenInstanceError):
            detection_of(wave()).curve = wave()

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            *(("curve", value) for value in (None, "x", line((0, 0, 0), (1, 1, 1)))),
            *(("curve_3d", value) for value in ("x", wave())),
            ("no_3d_reason", 5),
            ("centerline", None),
        ],
    )
    def test_wrong_fields_are_refused(self, name, value):
        with pytest.raises(InputError, match=f"{name} must be"):
            replace(detection_of(wave()), **{name: value})

    @pytest.mark.parametrize("spans", NOT_SPANS)
    def test_what_no_depth_tells_of_lies_within_the_curve(self, spans):
        with pytest.raises(InputError, match="inferred_3d must be"):
            replace(detection_of(wave()), inferred_3d=spans)


class TestCrossing:
    def test_the_dictionary_is_strict_json(self):
        crossing = Crossing((10.5, 20.0), ((0, 0.25), (2, 0.75)), 1, 0.5)
        assert through_json(crossing.to_dict()) == {
            "position": [10.5, 20.0],
            "passes": [{"detection": 0, "u": 0.25}, {"detection": 2, "u": 0.75}],
            "top": 1,
            "confidence": 0.5,
        }

    def test_which_is_on_top_is_unknown_unless_said(self):
        crossing = Crossing((1.0, 2.0), ((0, 0.1), (0, 0.9)))
        assert (crossing.top, crossing.confidence) == (None, 0.0)
        assert through_json(crossing.to_dict())["top"] is None

    def test_a_crossing_cannot_be_changed(self):
        with pytest.raises(FrozenInstanceError):
            Crossing((1.0, 2.0), ((0, 0.1), (0, 0.9))).top = 0

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            *(("position", value) for value in ((1.0,), None, (math.nan, 1.0), "ab")),
            *(("passes", value) for value in (((0, 0.1),), ((0, 0.1), (0.5, 0.2)), ((0, 0.1), (0, 1.1)), None)),
            *(("top", value) for value in (2, -1, 0.0, True)),
            *(("confidence", value) for value in (-0.1, 1.1, math.nan)),
        ],
    )
    def test_wrong_fields_are_refused(self, name, value):
        with pytest.raises(InputError, match="must be"):
            replace(Crossing((1.0, 2.0), ((0, 0.1), (0, 0.9))), **{name: value})
