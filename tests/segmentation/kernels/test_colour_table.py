"""The colour table against every colour there is, and against OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs import ConfigError, HsvRange
from dloftbs.config import SegmentationConfig
from dloftbs.segmentation import HsvSegmenter

RANGES = {
    "wrapping": (HsvRange(hue=(170, 10), saturation=(80, 255), value=(60, 255)),),
    "two": (HsvRange.parse("20:40,0:255,0:255"), HsvRange(hue=(90, 130), saturation=(10, 200), value=(5, 90))),
    "everything": (HsvRange.parse("0:179,0:255,0:255"),),
    "one hue": (HsvRange.parse("60:60,1:255,0:255"),),
}


def with_opencv(image: np.ndarray, ranges: tuple[HsvRange, ...]) -> np.ndarray:
    """Convert, and take each range, a wrapping one as two."""
    hue, saturation, value = np.moveaxis(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), 2, 0)
    mask = np.zeros(image.shape[:2], dtype=bool)
    for box in ranges:
        low, high = box.hue
        in_hue = (hue >= low) & (hue <= high) if low <= high else (hue >= low) | (hue <= high)
        in_saturation = (saturation >= box.saturation[0]) & (saturation <= box.saturation[1])
        mask |= in_hue & in_saturation & (value >= box.value[0]) & (value <= box.value[1])
    return mask.astype(np.uint8)


@pytest.mark.parametrize("ranges", RANGES.values(), ids=RANGES.keys())
def test_every_eighth_colour_agrees_with_opencv(ranges: tuple[HsvRange, ...]) -> None:
    colours = np.arange(0, 2**24, 8, dtype=np.int64) + np.arange(2**21) % 8
    image = np.stack((colours & 255, colours >> 8 & 255, colours >> 16), axis=1).astype(np.uint8)
    image = image.reshape(1024, 2048, 3)
    np.testing.assert_array_equal(HsvSegmenter(SegmentationConfig(hsv=ranges))(image), with_opencv(image, ranges))


SEGMENTER = HsvSegmenter(SegmentationConfig(hsv=RANGES["wrapping"]))


@given(st.integers(0, 2**31))
def test_images_of_any_layout_agree_with_opencv(seed: int) -> None:
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 256, (*rng.integers(1, 60, 2), 3)).astype(np.uint8)
    for view in (image, image[::-1, ::2], image[:, :, ::-1]):
        expected = with_opencv(np.ascontiguousarray(view), RANGES["wrapping"])
        np.testing.assert_array_equal(SEGMENTER(view), expected)


def test_red_on_both_sides_of_zero() -> None:
    reds = cv2.cvtColor(np.array([[[175, 255, 200], [5, 255, 200], [90, 255, 200]]], np.uint8), cv2.COLOR_HSV2BGR)
    assert SEGMENTER(reds).tolist() == [[1, 1, 0]]


def test_no_range_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"segmentation\.hsv is empty"):
        HsvSegmenter(SegmentationConfig())
