"""What goes in and what comes out: the checks of a frame, and results as plain values."""

from __future__ import annotations

import math
import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from builders import detection_of, line, loop, through_json, wave

from dloftbs._arrays import check_depth, check_image, check_mask
from dloftbs.camera import PinholeCamera
from dloftbs.centerline import Joint, JointKind
from dloftbs.curve import BSplineCurve
from dloftbs.errors import InputError
from dloftbs.frame import (
    Crossing,
    Detection,
    Frame,
    FrameResult,
    Track,
    TrackState,
)

IMAGE = np.zeros((4, 6, 3), np.uint8)
MASK = np.zeros((4, 6), np.uint8)
DEPTH = np.ones((4, 6), np.float32)
CROSSING = Joint(JointKind.CROSSING, (0.2, 0.3), cost=1.0, margin=4.0, confidence=0.8)
GAP = Joint(JointKind.GAP, (0.5, 0.7), cost=2.0, margin=2.0, confidence=0.5)
ALONE = Joint(JointKind.GAP, (0.8, 0.9), cost=1.0, margin=math.inf, alternatives=((4.0, 5.0), None))


class TestFrame:
    @pytest.mark.parametrize(
        ("fields", "message"),
        [
            ({}, "needs an image or a mask, got neither"),
            ({"depth": DEPTH}, "needs an image or a mask"),
            ({"image": MASK}, r"image must have shape \(H, W, 3\) and type uint8, got \(4, 6\) of uint8"),
            ({"image": np.zeros((4, 6, 4), np.uint8)}, r"got \(4, 6, 4\) of uint8"),
            ({"image": IMAGE.astype(float)}, r"got \(4, 6, 3\) of float64"),
            ({"image": IMAGE.astype(bool)}, r"got \(4, 6, 3\) of bool"),
            ({"mask": IMAGE}, r"mask must have shape \(H, W\) or \(H, W, 1\), got \(4, 6, 3\)"),
            ({"mask": MASK[0]}, r"mask must have shape .* got \(6,\)"),
            ({"mask": MASK.astype(np.float32)}, "mask must be bool or integer, .* got float32"),
            ({"mask": MASK.astype(str)}, "mask must be bool or integer"),
            ({"mask": MASK.astype("m8[s]")}, r"mask must be bool or integer, .* got timedelta64\[s\]"),
            ({"mask": MASK.astype("M8[s]")}, r"mask must be bool or integer, .* got datetime64\[s\]"),
            ({"mask": MASK.astype(complex)}, "mask must be bool or integer, .* got complex128"),
            ({"mask": MASK.astype(object)}, "mask must be bool or integer, .* got object"),
            ({"mask": np.zeros((4, 6), [("a", "u1")])}, "mask must be bool or integer"),
            ({"mask": [[0, 1], [1]]}, "mask must be an array of numbers, got .*inhomogeneous"),
            ({"mask": [[10**400]]}, "mask must be bool or integer, .* got object"),
            ({"mask": "mask.png"}, r"mask must have shape .* got \(\)"),
            ({"mask": {"a": 1}}, r"mask must have shape .* got \(\)"),
            ({"image": [[[0, 0, 0]], [[0, 0]]]}, "image must be an array of numbers, got .*inhomogeneous"),
            ({"mask": MASK, "depth": MASK.astype("m8[s]")}, r"depth must be .* got timedelta64\[s\]"),
            ({"mask": MASK, "depth": MASK.astype("M8[s]")}, "depth must be .* got datetime64"),
            ({"mask": MASK, "depth": MASK.astype(object)}, "depth must be .* got object"),
            ({"mask": MASK, "depth": [[1.0], [1.0, 2.0]]}, "depth must be an array of numbers, got .*inhomogeneous"),
            ({"mask": MASK, "camera": "x"}, "camera must be a PinholeCamera, got 'x'"),
            ({"mask": MASK, "camera": (1, 1, 0, 0)}, "camera must be a PinholeCamera"),
            ({"mask": MASK, "index": 1.0}, r"index must be an integer in 0\.\.9007199254740992, got 1.0"),
            ({"mask": MASK, "index": -1}, "index must be an integer"),
            ({"mask": MASK, "index": True}, "index must be an integer"),
            (
                {"mask": MASK, "index": 10**5000},
                "index must be .*, got an integer of thousands of digits",
            ),
            ({"mask": MASK, "stamp": "0.5"}, "stamp must be a finite number of seconds, .* got '0.5'"),
            ({"mask": MASK, "stamp": math.nan}, "stamp must be a finite number of seconds, .* got nan"),
            ({"mask": MASK, "stamp": -math.inf}, "stamp must be a finite number of seconds, .* got -inf"),
            ({"mask": MASK, "stamp": True}, "stamp must be a finite number"),
            (
                {"mask": MASK, "stamp": 10**400},
                "stamp must be a finite .*, 1e.11 at most, got 1000.* char",
            ),
            ({"mask": MASK, "stamp": np.datetime64("2026-01-01")}, "stamp must be a finite number of seconds"),
            ({"mask": MASK, "stamp": np.timedelta64(5)}, "stamp must be a finite number of seconds"),
            ({"mask": MASK, "name": None}, "name must be text, got None"),
            ({"mask": MASK, "name": b"a.png"}, "name must be text"),
            ({"mask": MASK, "depth": DEPTH[None]}, r"depth must have shape \(H, W\) or \(H, W, 1\), got \(1, 4, 6\)"),
            ({"mask": MASK, "depth": DEPTH > 0}, "depth must be integer counts or floating-point metres, got bool"),
            ({"mask": MASK, "depth": DEPTH.astype(complex)}, "depth must be .* got complex128"),
            (
                {"mask": MASK, "depth": DEPTH.T},
                r"depth must have the frame's size \(4, 6\) \(rows, columns\), got \(6, 4\)",
            ),
            ({"image": IMAGE, "mask": MASK[:3]}, r"mask must have the frame's size \(4, 6\) .* got \(3, 6\)"),
            ({"image": IMAGE, "depth": DEPTH[:, :5]}, r"depth must have the frame's size \(4, 6\) .* got \(4, 5\)"),
        ],
    )
    def test_what_is_wrong_is_said_with_what_came(self, fields, message):
        with pytest.raises(InputError, match=message):
            Frame(**fields)

    @pytest.mark.parametrize("dtype", [bool, np.uint8, np.int8, np.uint16, np.int32, np.int64, np.uint64])
    def test_a_mask_may_be_bool_or_any_integer(self, dtype):
        frame = Frame(mask=MASK.astype(dtype))
        assert frame.mask.dtype == dtype
        assert frame.size == (4, 6)

    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int32, np.float16, np.float32, np.float64])
    def test_depth_may_be_integer_or_floating_point(self, dtype):
        assert Frame(mask=MASK, depth=DEPTH.astype(dtype)).depth.dtype == dtype

    def test_numbers_and_text_of_numpy_become_plain_ones(self):
        frame = Frame(mask=MASK, index=np.uint16(3), stamp=np.float32(0.5), name=np.str_("a"))
        assert [type(value) for value in (frame.index, frame.stamp, frame.name)] == [int, float, str]
        assert type(Frame(mask=MASK, stamp=np.int64(2)).stamp) is float

    def test_a_last_axis_of_one_is_dropped(self):
        frame = Frame(mask=MASK[:, :, None], depth=DEPTH[:, :, None])
        assert frame.mask.shape == frame.depth.shape == (4, 6)

    def test_the_arrays_are_views_that_cannot_be_written_through(self):
        given = {"image": IMAGE.copy(), "mask": MASK[:, :, None].copy(), "depth": DEPTH.copy()}
        frame = Frame(**given)
        for name, array in given.items():
            held = getattr(frame, name)
            assert np.shares_memory(held, array)
            with pytest.raises(ValueError, match="read-only"):
                held[0, 0] = 1
            assert array.flags.writeable
            array[0, 0] = 7
            assert (held[0, 0] == 7).all()

    @pytest.mark.parametrize("cut", [np.s_[::-1, ::2], np.s_[1:3, 2:5]])
    def test_arrays_that_are_not_contiguous_are_not_copied_either(self, cut):
        frame = Frame(image=IMAGE[cut], mask=MASK[cut])
        assert np.shares_memory(frame.image, IMAGE)
        assert np.shares_memory(frame.mask, MASK)

    def test_a_read_only_array_is_taken(self):
        mask = MASK.copy()
        mask.flags.writeable = False
        assert np.shares_memory(Frame(mask=mask).mask, mask)

    def test_lists_are_taken(self):
        assert Frame(mask=[[0, 1, 1]]).size == (1, 3)

    def test_the_size_is_rows_and_columns_of_what_there_is(self):
        assert Frame(image=IMAGE).size == (4, 6)
        assert Frame(mask=MASK).size == (4, 6)

    def test_a_frame_cannot_be_changed(self):
        frame = Frame(mask=MASK, camera=PinholeCamera(1, 1, 0, 0), index=3, stamp=0.5, name="a.png")
        for name in ("image", "mask", "depth", "camera", "index", "stamp", "name"):
            with pytest.raises(FrozenInstanceError):
                setattr(frame, name, None)
        assert (frame.index, frame.stamp, frame.name) == (3, 0.5, "a.png")

    def test_the_checks_give_back_the_array_itself(self):
        assert check_image(IMAGE) is IMAGE
        assert check_mask(MASK) is MASK
        assert check_depth(DEPTH) is DEPTH

    def test_depth_of_another_size_names_the_remedy(self):
        with pytest.raises(
            InputError, match=r"registered to the image first: DepthRegistration\.register, .*registration="
        ):
            Frame(image=IMAGE, depth=DEPTH[:, :5])

    def test_a_camera_of_another_size_is_refused(self):
        camera = PinholeCamera(1, 1, 0, 0, size=(8, 12))
        with pytest.raises(
            InputError, match=r"for images of size \(8, 12\) .* got one of \(4, 6\).*camera\.scaled\(\(4, 6\)\)"
        ):
            Frame(mask=MASK, camera=camera)
        assert Frame(mask=MASK, camera=camera.scaled((4, 6))).camera.size == (4, 6)


