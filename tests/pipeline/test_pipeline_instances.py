"""Masks of single objects, in the pipeline: they say what belongs together, and may be wrong."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from dloftbs import Frame, detect, track

SIZE = (360, 640)


def facing(gap: int) -> np.ndarray:
    """Return two pieces of a cable with round ends, of which each has a number."""
    labels = np.zeros(SIZE, np.uint8)
    middle = 320
    for number, (start, stop) in enumerate(((60, middle - gap // 2), (middle + gap // 2, 580)), 1):
        cv2.line(labels, (start, 180), (stop, 180), number, 13)
    return labels


def test_one_object_in_two_pieces_is_one_cable() -> None:
    labels = facing(210)
    one = (labels > 0).astype(np.uint16)
    assert len(detect(labels > 0)) == 2
    (found,) = detect(instances=one)
    assert found.curve.length > 500
    assert len(detect(instances=labels)) == 2


def test_two_objects_in_line_are_joined_less_surely() -> None:
    labels = facing(60)
    (alone,), (one,) = detect(labels > 0), detect(instances=labels > 0)
    two = detect(instances=labels)
    assert one.confidence > alone.confidence
    assert len(two) == 2 or two[0].confidence < alone.confidence


def crossing() -> tuple[np.ndarray, np.ndarray]:
    """Return the labels of two cables that cross, and those of a tool that cuts the one below."""
    right, cut = np.zeros(SIZE, np.uint8), np.zeros(SIZE, np.uint8)
    for labels, numbers in ((right, (1, 1)), (cut, (1, 3))):
        cv2.line(labels, (60, 40), (320, 180), numbers[0], 13)
        cv2.line(labels, (320, 180), (580, 320), numbers[1], 13)
        cv2.line(labels, (60, 320), (580, 40), 2, 13)
    return right, cut


def test_a_tool_that_cuts_a_cable_at_a_crossing_does_not_cut_its_curve() -> None:
    for labels in crossing():
        found = detect(instances=labels)
        assert len(found) == 2
        assert [one.curve.length for one in found] == pytest.approx([590.0] * 2, abs=8.0)


def touching(width: int, across: float, along: float, turn: float) -> np.ndarray:
    """Return two straight cables of which the second is moved by shares of its width and length, turned about."""
    labels = np.zeros(SIZE, np.uint8)
    ahead = np.array([np.cos(turn), np.sin(turn)])
    aside = np.array([-ahead[1], ahead[0]])
    for number in (1, 2):
        start = np.array([320.0, 180.0]) + (number - 1) * (across * width * aside + along * 150 * ahead) - 150 * ahead
        corners = [start + x * 150 * ahead + y * width * aside for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        cv2.fillPoly(labels, [np.rint(corners).astype(np.int32)], number)
    return labels


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.2])
@pytest.mark.parametrize("width", [5, 8, 14, 24])
@pytest.mark.parametrize("along", [0.1, 0.5])
def test_two_objects_side_by_side_are_two_cables(along: float, width: int, turn: float) -> None:
    labels = touching(width, 1.0, along, turn)
    found = detect(instances=labels)
    assert len(found) == 2
    for one in found:
        assert one.curve.length == pytest.approx(150.0, abs=width + 4.0)
        column, row = np.rint(one.curve.sample(50)[5:-5]).astype(int).T
        assert len(np.unique(labels[row, column])) == 1  # a curve lies in its own object


def test_two_objects_in_line_that_a_third_lies_across_are_joined() -> None:
    labels = touching(14, 0.0, 1.0, 0.0)
    cv2.line(labels, (318, 20), (322, 340), 3, 14)
    found = detect(instances=labels)
    assert sorted(one.curve.length for one in found) == pytest.approx([300.0, 320.0], abs=8.0)


class TestLabelsAsMask:
    def test_small_numbers_are_taken_for_labels(self) -> None:
        one = detect(facing(210))
        assert len(one) == 2
        for labels in (facing(60), facing(60).astype(np.int32), Frame(mask=facing(60), mask_is="labels")):
            found, told = detect(labels), detect(instances=facing(60))
            assert [x.curve for x in found] == [x.curve for x in told]
            assert [x.confidence for x in found] == [x.confidence for x in told]

    def test_unless_it_is_said_that_they_are_none(self) -> None:
        binary = detect(facing(60), mask_is="binary")
        assert [one.confidence for one in binary] == [one.confidence for one in detect(facing(60) > 0)]

    def test_in_the_configuration_too(self) -> None:
        far = 1000 * facing(60).astype(np.int32)
        told = detect(instances=facing(60))
        assert [one.confidence for one in detect(far, mask_is="labels")] == [one.confidence for one in told]


def test_tracks_follow_what_is_read_of_instances() -> None:
    frames = [Frame(instances=np.roll((facing(210) > 0).astype(np.uint16), 2 * k, axis=0), index=k) for k in range(4)]
    assert [len(result.tracks) for result in track(frames)] == [1] * 4


def bordered(*numbers: int) -> np.ndarray:
    """Return the label image of some level cables within borders of 255."""
    labels = np.zeros(SIZE, np.uint8)
    for number in numbers:
        cv2.line(labels, (60, 100 * number), (580, 100 * number), 255, 17)
        cv2.line(labels, (60, 100 * number), (580, 100 * number), number, 9)
    return labels


def test_in_a_stream_of_labels_the_border_of_one_object_is_ground() -> None:
    results = list(track([bordered(1, 2), bordered(1), bordered(1, 2), bordered(2)]))
    widths = [one.width_px for result in results for one in result]
    assert [len(result) for result in results] == [2, 1, 2, 1]
    assert widths == pytest.approx([11.0] * 6, abs=0.1)
