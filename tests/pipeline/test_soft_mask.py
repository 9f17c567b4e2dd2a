"""Masks of grey values: probabilities, labels, photographs."""

from __future__ import annotations

import logging
from pathlib import Path

import cv2
import numpy as np
import pytest

from dloftbs import Frame, detect, track
from dloftbs.pipeline.soft_mask import above_half, is_probability

SIZE = (360, 640)


def drawn(width: int = 12) -> np.ndarray:
    mask = np.zeros(SIZE, np.uint8)
    cv2.polylines(mask, [np.array([(40, 60), (300, 150), (600, 120)])], False, 255, width, cv2.LINE_AA)
    return mask


def soft(sigma: float = 4.0) -> np.ndarray:
    """Return what a network gives: blurred edges, and a faint ghost beside the cable."""
    mask = drawn()
    mask[250:330, 100:500] = np.maximum(mask[250:330, 100:500], np.linspace(0, 90, 400).astype(np.uint8))
    return cv2.GaussianBlur(mask, None, sigma)


class TestIsProbability:
    def test_what_a_network_gives_is_one(self) -> None:
        assert is_probability(soft())
        assert is_probability(soft()[:, ::-1].T)
        assert is_probability(cv2.resize(soft(), None, fx=0.3, fy=0.3, interpolation=cv2.INTER_AREA))

    @pytest.mark.parametrize("kind", [np.uint8, np.bool_, np.int32, np.uint16])
    def test_two_values_are_none_whatever_they_are(self, kind: type) -> None:
        for value in (1, 7, 255):
            assert not is_probability((value * (drawn() > 127)).astype(kind))

    def test_labels_are_none_also_with_a_border_of_255(self) -> None:
        labels = np.zeros(SIZE, np.uint8)
        for number in range(30):
            labels[10 * number : 10 * number + 8] = number + 1
        labels[:4] = 255
        assert not is_probability(labels)

    def test_a_photograph_is_none(self, shared_data: Path) -> None:
        paths = sorted((shared_data / "networks" / "ewd").glob("*.jpg"))
        assert paths
        for path in paths:
            grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
            assert grey is not None
            assert not is_probability(grey)

    def test_the_masks_of_networks_are(self, shared_data: Path) -> None:
        networks = shared_data / "networks"
        paths = [path for kind in ("r101", "r50") for path in sorted(networks.glob(f"*/*.{kind}.png"))]
        assert len(paths) > 60
        for path in paths:
            grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
            assert grey is not None
            assert is_probability(grey)
            np.testing.assert_array_equal(above_half(grey), grey > 127)


def test_a_soft_mask_is_read_where_it_is_more_probable_than_not(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        found = detect(soft())
    assert [record.message for record in caplog.records if "probability" in record.message]
    assert [one.curve.control_points.tolist() for one in found] == [
        one.curve.control_points.tolist() for one in detect(soft() > 127)
    ]
    assert len(found) == 1
    assert len(detect(soft() > 0)) != 1 or detect(soft() > 0)[0].width_px > 1.5 * found[0].width_px


def test_a_stream_says_it_once(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        results = list(track(Frame(mask=soft(), index=index) for index in range(4)))
    assert [len(result.tracks) for result in results] == [1] * 4
    assert sum("probability" in record.message for record in caplog.records) == 1


def test_a_probability_below_one_half_everywhere_is_a_reason() -> None:
    result = detect((0.45 * soft()).astype(np.uint8))
    assert len(result) == 0
    assert result.reason == "the mask is a probability that nowhere is one half or more: threshold it lower (mask > 31)"