NOT_SPANS = [
    ((0.5, 0.2),),
    ((-1e-9, 0.1),),
    ((0.9, 1.0 + 1e-9),),
    ((0.5, 0.6), (0.1, 0.2)),
    ((0.1,),),
    (0.1, 0.2),
    None,
    ((math.nan, 1.0),),
    (("0", "1"),),
]


class TestFields:
    """Of what comes out: wrong ones are refused where a result is made."""

    @pytest.mark.parametrize("spans", NOT_SPANS)
    def test_what_is_inferred_lies_within_the_curve(self, spans):
        with pytest.raises(InputError, match="inferred_3d must be"):
            replace(detection_of(wave()), inferred_3d=spans)
        with pytest.raises(InputError, match="inferred must be"):
            Track(1, TrackState.CONFIRMED, wave(), None, 1, 0, None, spans)

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            *(("curve", value) for value in (None, "x", line((0, 0, 0), (1, 1, 1)))),
            *(("curve_3d", value) for value in ("x", wave())),
            ("no_3d_reason", 5),
            ("centerline", None),
        ],
    )
    def test_of_a_detection(self, name, value):
        with pytest.raises(InputError, match=f"{name} must be"):
            replace(detection_of(wave()), **{name: value})

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            *(("id", value) for value in (0, -1, 1.0, True, "1", 10**400)),
            *(("state", value) for value in ("confirmed", None)),
            *(("curve", value) for value in (None, line((0, 0, 0), (1, 1, 1)))),
            *(("curve_3d", value) for value in ("x", wave())),
            *(("hits", value) for value in (-1, 1.0)),
            *(("misses", value) for value in (-1, None)),
            ("detection", wave()),
            *(("confidence", value) for value in (-0.1, 1.1, math.nan, None)),
            *(("width", value) for value in (-0.1, math.inf, math.nan, "3")),
        ],
    )
    def test_of_a_track(self, name, value):
        with pytest.raises(InputError, match=f"{name} must be"):
            replace(Track(1, TrackState.CONFIRMED, wave(), None, 1, 0, None), **{name: value})

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            *(("position", value) for value in ((1.0,), None, (math.nan, 1.0), "ab")),
            *(("passes", value) for value in (((0, 0.1),), ((0, 0.1), (0.5, 0.2)), ((0, 0.1), (0, 1.1)), None)),
            *(("top", value) for value in (2, -1, 0.0, True)),
            *(("confidence", value) for value in (-0.1, 1.1, math.nan)),
        ],
    )
    def test_of_a_crossing(self, name, value):
        with pytest.raises(InputError, match="must be"):
            replace(Crossing((1.0, 2.0), ((0, 0.1), (0, 0.9))), **{name: value})

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            *(("u", value) for value in ((0.5, 0.2), (-0.1, 0.2), None, (0.1,))),
            *(("kind", value) for value in ("gap", None)),
            *(("cost", value) for value in (-1.0, math.inf, "1")),
            *(("margin", value) for value in (-1.0, math.nan, -math.inf)),
            *(("confidence", value) for value in (1.1, None)),
            *(("alternatives", value) for value in ((None,), ((1.0,), None), None)),
        ],
    )
    def test_of_a_joint(self, name, value):
        with pytest.raises(InputError, match=f"{name} must be"):
            replace(GAP, **{name: value})

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("detections", (1,)),
            ("tracks", None),
            ("reason", 5),
            *(("size", value) for value in ((4,), (4.0, 6), None, (-1, 6), (10**400, 6))),
            *(("stage_ms", value) for value in (None, {"a": "b"}, {1: 2.0}, {"a": math.nan})),
            *(("index", value) for value in (-1, 1.0)),
            *(("stamp", value) for value in (math.nan, "1", 10**400)),
            ("name", None),
            ("crossings", (None,)),
        ],
    )
    def test_of_a_result(self, name, value):
        with pytest.raises(InputError, match=f"{name} must"):
            replace(FrameResult((), (), None, (4, 6)), **{name: value})


