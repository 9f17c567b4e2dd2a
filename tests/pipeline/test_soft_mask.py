"""Masks that are probabilities, in the pipeline."""

from __future__ import annotations

import logging

import cv2
import numpy as np
import pytest

from dloftbs import Config, Frame, JointKind, Pipeline, detect, track
from dloftbs.errors import ConfigError
from dloftbs.pipeline.soft_mask import readings_of, sureness

SIZE = (360, 640)
LINE = np.array([(40, 60), (300, 150), (600, 120)])


def drawn(width: int = 12) -> np.ndarray:
    mask = np.zeros(SIZE, np.uint8)
    cv2.polylines(mask, [LINE], False, 255, width, cv2.LINE_AA)
    return mask


def soft(sigma: float = 4.0) -> np.ndarray:
    """Return what a network gives: blurred edges, and a faint ghost beside the cable."""
    mask = drawn()
    mask[250:330, 100:500] = np.maximum(mask[250:330, 100:500], np.linspace(0, 90, 400).astype(np.uint8))
    return cv2.GaussianBlur(mask, None, sigma)


def faint(value: int = 50) -> np.ndarray:
    """Return a cable that a network sees badly in its middle."""
    mask = drawn()
    mask[:, 220:420] = mask[:, 220:420] * (value / 255)
    return cv2.GaussianBlur(mask, None, 2.0)


def fading() -> np.ndarray:
    """Return a cable that a network sees badly at its end."""
    mask = drawn()
    mask[:, 380:] = mask[:, 380:] // 5
    return cv2.GaussianBlur(mask, None, 2.0)


class TestReadings:
    def test_each_limit_takes_in_more_of_the_parts_that_reach_one_half(self) -> None:
        read = dict(readings_of(soft()))
        assert list(read) == [128, 64, 32, 16]
        np.testing.assert_array_equal(read[128], soft() >= 128)
        ghost = np.zeros(SIZE, bool)
        ghost[240:340] = True
        for limit, mask in read.items():
            np.testing.assert_array_equal(mask, (soft() >= limit) & ~ghost)

    def test_a_part_that_nowhere_reaches_one_half_is_in_none(self) -> None:
        assert not any(mask.any() for _, mask in readings_of((0.45 * soft()).astype(np.uint8)))

    def test_nothing_is_not_sure(self) -> None:
        assert sureness([]) == 0.0


def test_a_mask_with_soft_edges_is_read_as_its_half() -> None:
    found, half = detect(soft()), detect(soft() > 127)
    assert [one.curve.control_points.tolist() for one in found] == [one.curve.control_points.tolist() for one in half]
    assert found[0].width_px == pytest.approx(half[0].width_px, abs=1.0)
    assert found[0].confidence > 0.9


def test_a_gap_that_is_faintly_seen_is_bridged() -> None:
    assert len(detect(faint() > 127)) == 2
    (found,), (unseen,) = detect(faint()), detect(faint(0))
    assert [joint.kind for joint in found.joints] == [JointKind.GAP]
    assert unseen.confidence < 0.8 < found.confidence


def test_a_cable_that_is_faint_at_its_end_is_read_to_it_and_is_as_wide_as_it_is() -> None:
    pipeline = Pipeline()
    (half,), (found,) = detect(fading() > 127), pipeline.process(fading())
    assert half.curve.length < 0.7 * found.curve.length
    assert not found.joints
    assert found.width_px == pytest.approx(12.0, abs=1.5)
    ends = sorted(found.curve(np.array([0.0, 1.0])).tolist())
    assert np.hypot(*(np.array(ends) - LINE[[0, 2]]).T) == pytest.approx(0.0, abs=14.0)
    np.testing.assert_array_equal(pipeline.mask, dict(readings_of(fading()))[32])


def test_a_cut_off_cable_that_shows_faintly_ahead_is_not_whole_for_sure() -> None:
    ends_here = drawn()
    ends_here[:, 400:] = 0
    goes_on = ends_here.copy()
    goes_on[:, 400:] = drawn()[:, 400:] // 20
    sure, unsure = detect(ends_here, mask_is="probability")[0], detect(goes_on, mask_is="probability")[0]
    assert not sure.near_joints
    assert sure.confidence > 0.9
    (near,) = unsure.near_joints
    assert unsure.confidence == pytest.approx(1.0 - near.confidence, abs=0.05)
    assert near.confidence > 0.5
    x, y = near.point
    assert 405 < x < 430
    assert abs(y - np.interp(x, *LINE.T)) < 6


def barely_sure(value: float, sure: float = 0.6) -> np.ndarray:
    """Return a cable that a network sees badly but for a few pixels."""
    mask = np.where(drawn() > 127, np.float32(value), np.float32(0.0))
    mask[:, 300:312] = np.where(mask[:, 300:312] > 0.0, np.float32(sure), np.float32(0.0))
    return mask


def test_a_cable_that_is_sure_in_a_few_pixels_is_read_as_a_whole() -> None:
    (found,) = detect(barely_sure(0.48))
    assert found.curve.length > 500.0


def test_a_mask_that_fades_does_not_fail() -> None:
    pipeline = Pipeline()
    for index in range(10):
        result = pipeline.process(Frame(mask=barely_sure(0.8 if index < 5 else 0.48, 0.9), index=index))
        assert len(result) == 1


