"""Pixels of image messages, of every encoding, from whatever class and however the rows lie."""

from __future__ import annotations

from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ros import bag_examples as bags

from dloftbs.errors import InputError
from dloftbs.ros import pixels_of
from dloftbs.ros.image_messages import ENCODINGS, is_from_lossy_codec

PLAIN = {"bgr8": 3, "8UC3": 3, "mono8": 1, "8UC1": 1}
SWAPPED = {"rgb8": (2, 1, 0), "rgba8": (2, 1, 0), "bgra8": (0, 1, 2), "8UC4": (0, 1, 2)}
WIDE = {"mono16": "u2", "16UC1": "u2", "16SC1": "i2", "32SC1": "i4", "32FC1": "f4", "64FC1": "f8"}
BAYER = {"bayer_rggb8": "RGGB", "bayer_bggr8": "BGGR", "bayer_gbrg8": "GBRG", "bayer_grbg8": "GRBG"}
WIDE_COLOUR = {"bgr16": (0, 1, 2), "rgb16": (2, 1, 0), "bgra16": (0, 1, 2), "rgba16": (2, 1, 0), "16UC3": (0, 1, 2)}
WIDE_COLOUR["16UC4"] = (0, 1, 2)
WIDE_BAYER = {f"{name.removesuffix('8')}16": pattern for name, pattern in BAYER.items()}
YUV = ("uyvy", "yuv422", "yuyv", "yuv422_yuy2")
PLANAR = ("nv12", "nv21", "nv24")
RED = (81, 90, 240)
"""Y, U, V by BT.601."""
SIZES = st.tuples(st.integers(1, 9), st.integers(1, 9))
PADDING = st.integers(0, 5)


def random(shape, dtype="u1", seed=0):
    return np.random.default_rng(seed).integers(0, 256, (*shape, np.dtype(dtype).itemsize), "u1").view(dtype)[..., 0]


def test_every_encoding_is_tried():
    tried = {*PLAIN, *SWAPPED, *WIDE, *BAYER, *YUV, *WIDE_COLOUR, *WIDE_BAYER, *PLANAR}
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