class TestDetection:
    def test_width_is_twice_the_median_radius(self):
        assert detection_of(wave(), radius=2.5).width == 5.0

    @pytest.mark.parametrize(
        ("joints", "confidence"), [((), 1.0), ((CROSSING,), 0.8), ((CROSSING, GAP), 0.5), ((ALONE,), 1.0)]
    )
    def test_confidence_is_that_of_the_least_certain_joint(self, joints, confidence):
        assert detection_of(wave(), joints=joints).confidence == pytest.approx(confidence)

    def test_what_lies_under_gaps_was_inferred(self):
        assert detection_of(wave(), joints=(CROSSING, GAP, ALONE)).inferred == ((0.5, 0.7), (0.8, 0.9))
        assert detection_of(wave(), joints=(CROSSING,)).inferred == ()

    def test_reversed_turns_everything(self):
        curve_3d = line((0.0, 0.0, 1.0), (1.0, 0.0, 2.0))
        detection = detection_of(wave(), curve_3d, (CROSSING, GAP))
        back = detection.reversed()
        assert back.curve == detection.curve.reversed()
        assert back.curve_3d == curve_3d.reversed()
        assert back.inferred == (pytest.approx((0.3, 0.5)),)
        assert [joint.kind for joint in back.joints] == [JointKind.GAP, JointKind.CROSSING]
        np.testing.assert_array_equal(back.centerline.points, detection.centerline.points[::-1])
        assert (back.width, back.confidence) == (detection.width, detection.confidence)

    def test_what_no_depth_tells_of_turns_with_the_curve_in_space(self):
        made = detection_of(wave(), line((0.0, 0.0, 1.0), (1.0, 0.0, 2.0)))
        detection = Detection(made.centerline, made.curve, made.curve_3d, None, ((0.0, 0.125), (0.5, 0.75)))
        assert detection.reversed().inferred_3d == ((0.25, 0.5), (0.875, 1.0))
        assert detection.reversed().reversed().inferred_3d == detection.inferred_3d
        assert through_json(detection.to_dict())["inferred_3d"] == [[0.0, 0.125], [0.5, 0.75]]
        assert made.inferred_3d == ()

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
                "u": [0.2, 0.3],
                "cost": 1.0,
                "margin": 4.0,
                "confidence": 0.8,
                "alternatives": [None, None],
            },
            {
                "kind": "gap",
                "u": [0.8, 0.9],
                "cost": 1.0,
                "margin": None,
                "confidence": 1.0,
                "alternatives": [[4.0, 5.0], None],
            },
        ]

    def test_a_detection_cannot_be_changed(self):
        with pytest.raises(FrozenInstanceError):
            detection_of(wave()).curve = wave()


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


