"""What goes in: the checks of a frame."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, replace

import cv2
import numpy as np
import pytest

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.pipeline import Pipeline
from dloftbs.support.arrays import check_depth, check_image, check_mask

IMAGE = np.zeros((4, 6, 3), np.uint8)
MASK = np.zeros((4, 6), np.uint8)
DEPTH = np.ones((4, 6), np.float32)


class TestFrame:
    @pytest.mark.parametrize(
        ("fields", "message"),
        [
            ({}, "needs an image, a mask or instances, got none"),
            ({"depth": DEPTH}, "needs an image, a mask or instances"),
            ({"image": MASK}, r"image must have shape \(H, W, 3\) and type uint8, got \(4, 6\) of uint8"),
            ({"image": np.zeros((4, 6, 4), np.uint8)}, r"got \(4, 6, 4\) of uint8"),
            ({"image": IMAGE.astype(float)}, r"got \(4, 6, 3\) of float64"),
            ({"image": IMAGE.astype(bool)}, r"got \(4, 6, 3\) of bool"),
            (
                {"mask": IMAGE},
                r"mask must have shape \(H, W\), \(H, W, 1\) or \(1, H, W\), got \(4, 6, 3\); .*mask\[\.\.\., 0\]",
            ),
            ({"mask": MASK[0]}, r"mask must have shape .* got \(6,\)"),
            ({"mask": MASK.astype(np.float32) + 2}, r"mask must be a probability in 0\.\.1 .*, got 2\.\.2; of scores"),
            ({"mask": np.full((4, 6), np.nan)}, r"mask must be a probability in 0\.\.1 .*, got nan\.\.nan"),
            ({"mask": MASK, "occluders": MASK.astype(np.float32)}, r"threshold it first: occluders > 0\.5"),
            ({"mask": MASK, "mask_is": "soft"}, "mask_is must be one of auto, binary, probability, labels, got 'soft'"),
            ({"mask": MASK.astype(np.int32), "mask_is": "probability"}, "must be uint8, uint16 or floating point, got"),
            ({"mask": MASK.astype(str)}, "mask must be bool or integer"),
            ({"mask": MASK.astype("m8[s]")}, r"mask must be bool or integer, .* got timedelta64\[s\]"),
            ({"mask": MASK.astype("M8[s]")}, r"mask must be bool or integer, .* got datetime64\[s\]"),
            ({"mask": MASK.astype(complex)}, "mask must be bool or integer, .* got complex128"),
            ({"mask": MASK.astype(object)}, "mask must be bool or integer, .* got object"),
            ({"mask": np.zeros((4, 6), [("a", "u1")])}, "mask must be bool or integer"),
            ({"mask": [[0, 1], [1]]}, "mask must be an array of numbers, got .*inhomogeneous"),
            ({"mask": [[10**400]]}, "mask must be bool or integer, .* got object"),
            (
                {"mask": "mask.png"},
                r"mask must be an array, got 'mask\.png'; detect, track and sources\.open read files",
            ),
            ({"mask": {"a": 1}}, r"mask must be an array, got \{'a': 1\}"),
            ({"image": [[[0, 0, 0]], [[0, 0]]]}, "image must be an array of numbers, got .*inhomogeneous"),
            ({"mask": MASK, "depth": MASK.astype("m8[s]")}, r"depth must be .* got timedelta64\[s\]"),
            ({"mask": MASK, "depth": MASK.astype("M8[s]")}, "depth must be .* got datetime64"),
            ({"mask": MASK, "depth": MASK.astype(object)}, "depth must be .* got object"),
            ({"mask": MASK, "depth": [[1.0], [1.0, 2.0]]}, "depth must be an array of numbers, got .*inhomogeneous"),
            ({"mask": MASK, "depth_unit_m": 0.0}, r"depth_unit_m must be a finite number in 1e-09\.\.1000, got 0.0"),
            ({"mask": MASK, "depth_unit_m": "mm"}, "depth_unit_m must be a finite number .* got 'mm'"),
            ({"mask": MASK, "depth_unit_m": True}, "depth_unit_m must be a finite number"),
            ({"mask": MASK, "camera": 5}, "camera must be a PinholeCamera, .* got 5"),
            ({"mask": MASK, "camera": (1, 1, 0)}, r"camera must be a PinholeCamera, .* got \(1, 1, 0\)"),
            ({"mask": MASK, "index": 1.0}, r"index must be an integer in 0\.\.9007199254740992, got 1.0"),
            ({"mask": MASK, "index": -1}, "index must be an integer"),
            ({"mask": MASK, "index": True}, "index must be an integer"),
            ({"mask": MASK, "index": 10**5000}, "index must be .*, got an integer of thousands of digits"),
            ({"mask": MASK, "stamp": "0.5"}, "stamp must be a finite number of seconds, .* got '0.5'"),
            ({"mask": MASK, "stamp": math.nan}, "stamp must be a finite number of seconds, .* got nan"),
            ({"mask": MASK, "stamp": -math.inf}, "stamp must be a finite number of seconds, .* got -inf"),
            ({"mask": MASK, "stamp": True}, "stamp must be a finite number"),
            ({"mask": MASK, "stamp": 10**400}, "stamp must be a finite .*, 1e.11 at most, got 1000.* char"),
            ({"mask": MASK, "stamp": np.datetime64("2026-01-01")}, "stamp must be a finite number of seconds"),
            ({"mask": MASK, "stamp": np.timedelta64(5)}, "stamp must be a finite number of seconds"),
            ({"mask": MASK, "name": None}, "name must be text, got None"),
            ({"mask": MASK, "name": b"a.png"}, "name must be text"),
            ({"mask": MASK, "depth": np.stack([DEPTH] * 2)}, r"depth must have shape \(H, W\), .* got \(2, 4, 6\)"),
            ({"mask": MASK, "depth": DEPTH > 0}, "depth must be integer counts or floating-point metres, got bool"),
            (
                {"mask": MASK, "depth": DEPTH.astype(np.uint8)},
                "depth must be .* got uint8; 8 bits are .* picture of dep",
            ),
            ({"mask": MASK, "depth": DEPTH.astype(np.int8)}, r"depth must be .* depth\.astype\(np\.uint16\)"),
            ({"mask": MASK, "depth": DEPTH.astype(complex)}, "depth must be .* got complex128"),
            (
                {"mask": MASK, "depth": DEPTH.T},
                r"depth must have the frame's size \(4, 6\) \(rows, columns\), got \(6, 4\)",
            ),
            (
                {"mask": MASK, "occluders": DEPTH * 0.5},
                "occluders must be bool or integer, any non-zero being an occluder",
            ),
            ({"image": IMAGE, "instances": MASK[:3]}, r"instances must have the size \(4, 6\) .* got \(3, 6\)"),
            ({"mask": MASK, "instances": DEPTH}, "instances must be bool or integer, got float32; threshold it first"),
            ({"instances": []}, "an empty list, of which nothing says the size"),
            ({"mask": MASK, "occluders": MASK[:3]}, r"occluders must have the frame's size \(4, 6\) .* got \(3, 6\)"),
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

    @pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
    def test_a_floating_point_mask_is_a_probability_of_8_bits(self, dtype):
        frame = Frame(mask=np.array([[0.0, 0.25, 0.5, 1.0]], dtype))
        assert frame.mask_is == "probability"
        assert frame.mask.tolist() == [[0, 64, 128, 255]]
        assert frame.mask.dtype == np.uint8

    @pytest.mark.parametrize(
        ("values", "fields", "expected"),
        [
            (np.array([[0.0, 0.02, 0.49, 0.51, 1.0]]), {}, [0, 0, 0, 1, 1]),
            (np.array([[0, 5, 127, 128, 255]], np.uint8), {"mask_is": "probability"}, [0, 0, 0, 1, 1]),
            (np.array([[0, 5, 127, 128, 255]], np.uint8), {"mask_is": "binary"}, [0, 1, 1, 1, 1]),
            (np.array([[0, 5, 127, 128, 255]], np.uint8), {}, [0, 1, 1, 1, 1]),  # too few values for a probability
            (np.array([[0, 1, 2, 3, 255]], np.uint8), {}, [0, 1, 1, 1, 0]),
            (np.array([[0, 1, 2, 3, 255]], np.uint8), {"mask_is": "labels"}, [0, 1, 1, 1, 0]),
            (np.array([[0, 1, 2, 33, 255]], np.uint8), {"mask_is": "labels"}, [0, 1, 1, 1, 1]),
            (np.array([[-1, 0, 300, 1, 2]], np.int32), {}, [1, 0, 1, 1, 1]),
            (np.array([[False, True, False, True, True]]), {}, [0, 1, 0, 1, 1]),
        ],
    )
    def test_cable_is_what_the_values_of_the_mask_say(self, values, fields, expected):
        is_cable = Frame(mask=values, **fields).is_cable
        assert is_cable.dtype == np.bool_
        assert is_cable.tolist() == [[bool(one) for one in expected]]

    @pytest.mark.parametrize("fields", [{}, {"mask_is": "probability"}, {"mask_is": "binary"}])
    def test_cable_is_what_the_pipeline_reads(self, fields):
        mask = cv2.GaussianBlur(cv2.line(np.zeros((120, 160), np.uint8), (20, 30), (140, 90), 255, 9), (0, 0), 3)
        frame = Frame(mask=np.maximum(mask, 5), **fields)
        pipeline = Pipeline()
        pipeline.process(frame)
        assert np.array_equal(frame.is_cable, pipeline.mask != 0)

    def test_without_a_mask_nothing_says_what_is_cable(self):
        assert Frame(IMAGE).is_cable is None

    def test_what_a_mask_is_may_be_said(self):
        grey = np.array([[0, 7, 255]], np.uint8)
        assert Frame(mask=grey, mask_is="probability").mask.tolist() == [[0, 7, 255]]
        assert Frame(mask=257 * grey.astype(np.uint16), mask_is="probability").mask.tolist() == [[0, 7, 255]]
        assert Frame(mask=grey > 0, mask_is="probability").mask.tolist() == [[0, 255, 255]]
        binary = Frame(mask=np.array([[0.0, 0.01]]), mask_is="binary")
        assert (binary.mask_is, binary.mask.tolist()) == ("binary", [[False, True]])

    @pytest.mark.parametrize("dtype", [np.uint16, np.int32, np.float16, np.float32, np.float64])
    def test_depth_may_be_integer_or_floating_point(self, dtype):
        assert Frame(mask=MASK, depth=DEPTH.astype(dtype)).depth.dtype == dtype

    def test_numbers_and_text_of_numpy_become_plain_ones(self):
        frame = Frame(mask=MASK, index=np.uint16(3), stamp=np.float32(0.5), name=np.str_("a"))
        assert [type(value) for value in (frame.index, frame.stamp, frame.name)] == [int, float, str]
        assert type(Frame(mask=MASK, stamp=np.int64(2)).stamp) is float

    def test_a_camera_is_made_of_its_numbers(self):
        assert Frame(mask=MASK, camera=(1, 2, 0, 0.5)).camera == PinholeCamera(1, 2, 0, 0.5)
        assert Frame(mask=MASK, camera=PinholeCamera(1, 2, 0, 0.5).matrix).camera == PinholeCamera(1, 2, 0, 0.5)

    def test_axes_of_one_in_front_are_dropped(self):
        frame = Frame(image=IMAGE[None], mask=MASK[None], depth=DEPTH[None, None], occluders=MASK[None, :, :, None])
        assert frame.image.shape == (4, 6, 3)
        assert frame.mask.shape == frame.depth.shape == frame.occluders.shape == (4, 6)

    def test_a_last_axis_of_one_is_dropped(self):
        frame = Frame(mask=MASK[:, :, None], depth=DEPTH[:, :, None])
        assert frame.mask.shape == frame.depth.shape == (4, 6)

    def test_the_arrays_are_views_that_cannot_be_written_through(self):
        given = {
            "image": IMAGE.copy(),
            "mask": MASK[:, :, None].copy(),
            "depth": DEPTH.copy(),
            "occluders": MASK.copy(),
        }
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


class TestInstances:
    LABELS = np.zeros((4, 6), np.int32)
    LABELS[1], LABELS[2, 2:] = 7, 300

    def test_without_a_mask_they_are_one(self):
        for frame in (Frame(instances=self.LABELS), Frame(image=IMAGE, instances=self.LABELS)):
            assert frame.size == (4, 6)
            assert frame.instances.dtype == np.uint16
            np.testing.assert_array_equal(frame.instances, self.LABELS)
            np.testing.assert_array_equal(frame.mask, self.LABELS != 0)
            assert not frame.instances.flags.writeable
            assert "mask" in repr(frame)
            assert "instances" in repr(frame)

    def test_beside_a_mask_the_mask_wins(self):
        frame = Frame(mask=MASK, instances=self.LABELS)
        assert not frame.mask.any()
        np.testing.assert_array_equal(frame.instances, self.LABELS)

    def test_other_forms_are_numbered(self):
        masks = [self.LABELS == 300, self.LABELS == 7]
        expected = np.select(masks, [1, 2])
        for given in (masks, np.stack(masks), [{"segmentation": mask} for mask in masks]):
            np.testing.assert_array_equal(Frame(instances=given).instances, expected)
        assert not Frame(image=IMAGE, instances=[]).mask.any()

    def test_a_frame_that_is_replaced_keeps_them(self):
        frame = replace(Frame(image=IMAGE, instances=self.LABELS), index=3, depth=DEPTH)
        np.testing.assert_array_equal(frame.instances, self.LABELS)
        np.testing.assert_array_equal(frame.mask, self.LABELS != 0)
        assert np.shares_memory(replace(frame, index=4).instances, frame.instances)
