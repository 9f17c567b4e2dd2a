"""Pixels of image messages, of every encoding, from whatever class and however the rows lie."""

from __future__ import annotations

from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ros import bag_examples as bags

from dloftbs.errors import InputError
from dloftbs.ros import pixels_of
from dloftbs.ros.image_messages import ENCODINGS, is_from_lossy_codec

PLAIN = {"bgr8": 3, "8UC3": 3, "mono8": 1, "8UC1": 1}
SWAPPED = {"rgb8": (2, 1, 0), "rgba8": (2, 1, 0), "bgra8": (0, 1, 2), "8UC4": (0, 1, 2)}
WIDE = {"mono16": "u2", "16UC1": "u2", "16SC1": "i2", "32SC1": "i4", "32FC1": "f4", "64FC1": "f8"}
BAYER = {"bayer_rggb8": "RGGB", "bayer_bggr8": "BGGR", "bayer_gbrg8": "GBRG", "bayer_grbg8": "GRBG"}
YUV = ("uyvy", "yuv422", "yuyv", "yuv422_yuy2")
SIZES = st.tuples(st.integers(1, 9), st.integers(1, 9))
PADDING = st.integers(0, 5)


def random(shape, dtype="u1", seed=0):
    return np.random.default_rng(seed).integers(0, 256, (*shape, np.dtype(dtype).itemsize), "u1").view(dtype)[..., 0]


def test_every_encoding_is_tried():
    tried = {*PLAIN, *SWAPPED, *WIDE, *BAYER, *YUV}
    assert {name.lower() for name in tried} == set(ENCODINGS)


@given(st.sampled_from(sorted(PLAIN)), SIZES, PADDING, st.booleans())
def test_plain_pixels_come_back_bit_for_bit(encoding, size, padding, rclpy):
    pixels = random((*size, 3) if PLAIN[encoding] == 3 else size)
    message = bags.raw_image(pixels, encoding, padding=padding)
    found = pixels_of(bags.like_rclpy(message) if rclpy else message)
    assert found.flags.c_contiguous
    np.testing.assert_array_equal(found, pixels)


@given(st.sampled_from(sorted(SWAPPED)), SIZES, PADDING)
def test_other_orders_of_channels_become_bgr(encoding, size, padding):
    pixels = random((*size, 4 if encoding in ("rgba8", "bgra8", "8UC4") else 3))
    found = pixels_of(bags.raw_image(pixels, encoding, padding=padding))
    np.testing.assert_array_equal(found, pixels[..., SWAPPED[encoding]])


@given(st.sampled_from(sorted(WIDE)), SIZES, PADDING, st.booleans(), st.integers(0, 9))
def test_wide_pixels_come_back_bit_for_bit_in_either_byte_order(encoding, size, padding, big, seed):
    pixels = random(size, WIDE[encoding], seed)
    found = pixels_of(bags.raw_image(pixels, encoding, padding=padding, big=big))
    assert found.dtype == np.dtype(WIDE[encoding])
    assert found.tobytes() == pixels.tobytes()  # NaN among them


