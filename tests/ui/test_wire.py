import json

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from ui.page_client import mask_of, split_picture

from dloftbs.ui.wire import LONGEST_SIDE_PX, encode_jpeg, encode_picture, encode_runs, encode_text


@given(arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.integers(0, 2)))
def test_runs_tell_the_mask(mask):
    assert np.array_equal(mask_of({"mask": encode_runs(mask)}, mask.shape), mask > 0)


@pytest.mark.parametrize(("value", "runs"), [(0, [6]), (1, [0, 6])])
def test_the_first_run_is_ground(value, runs):
    assert np.frombuffer(encode_runs(np.full((2, 3), value, bool)), "<u4").tolist() == runs


def test_a_picture_comes_apart_again():
    data = encode_picture({"number": 3, "name": "\N{GREEK SMALL LETTER MU}"}, {"image": b"abc", "mask": b""})
    header, parts = split_picture(data)
    assert (header["number"], header["name"], parts) == (3, "\N{GREEK SMALL LETTER MU}", {"image": b"abc", "mask": b""})


def test_a_text_may_have_a_field_named_kind():
    assert encode_text("error", kind="InputError") == '{"type":"error","kind":"InputError"}'


def test_a_name_that_is_no_utf8_is_sent_as_readable_text():
    name = "kabel_\udce4.mp4"
    sent = json.loads(encode_text("state", name=name, warnings=[f"{name}: the mask is empty"], length=None))
    assert sent == {
        "type": "state",
        "name": r"kabel_\xe4.mp4",
        "warnings": [r"kabel_\xe4.mp4: the mask is empty"],
        "length": None,
    }
    header, _ = split_picture(encode_picture({"name": name, "curves": [{"points": [1.0, 2.0]}]}, {}))
    assert header == {"name": r"kabel_\xe4.mp4", "curves": [{"points": [1.0, 2.0]}], "parts": []}


@pytest.mark.parametrize(("size", "sent"), [((90, 160), (90, 160)), ((200, 3840), (100, LONGEST_SIDE_PX))])
def test_large_images_are_reduced(size, sent):
    data = encode_jpeg(np.full((*size, 3), 90, np.uint8))
    assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).shape[:2] == sent