def with_border(count: int) -> np.ndarray:
    labels = np.zeros(SIZE, np.uint8)
    for number, line in enumerate((LINE, LINE + np.array([0, 150]))[:count], start=1):
        cv2.polylines(labels, [line], False, 255, 15)
        cv2.polylines(labels, [line], False, number, 9)
    return labels


def test_the_border_of_a_label_image_is_no_cable() -> None:
    assert all(one.width_px < 12.0 for one in detect(with_border(2)))


@pytest.mark.parametrize("count", [1, 2])
def test_the_border_of_what_is_said_to_be_labels_is_no_cable(count: int) -> None:
    labels = with_border(count)
    for result in (
        detect(labels, mask_is="labels"),
        detect(Frame(mask=labels, mask_is="labels")),
        detect(instances=labels),
        *track([Frame(mask=labels)], mask_is="labels"),
    ):
        assert len(result) == count
        assert all(one.width_px < 12.0 for one in result)


def test_the_published_method_reads_the_half_as_it_would_by_itself() -> None:
    found, half = (detect(mask, config=Config.paper()) for mask in (fading(), fading() >= 128))
    assert [one.curve for one in found] == [one.curve for one in half]
    assert [one.width_px for one in found] == [one.width_px for one in half]


def test_the_published_method_reads_no_less_than_the_half_where_that_shows_nothing() -> None:
    assert len(detect(barely_sure(0.48), config=Config.paper())) == 0


class TestKinds:
    def test_floating_point_and_8_bits_say_the_same(self) -> None:
        curves = [detect(mask)[0].curve for mask in (soft(), soft() / 255.0, Frame(mask=(soft() / 255).astype("f4")))]
        assert curves[0] == curves[1] == curves[2]

    def test_binary_is_all_that_is_not_zero(self) -> None:
        wide = detect(soft(), mask_is="binary")
        assert [one.curve for one in wide] == [one.curve for one in detect(soft() > 0)]
        assert max(one.width_px for one in wide) > 1.5 * detect(soft())[0].width_px

    def test_an_array_of_floating_point_is_what_is_said(self) -> None:
        values = soft() / 255.0
        assert [one.curve for one in detect(values, mask_is="binary")] == [one.curve for one in detect(values != 0.0)]
        (result,) = track([values], mask_is="binary")
        assert [one.curve for one in result.detections] == [one.curve for one in detect(values != 0.0)]

    def test_a_frame_says_it_before_the_configuration(self) -> None:
        binary = detect(Frame(mask=soft(), mask_is="binary"), mask_is="probability")
        assert [one.curve for one in binary] == [one.curve for one in detect(soft() > 0)]

    def test_of_a_segmenter_too(self) -> None:
        image = np.zeros((*SIZE, 3), np.uint8)
        for given in (faint() / 255.0, faint()):
            (found,) = detect(image, segmenter=lambda _, given=given: given)
            assert found.curve == detect(faint())[0].curve
        assert len(list(track([image] * 3, segmenter=lambda _: faint(), mask_is="binary"))) == 3

    def test_another_word_is_refused(self) -> None:
        with pytest.raises(ConfigError, match=r"mask_is must be one of auto, .*, got 'soft'"):
            Pipeline(mask_is="soft")


class TestWarning:
    def test_a_stream_says_it_once(self, caplog: pytest.LogCaptureFixture) -> None:
        with caplog.at_level(logging.WARNING):
            results = list(track(Frame(mask=soft(), index=index) for index in range(4)))
        assert [len(result.tracks) for result in results] == [1] * 4
        assert sum("probability" in record.message for record in caplog.records) == 1

    def test_nothing_is_said_where_it_was_told(self, caplog: pytest.LogCaptureFixture) -> None:
        with caplog.at_level(logging.WARNING):
            detect(soft(), mask_is="probability")
            detect(soft() / 255.0)
            list(track([soft()] * 2, mask_is="probability"))
        assert not caplog.records


def test_a_region_ends_a_soft_mask_as_it_ends_a_hard_one() -> None:
    region = [(20, 20), (420, 20), (420, 340), (20, 340), (10, 180)]
    (found,) = detect(faint(), roi=region)
    assert found.curve(np.array([0.0, 1.0]))[:, 0].max() < 421
    assert found.confidence > 0.9 * found.existence


def test_a_probability_below_one_half_everywhere_is_a_reason() -> None:
    result = detect((0.45 * soft()).astype(np.uint8))
    assert len(result) == 0
    reason = "the mask is a probability that nowhere is one half or more: threshold it lower (mask > 31)"
    assert result.reason == reason
    two_values = np.where(drawn() > 127, 0.3, 0.0)
    assert (
        detect(two_values).reason
        == detect(Frame(mask=(255 * two_values).astype(np.uint8), mask_is="probability")).reason
        == reason
    )


def test_a_stream_of_probabilities_is_one_where_few_values_are_left() -> None:
    sharp = np.where(drawn() > 127, np.uint8(255), np.uint8(0))
    sharp[250:260, 100:500], sharp[300:310, 100:500] = 1, 2
    pipeline = Pipeline()
    for mask in (soft(), sharp, soft(), sharp):
        (found,) = pipeline.process(mask)
        assert abs(found.curve(0.5)[1] - 150.0) < 15.0
    assert len(pipeline.process(np.minimum(sharp, 1))) == 0
    pipeline.reset()
    assert len(pipeline.process(np.minimum(sharp, 1))) == 3
