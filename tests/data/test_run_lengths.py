"""Run lengths of COCO: both ways, against examples that were worked out by hand, and against its own tool."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as from_numpy

from dloftbs.data.run_lengths import decode, encode
from dloftbs.errors import InputError

SIZES = from_numpy.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=70)
MASKS = from_numpy.arrays(bool, SIZES)


@st.composite
def with_long_runs(draw):
    """A mask whose runs are up to thousands of pixels long."""
    ends = sorted(draw(st.lists(st.integers(0, 120 * 90), max_size=12)))
    flat = np.zeros(120 * 90, dtype=bool)
    for end in ends:
        flat[end:] ^= True
    return flat.reshape(90, 120).T


def counts_of(flat):
    """The uncompressed counts, pixel by pixel."""
    counts, value = [0], False
    for pixel in flat:
        if pixel != value:
            counts.append(0)
            value = pixel
        counts[-1] += 1
    return counts


@given(MASKS | with_long_runs())
def test_decoding_returns_what_was_encoded(mask):
    rle = encode(mask)

    assert rle["size"] == list(mask.shape)
    assert (decode(rle) == mask).all()
    assert (decode({**rle, "counts": rle["counts"].encode()}) == mask).all()
    assert (decode({**rle, "counts": counts_of(mask.T.ravel())}) == mask).all()


@given(MASKS | with_long_runs())
def test_equals_its_own_tool(mask):
    tool = pytest.importorskip("pycocotools.mask")
    theirs = tool.encode(np.asfortranarray(mask, dtype=np.uint8))

    assert encode(mask)["counts"] == theirs["counts"].decode()
    assert (decode(theirs) == mask).all()


@pytest.mark.parametrize(
    ("rows", "counts", "text"),
    [
        ([[0, 0], [0, 0]], [4], "4"),
        ([[1, 1], [1, 1]], [0, 4], "04"),
        ([[0, 1], [1, 1]], [1, 3], "13"),
        ([[0, 0, 1], [0, 0, 1]], [4, 2], "42"),
        ([[0, 1, 0, 1, 1, 1]], [1, 1, 1, 3], "1112"),  # 3 - 1: the fourth is a difference
        ([[0, 1, 1, 1, 0, 1, 0]], [1, 3, 1, 1, 1], "131N0"),  # 1 - 3: -2 is 11110, 30 + 48
        ([[0] * 15 + [1]], [15, 1], "?1"),  # 01111 needs no sign
        ([[0] * 16 + [1]], [16, 1], "`01"),  # 10000 would be -16, so 00000 follows
        ([[0] * 100 + [1]], [100, 1], "T31"),  # 00011 00100
    ],
)
def test_small_examples(rows, counts, text):
    mask = np.array(rows, dtype=bool)

    assert encode(mask) == {"size": list(mask.shape), "counts": text}
    for given_counts in (text, text.encode(), counts, tuple(counts), np.array(counts)):
        decoded = decode({"size": mask.shape, "counts": given_counts})
        assert decoded.dtype == bool
        assert decoded.flags.c_contiguous
        assert (decoded == mask).all()


@pytest.mark.parametrize("kind", [np.uint8, np.int32, np.uint16])
def test_any_non_zero_is_cable(kind):
    assert encode(np.array([[0, 7, 1]], dtype=kind)) == encode(np.array([[False, True, True]]))


def test_a_frame_may_be_empty():
    rle = encode(np.zeros((0, 5), dtype=bool))

    assert rle == {"size": [0, 5], "counts": "0"}
    assert decode(rle).shape == (0, 5)
    assert decode({"size": [0, 5], "counts": []}).shape == (0, 5)
    assert decode({"size": [0, 5], "counts": ""}).shape == (0, 5)


def test_counts_may_be_zero_between_others():
    assert decode({"size": [1, 4], "counts": [1, 0, 1, 2]}).tolist() == [[False, False, True, True]]


@pytest.mark.parametrize(
    ("rle", "message"),
    [
        ([3], "must be a dictionary with the keys 'size' and 'counts', got \\[3\\]"),
        ({"size": [1, 3]}, "must be a dictionary with the keys 'size' and 'counts', got"),
        ({"size": [3], "counts": "3"}, "size must be two integers"),
        ({"size": [1, 3], "counts": "4"}, "must add up to 1 \\* 3 = 3 pixels, got a count of 4"),
        ({"size": [1, 3], "counts": "11"}, "must add up to 1 \\* 3 = 3 pixels, got 2"),
        ({"size": [1, 3], "counts": [2, 2]}, "must add up to 1 \\* 3 = 3 pixels, got 4"),
        ({"size": [1, 3], "counts": "O4"}, "got a count of -1"),
        ({"size": [1, 3], "counts": [4, -1]}, "got a count of 4"),
        ({"size": [1, 3], "counts": [2**63 + 3]}, "got a count of -9223372036854775805"),
        ({"size": [1, 3], "counts": "3 "}, "of the characters '0' to 'o', got b' ' at 1"),
        ({"size": [1, 3], "counts": "3é"}, "got b'\\\\xc3' at 1"),
        ({"size": [1, 3], "counts": "p"}, "got b'p' at 0"),
        ({"size": [1, 3], "counts": "3P"}, "the last one is cut off"),
        ({"size": [1, 3], "counts": "P" * 12 + "0"}, "at most 12 characters, got 13"),
        ({"size": [1, 3], "counts": [1.0, 2.0]}, "must be text, bytes or a list of integers, got"),
        ({"size": [1, 3], "counts": [True, 2.5]}, "must be text, bytes or a list of integers, got"),
        ({"size": [1, 3], "counts": [[3]]}, "must be text, bytes or a list of integers, got"),
        ({"size": [1, 3], "counts": [[3], 1]}, "counts must be an array of numbers, got"),
        ({"size": [1, 3], "counts": [2**70]}, "must be text, bytes or a list of integers, got"),
        ({"size": [1, 3], "counts": None}, "counts must be an array of numbers, got None"),
    ],
)
def test_errors_say_what_is_wrong(rle, message):
    with pytest.raises(InputError, match=message):
        decode(rle)


def test_sums_do_not_wrap_around():
    size = [1_000_000, 1_000_000]
    counts = np.full(18_446_745, 10**12)  # more than 2 ** 64 pixels
    with pytest.raises(InputError, match="must add up to"):
        decode({"size": size, "counts": counts})


@given(st.text(alphabet=[chr(code) for code in range(48, 112)], max_size=40))
def test_any_text_is_decoded_or_refused(text):
    try:
        mask = decode({"size": [5, 8], "counts": text})
    except InputError:
        return
    assert (decode(encode(mask)) == mask).all()


def test_masks_are_checked():
    with pytest.raises(InputError, match="mask must have shape"):
        encode(np.zeros((2, 2, 2), dtype=bool))
    with pytest.raises(InputError, match="threshold it first"):
        encode(np.zeros((2, 2)))