@given(st.sampled_from(sorted(WIDE_COLOUR)), SIZES, PADDING, st.booleans(), st.integers(0, 9))
def test_colour_of_16_bits_is_its_upper_8(encoding, size, padding, big, seed):
    pixels = random((*size, 4 if encoding in ("bgra16", "rgba16", "16UC4") else 3), "u2", seed)
    found = pixels_of(bags.raw_image(pixels, encoding, padding=padding, big=big))
    assert found.dtype == np.uint8
    np.testing.assert_array_equal(found, pixels[..., WIDE_COLOUR[encoding]] >> 8)


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("encoding", [*BAYER, *WIDE_BAYER])
def test_a_pattern_of_one_colour_is_that_colour(encoding, big):
    colour = {"B": 200, "G": 90, "R": 20}
    mosaic = np.zeros((8, 10), np.uint16)
    for i, name in enumerate({**BAYER, **WIDE_BAYER}[encoding]):
        mosaic[i // 2 :: 2, i % 2 :: 2] = colour[name]
    mosaic = mosaic.astype(np.uint8) if encoding in BAYER else 256 * mosaic + 99
    found = pixels_of(bags.raw_image(mosaic, encoding, padding=3, big=big))
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


def planar(encoding, luma, chroma, padding=0, **fields):
    """Return an image of a plane of luma (H, W) and one of chroma (h, w, 2), padded to one step."""
    height, width = luma.shape
    step = width + padding
    if encoding == "nv21":
        chroma = chroma[..., ::-1]
    share = 2 if encoding == "nv24" else 1  # rows of chroma are twice as long
    planes = (
        np.pad(luma, ((0, 0), (0, padding)), constant_values=7),
        np.pad(chroma.reshape(len(chroma), -1), ((0, 0), (0, share * padding)), constant_values=7),
    )
    data = b"".join(plane.tobytes() for plane in planes)
    fields = {"height": height, "width": width, "encoding": encoding, "is_bigendian": 0, "step": step, **fields}
    return SimpleNamespace(**fields, data=data)


@pytest.mark.parametrize("padding", [0, 5])
@pytest.mark.parametrize("encoding", PLANAR)
def test_planes_of_luma_and_chroma(encoding, padding):
    """The left half is red, the right half grey, and a line of luma is dark."""
    luma = np.full((8, 12), RED[0], np.uint8)
    luma[:, 6:] = 126
    luma[2] = 16
    chroma = np.full((8, 12, 2) if encoding == "nv24" else (4, 6, 2), 128, np.uint8)
    chroma[:, : chroma.shape[1] // 2] = RED[1:]
    found = pixels_of(planar(encoding, luma, chroma, padding)).astype(int)
    assert found.shape == (8, 12, 3)
    assert np.abs(found[3:, :6] - (0, 0, 254)).max() <= 2
    assert np.abs(found[3:, 6:] - 128).max() <= 2
    assert np.abs(found[2, 6:]).max() <= 2


@pytest.mark.parametrize(("encoding", "step"), [("nv12", 18), ("nv21", 24), ("nv24", 36), ("nv24", 24)])
def test_a_step_that_counts_the_chroma_too(encoding, step):
    luma, chroma = np.full((8, 12), 126, np.uint8), np.full((8, 12, 2), 128, np.uint8)
    message = planar(encoding, luma, chroma if encoding == "nv24" else chroma[::2, ::2], step=step)
    assert np.abs(pixels_of(message).astype(int) - 128).max() <= 2


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
        ({"encoding": "nv12", "width": 3, "step": 12}, "come in pairs, got a width of 3"),
        ({"encoding": "nv21"}, "rows of nv21 come in pairs, got a height of 3"),
        ({"encoding": "nv12", "height": 4}, "a step of at least 4 bytes and step x 6 of data, got step 12 and 36"),
        ({"encoding": "nv24", "height": 2}, "a step of at least 4 bytes and step x 6 of data, got step 12 and 36"),
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


@pytest.mark.parametrize("packed", ["", "bayer_rggb8", "BAYER_RGGB8 "])
@pytest.mark.parametrize(("encoding", "dtype"), [("bayer_rggb8", "u1"), ("bayer_rggb16", "u2")])
def test_a_mosaic_that_was_packed_as_it_is_becomes_bgr(encoding, dtype, packed):
    mosaic = random((8, 10), dtype)
    found = pixels_of(bags.compressed(bags.encoded(mosaic, ".png"), f"{encoding}; png compressed {packed}"))
    np.testing.assert_array_equal(found, pixels_of(bags.raw_image(mosaic, encoding)))


@pytest.mark.parametrize("form", ["bayer_rggb8; png compressed mono8", "mono8; png compressed ", "bayer; png", "png"])
def test_grey_of_a_transport_stays_grey(form):
    grey = random((8, 10))
    np.testing.assert_array_equal(pixels_of(bags.compressed(bags.encoded(grey, ".png"), form)), grey)


def test_a_png_of_16_bits_and_one_of_grey():
    for pixels in (random((7, 9), "u2"), random((7, 9))):
        found = pixels_of(bags.compressed(bags.encoded(pixels, ".png"), "16UC1; png compressed "))
        assert found.tobytes() == pixels.tobytes()


@pytest.mark.parametrize(("form", "order"), [("bgr16; png compressed bgr16", 1), ("rgb16; png compressed rgb16", -1)])
def test_a_png_of_colour_of_16_bits_is_its_upper_8(form, order):
    pixels = random((7, 9, 3), "u2")
    found = pixels_of(bags.compressed(bags.encoded(pixels[..., ::order], ".png"), form))
    np.testing.assert_array_equal(found, pixels >> 8)


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
