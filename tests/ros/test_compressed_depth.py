"""Packed depth: PNG, inverse depth and RVL, against an encoder that goes pixel by pixel."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ros import bag_examples as bags

from dloftbs.errors import InputError
from dloftbs.ros import pixels_of
from dloftbs.ros.compressed_depth import decode_rvl

DEPTHS = st.lists(st.integers(0, 65535) | st.sampled_from([0, 0, 500, 501, 65535]), max_size=60)


def encode_rvl(depth: list[int]) -> bytes:
    """Encode as in the paper: run of zeros, run of others, their differences in zigzag, three bits a nibble."""
    nibbles: list[int] = []

    def put(value: int) -> None:
        while True:
            value, low = value >> 3, value & 7
            nibbles.append(low | 8 * (value > 0))
            if not value:
                return

    at = previous = 0
    while at < len(depth):
        zeros = at
        while at < len(depth) and depth[at] == 0:
            at += 1
        put(at - zeros)
        end = at
        while end < len(depth) and depth[end] != 0:
            end += 1
        put(end - at)
        for value in depth[at:end]:
            difference = value - previous
            put(2 * difference if difference >= 0 else -2 * difference - 1)
            previous = value
        at = end
    nibbles += [0] * (-len(nibbles) % 8)
    words = [
        sum(nibble << 28 - 4 * i for i, nibble in enumerate(nibbles[k : k + 8])) for k in range(0, len(nibbles), 8)
    ]
    return struct.pack(f"<{len(words)}I", *words)


def message_of(packed: bytes, form: str, a=0.0, b=0.0):
    return bags.compressed(struct.pack("<iff", 0, a, b) + packed, form)


@given(DEPTHS)
def test_rvl_comes_back_bit_for_bit(depth):
    np.testing.assert_array_equal(decode_rvl(encode_rvl(depth), len(depth)), depth)


def test_rvl_of_a_whole_image():
    depth = np.full((48, 64), 800, np.uint16)
    depth[10:20] = np.random.default_rng(1).integers(0, 4000, (10, 64))
    depth[30:35, 5:50] = 0
    packed = struct.pack("<II", 64, 48) + encode_rvl(depth.ravel().tolist())
    np.testing.assert_array_equal(pixels_of(message_of(packed, "16UC1; compressedDepth rvl")), depth)


@given(st.binary(max_size=60), st.integers(0, 50))
def test_whatever_the_bytes_rvl_gives_depth_or_a_typed_error(data, count):
    try:
        depth = decode_rvl(data, count)
    except InputError:
        return
    assert depth.shape == (count,)


@pytest.mark.parametrize("form", ["16UC1; compressedDepth png", "16UC1; compressedDepth"])
def test_a_png_of_counts_comes_back_bit_for_bit(form):
    depth = np.random.default_rng(2).integers(0, 65536, (12, 10)).astype(np.uint16)
    np.testing.assert_array_equal(pixels_of(message_of(bags.encoded(depth, ".png"), form)), depth)


def test_inverse_depth_is_metres_and_nan_where_it_is_missing():
    metres = np.array([[0.5, 1.0, 2.5], [4.0, 9.0, np.nan]])
    a, b = 100.0 * 101.0, 1.0 - 100.0 * 101.0 / 10.0  # as the transport has them for 10 m and a quantization of 100
    counts = np.where(np.isnan(metres), 0, a / metres + b).round().astype(np.uint16)
    found = pixels_of(message_of(bags.encoded(counts, ".png"), "32FC1; compressedDepth png", a, b))
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, metres, rtol=0.01)


@pytest.mark.parametrize(
    ("packed", "form", "said"),
    [
        (b"", "16UC1; compressedDepth", "a header of 12 bytes, got 12 bytes"),
        (b"\x89PNG\r\n\x1a\n", "16UC1; compressedDepth", "compressed depth"),
        (b"rubbish", "16UC1; compressedDepth png", "must hold a PNG, or say that it is RVL"),
        (b"1234567", "16UC1; compressedDepth rvl", "its size in 8 bytes, got 7"),
        (struct.pack("<II", 0, 5), "16UC1; compressedDepth rvl", "must have pixels, got 0 x 5"),
        (struct.pack("<II", 2**31, 2**31), "16UC1; compressedDepth rvl", "must have at most"),
        (struct.pack("<II", 4, 5), "16UC1; compressedDepth rvl", "ends after 0 of 20 pixels"),
        (bags.encoded(np.zeros((4, 4), np.uint8), ".png"), "16UC1; compressedDepth png", "of 16 bits"),
    ],
)
def test_depth_that_is_cut_off_or_none_is_a_typed_error(packed, form, said):
    with pytest.raises(InputError, match=said):
        pixels_of(message_of(packed, form))