@pytest.mark.parametrize("encoding", BAYER)
def test_a_pattern_of_one_colour_is_that_colour(encoding):
    colour = {"B": 200, "G": 90, "R": 20}
    mosaic = np.zeros((8, 10), np.uint8)
    for i, name in enumerate(BAYER[encoding]):
        mosaic[i // 2 :: 2, i % 2 :: 2] = colour[name]
    found = pixels_of(bags.raw_image(mosaic, encoding, padding=3))
    assert found.shape == (8, 10, 3)
    np.testing.assert_array_equal(found[2:-2, 2:-2].reshape(-1, 3), [list(colour.values())] * 24)


@pytest.mark.parametrize("encoding", YUV)
def test_yuv_of_grey_and_of_colour(encoding):
    """BT.601: Y 81, U 90, V 240 is red."""
    for (y, u, v), bgr in (((126, 128, 128), (128, 128, 128)), ((81, 90, 240), (0, 0, 254))):
        pair = (u, y, v, y) if encoding in ("uyvy", "yuv422") else (y, u, y, v)
        rows = np.tile(np.array(pair, np.uint8), (4, 3)).reshape(4, 6, 2)
        found = pixels_of(bags.raw_image(rows, encoding, padding=2))
        assert found.shape == (4, 6, 3)
        assert np.abs(found.astype(int) - bgr).max() <= 2


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"height": 0}, "must have pixels, got 4 x 0"),
        ({"width": 0}, "must have pixels, got 0 x 3"),
        ({"step": 11}, "a step of at least 12 bytes"),
        ({"step": 13}, "got step 13 and 36 bytes"),
        ({"height": 4}, "got step 12 and 36 bytes"),
        ({"height": 2**31, "width": 2**31}, "must have at most"),
        ({"encoding": "bgr10"}, "unknown encoding 'bgr10' of an image; known are bgr8"),
        ({"encoding": "yuyv", "width": 3, "step": 12}, "come in pairs, got a width of 3"),
        ({"encoding": "bayer_rggb8", "width": 2}, "at least 3 x 3 pixels"),
        ({"encoding": 5}, "encoding of a message must be text, got 5"),
        ({"width": -1}, "width of a message must be an integer of at least 0, got -1"),
        ({"width": 1.5}, "width of a message must be an integer"),
        ({"data": "text"}, "data of a message must be bytes, got 'text'"),
        ({"data": b""}, "and 0 bytes"),
    ],
)
def test_fields_that_disagree_are_said_to(changes, said):
    fields = {"height": 3, "width": 4, "encoding": "bgr8", "is_bigendian": 0, "step": 12, "data": bytes(36)}
    with pytest.raises(InputError, match=said):
        pixels_of(SimpleNamespace(**{**fields, **changes}))


def test_no_message_at_all():
    with pytest.raises(InputError, match="expected a message with the field encoding"):
        pixels_of(object())


@settings(max_examples=300)
@given(
    st.integers(0, 40),
    st.integers(0, 40),
    st.integers(0, 200),
    st.sampled_from([*ENCODINGS, "", "bgr", "BGR8"]),
    st.integers(0, 3),
    st.integers(0, 4000),
)
def test_whatever_fields_say_pixels_come_or_a_typed_error(height, width, step, encoding, big, size):
    message = SimpleNamespace(
        height=height, width=width, step=step, encoding=encoding, is_bigendian=big, data=bytes(size)
    )
    try:
        pixels = pixels_of(message)
    except InputError:
        return
    assert pixels.shape[:2] == (height, width)


@pytest.mark.parametrize("form", ["png", "bgr8; png compressed bgr8", "rgb8; png compressed bgr8"])
def test_a_png_comes_back_bit_for_bit(form):
    pixels = random((7, 9, 3))
    np.testing.assert_array_equal(pixels_of(bags.compressed(bags.encoded(pixels, ".png"), form)), pixels)


def test_a_png_of_channels_in_the_other_order():
    pixels = random((7, 9, 3))
    message = bags.compressed(bags.encoded(pixels[..., ::-1], ".png"), "rgb8; png compressed rgb8")
    np.testing.assert_array_equal(pixels_of(message), pixels)


def test_a_png_of_16_bits_and_one_of_grey():
    for pixels in (random((7, 9), "u2"), random((7, 9))):
        found = pixels_of(bags.compressed(bags.encoded(pixels, ".png"), "16UC1; png compressed "))
        assert found.tobytes() == pixels.tobytes()


def test_a_jpeg_is_what_opencv_makes_of_it():
    data = bags.encoded(bags.photo_of(0), ".jpg")
    found = pixels_of(bags.like_rclpy(bags.compressed(data, "bgr8; jpeg compressed bgr8")))
    np.testing.assert_array_equal(found, cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR))


def test_only_codecs_that_ring_are_lossy():
    assert is_from_lossy_codec(bags.compressed(bags.encoded(bags.photo_of(0), ".jpg"), "jpeg"))
    assert not is_from_lossy_codec(bags.compressed(bags.encoded(bags.photo_of(0), ".png"), "png"))
    assert not is_from_lossy_codec(bags.raw_image(bags.photo_of(0), "bgr8"))


@pytest.mark.parametrize("suffix", [".jpg", ".png"])
def test_compressed_pixels_that_are_cut_off_are_a_typed_error(suffix):
    data = bags.encoded(bags.photo_of(0), suffix)
    for size in (0, 1, 10, 30, len(data) // 2):
        with pytest.raises(InputError, match="a compressed image"):
            pixels_of(bags.compressed(data[:size], suffix[1:]))
