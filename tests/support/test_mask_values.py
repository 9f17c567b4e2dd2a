"""Masks of grey values: probabilities, labels, photographs."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from dloftbs.errors import InputError
from dloftbs.support.mask_values import as_probability, holds_labels, is_probability

SIZE = (360, 640)


def drawn() -> np.ndarray:
    mask = np.zeros(SIZE, np.uint8)
    cv2.polylines(mask, [np.array([(40, 60), (300, 150), (600, 120)])], False, 255, 12, cv2.LINE_AA)
    return mask


def soft() -> np.ndarray:
    return cv2.GaussianBlur(drawn(), None, 4.0)


class TestIsProbability:
    def test_what_a_network_gives_is_one(self) -> None:
        assert is_probability(soft())
        assert is_probability(soft()[:, ::-1].T)
        assert is_probability(cv2.resize(soft(), None, fx=0.3, fy=0.3, interpolation=cv2.INTER_AREA))

    def test_floating_point_is_one(self) -> None:
        assert is_probability(soft() / 255.0)
        assert is_probability((drawn() > 127).astype(np.float16))

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


class TestHoldsLabels:
    @pytest.mark.parametrize("kind", [np.uint8, np.int32, np.uint16, np.int64])
    def test_small_numbers_of_two_objects_are_labels(self, kind: type) -> None:
        labels = np.zeros(SIZE, kind)
        labels[100:120], labels[200:240] = 1, 3
        assert holds_labels(labels)
        labels[:8] = 255
        assert holds_labels(labels)

    @pytest.mark.parametrize("values", [(1,), (255,), (1, 255), (1, 200), (40, 41), (-1, 2)])
    def test_other_numbers_are_none(self, values: tuple[int, ...]) -> None:
        mask = np.zeros(SIZE, np.int32)
        for row, value in enumerate(values):
            mask[100 * row : 100 * row + 50] = value
        assert not holds_labels(mask)

    def test_neither_are_probabilities_and_nothing(self) -> None:
        assert not holds_labels(soft())
        assert not holds_labels(soft() / 255.0)
        assert not holds_labels(drawn() > 127)
        assert not holds_labels(np.zeros((0, 5), np.uint8))


def test_a_probability_of_any_type_has_8_bits() -> None:
    grey = soft()
    for given in (grey, grey / 255.0, (grey / 255.0).astype(np.float32), 257 * grey.astype(np.uint16)):
        np.testing.assert_array_equal(as_probability(given), grey)
    np.testing.assert_array_equal(as_probability(drawn() > 127), np.where(drawn() > 127, 255, 0))
    with pytest.raises(InputError, match="must be uint8, uint16 or floating point, got int64"):
        as_probability(grey.astype(np.int64))
