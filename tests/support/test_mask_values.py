"""Masks of grey values: probabilities, labels, photographs."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from dloftbs.errors import InputError
from dloftbs.support.mask_values import as_probability, kind_of, without_border

SIZE = (360, 640)


def drawn() -> np.ndarray:
    mask = np.zeros(SIZE, np.uint8)
    cv2.polylines(mask, [np.array([(40, 60), (300, 150), (600, 120)])], False, 255, 12, cv2.LINE_AA)
    return mask


def soft() -> np.ndarray:
    return cv2.GaussianBlur(drawn(), None, 4.0)


class TestIsProbability:
    def test_what_a_network_gives_is_one(self) -> None:
        assert kind_of(soft()) == "probability"
        assert kind_of(soft()[:, ::-1].T) == "probability"
        assert kind_of(cv2.resize(soft(), None, fx=0.3, fy=0.3, interpolation=cv2.INTER_AREA)) == "probability"

    def test_floating_point_is_one(self) -> None:
        assert kind_of(soft() / 255.0) == "probability"
        assert kind_of((drawn() > 127).astype(np.float16)) == "probability"

    @pytest.mark.parametrize("kind", [np.uint8, np.bool_, np.int32, np.uint16])
    def test_two_values_are_none_whatever_they_are(self, kind: type) -> None:
        for value in (1, 7, 255):
            assert kind_of((value * (drawn() > 127)).astype(kind)) != "probability"

    def test_edges_that_were_smoothed_scaled_or_stored_as_jpeg_make_one(self) -> None:
        hard = np.where(drawn() > 127, np.uint8(255), np.uint8(0))
        jpeg = cv2.imdecode(cv2.imencode(".jpg", hard, [cv2.IMWRITE_JPEG_QUALITY, 90])[1], cv2.IMREAD_GRAYSCALE)
        twice = cv2.resize(hard, None, fx=2.0, fy=2.0, interpolation=cv2.INTER_LINEAR)
        for mask in (jpeg, twice, cv2.GaussianBlur(hard, None, 0.6), soft().astype(np.uint16) * 257):
            assert kind_of(mask) == "probability"

    def test_a_few_greys_that_stand_for_objects_are_none(self) -> None:
        mask = np.zeros(SIZE, np.uint8)
        for number, grey in enumerate((38, 75, 113, 128, 192, 255)):
            mask[50 * number : 50 * number + 9] = grey
        assert kind_of(mask) == "binary"

    def test_labels_are_none_also_with_a_border_of_255(self) -> None:
        labels = np.zeros(SIZE, np.uint8)
        for number in range(30):
            labels[10 * number : 10 * number + 8] = number + 1
        labels[:4] = 255
        assert kind_of(labels) != "probability"

    def test_a_photograph_is_none(self, shared_data: Path) -> None:
        paths = sorted((shared_data / "networks" / "ewd").glob("*.jpg"))
        assert paths
        for path in paths:
            grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
            assert grey is not None
            assert kind_of(grey) != "probability"

    def test_the_masks_of_networks_are(self, shared_data: Path) -> None:
        networks = shared_data / "networks"
        paths = [path for kind in ("r101", "r50") for path in sorted(networks.glob(f"*/*.{kind}.png"))]
        assert len(paths) > 60
        for path in paths:
            grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
            assert grey is not None
            assert kind_of(grey) == "probability"


class TestHoldsLabels:
    @pytest.mark.parametrize("kind", [np.uint8, np.int32, np.uint16, np.int64])
    def test_small_numbers_of_two_objects_are_labels(self, kind: type) -> None:
        labels = np.zeros(SIZE, kind)
        labels[100:120], labels[200:240] = 1, 3
        assert kind_of(labels) == "labels"
        labels[:8] = 255
        assert kind_of(labels) == "labels"

    @pytest.mark.parametrize("row", range(8))
    def test_thin_level_objects_are_labels_wherever_they_lie(self, row: int) -> None:
        labels = np.zeros((480, 640), np.uint8)
        labels[200 + row : 206 + row, 40:600], labels[206 + row : 212 + row, 40:600] = 1, 2
        assert kind_of(labels) == "labels"

    @pytest.mark.parametrize("values", [(1,), (255,), (1, 255), (1, 200), (40, 41), (-1, 2)])
    def test_other_numbers_are_none(self, values: tuple[int, ...]) -> None:
        mask = np.zeros(SIZE, np.int32)
        for row, value in enumerate(values):
            mask[100 * row : 100 * row + 50] = value
        assert kind_of(mask) != "labels"

    def test_neither_are_probabilities_and_nothing(self) -> None:
        assert kind_of(soft()) != "labels"
        assert kind_of(soft() / 255.0) != "labels"
        assert kind_of(drawn() > 127) != "labels"
        assert kind_of(np.zeros((0, 5), np.uint8)) != "labels"


def of_values(*values: int, kind: type = np.uint8) -> np.ndarray:
    mask = np.zeros(SIZE, kind)
    for row, value in enumerate(values):
        mask[40 * row : 40 * row + 9] = value
    return mask


class TestInStream:
    @pytest.mark.parametrize("values", [(1,), (1, 2), (1, 255), (1, 2, 255), (3, 60, 255), tuple(range(20))])
    def test_after_a_probability_few_values_are_one(self, values: tuple[int, ...]) -> None:
        assert kind_of(of_values(*values), "probability") == "probability"

    def test_after_a_probability_a_photograph_is_none(self) -> None:
        grey = np.tile(np.linspace(0.0, 255.0, SIZE[1]).astype(np.uint8), (SIZE[0], 1))
        assert kind_of(grey, "probability") == "binary"
        assert kind_of(of_values(1, kind=np.int32), "probability") == kind_of(of_values(1) != 0) == "binary"

    def test_after_labels_one_object_and_its_border_are_labels(self) -> None:
        assert kind_of(of_values(1, 255)) == "binary"
        assert kind_of(of_values(1, 255), "labels") == "labels"

    def test_after_labels_values_that_are_none_speak_for_themselves(self) -> None:
        assert kind_of(soft(), "labels") == "probability"
        assert kind_of(of_values(40, 255), "labels") == kind_of(drawn() > 127, "labels") == "binary"


def test_a_probability_of_any_type_has_8_bits() -> None:
    grey = soft()
    for given in (grey, grey / 255.0, (grey / 255.0).astype(np.float32), 257 * grey.astype(np.uint16)):
        np.testing.assert_array_equal(as_probability(given), grey)
    np.testing.assert_array_equal(as_probability(drawn() > 127), np.where(drawn() > 127, 255, 0))
    with pytest.raises(InputError, match="must be uint8, uint16 or floating point, got int64"):
        as_probability(grey.astype(np.int64))


@pytest.mark.parametrize(
    ("labels", "expected"),
    [([0, 1, 255], [0, 1, 0]), ([32, 255], [32, 0]), ([0, 255], [0, 255]), ([33, 255], [33, 255]), ([0, 7], [0, 7])],
)
@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.int64])
def test_255_is_a_border_beside_small_numbers(labels: list[int], expected: list[int], kind: type) -> None:
    found = without_border(np.array([labels], kind))
    assert (found.tolist(), found.dtype) == ([expected], kind)