class TestTrack:
    def test_the_dictionary_is_strict_json(self):
        curve_3d = line((0.0, 0.0, 1.0), (1.0, 0.0, 2.0))
        data = through_json(Track(3, TrackState.HIDDEN, loop(20.0), curve_3d, 5, 2, None).to_dict())
        assert (data["id"], data["state"], data["hits"], data["misses"]) == (3, "hidden", 5, 2)
        assert BSplineCurve.from_dict(data["curve"]) == loop(20.0)
        assert BSplineCurve.from_dict(data["curve_3d"]) == curve_3d


class TestFrameResult:
    def test_the_dictionary_is_strict_json(self):
        detection = detection_of(wave())
        track = Track(1, TrackState.TENTATIVE, detection.curve, None, 1, 0, detection)
        stage_ms = {"cleaning": 0.5, "fitting": 0.25}
        result = FrameResult((detection,), (track,), None, (480, 640), stage_ms, 7, 0.2, "a.png")
        data = through_json(result.to_dict())
        assert data["detections"] == [through_json(detection.to_dict())]
        assert data["tracks"] == [through_json(track.to_dict())]
        assert (data["index"], data["stamp"], data["name"], data["size"]) == (7, 0.2, "a.png", [480, 640])
        assert data["stage_ms"] == stage_ms
        assert result.total_ms == 0.75

    def test_crossings_are_among_what_was_found(self):
        crossing = Crossing((10.5, 20.0), ((0, 0.25), (0, 0.75)), 1, 0.5)
        result = FrameResult((detection_of(wave()),), (), None, (4, 6), crossings=(crossing,))
        assert through_json(result.to_dict())["crossings"] == [through_json(crossing.to_dict())]
        assert FrameResult((), (), None, (4, 6)).to_dict()["crossings"] == []

    def test_nothing_is_a_result_with_a_reason(self):
        result = FrameResult((), (), "the mask is empty", (4, 6))
        data = through_json(result.to_dict())
        assert (data["detections"], data["tracks"], data["reason"]) == ([], [], "the mask is empty")
        assert (data["stage_ms"], result.total_ms) == ({}, 0)

    def test_the_default_of_the_stage_times_is_shared_by_no_two_results(self):
        first, second = (FrameResult((), (), None, (4, 6)) for _ in range(2))
        assert first.stage_ms == second.stage_ms == {}
        assert first.stage_ms is not second.stage_ms

    def test_results_can_go_to_another_process(self):
        detection = detection_of(wave())
        result = FrameResult((detection,), (), None, (4, 6), {"cleaning": 0.5})
        again = pickle.loads(pickle.dumps(result))
        assert again.detections[0].curve == detection.curve
        assert again.to_dict() == result.to_dict()
