"""Faint cables of a soft mask where tracks are expected."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders import line

from dloftbs import Frame, Pipeline, TrackState
from dloftbs.data.prediction import Prediction
from dloftbs.linking import with_expected

SIZE = (120, 400)
WIDTH = 9.0


def drawn(*values: int) -> np.ndarray:
    """Return level cables at 40, 80, ... px with values of 256, blurred."""
    soft = np.zeros(SIZE, np.uint8)
    for k, value in enumerate(values):
        cv2.line(soft, (30, 40 * (k + 1)), (370, 40 * (k + 1)), value, 9)
    return cv2.GaussianBlur(soft, None, 1.5)


def expected(existence: float, y: float = 40.0) -> Prediction:
    return Prediction(line((30.0, y), (370.0, y)), 0.5, width_px=WIDTH, existence=existence)


def test_a_faint_cable_under_a_track_is_as_wide_as_a_sure_one() -> None:
    raised = with_expected(drawn(60), [expected(3.0)])
    np.testing.assert_array_equal(raised >= 128, drawn(255) >= 128)


@pytest.mark.parametrize(
    ("value", "existence", "is_raised"),
    [(60, 1.3, True), (60, 1.0, False), (25, 3.0, True), (25, 2.0, False), (10, 30.0, False), (60, -3.0, False)],
)
def test_the_log_odds_of_the_mask_and_of_the_track_are_added(value: int, existence: float, is_raised: bool) -> None:
    assert bool((with_expected(drawn(value), [expected(existence)]) >= 128).any()) is is_raised


def test_what_no_track_is_expected_at_stays() -> None:
    soft = drawn(60, 60)
    raised = with_expected(soft, [expected(3.0)])
    np.testing.assert_array_equal(raised[60:], soft[60:])
    for predicted in ([], [expected(3.0, y=60.0)], [expected(3.0)._replace(width_px=None)]):
        assert with_expected(soft, predicted) is soft
    assert with_expected(drawn(255), [expected(3.0)])[40, 200] == 255


def test_a_haze_is_no_cable() -> None:
    haze = np.full(SIZE, 60, np.uint8)
    assert with_expected(haze, [expected(30.0)]) is haze


@pytest.mark.large
@pytest.mark.parametrize("value", [110, 60, 25])
def test_a_cable_that_fades_in_a_stream_stays_one_track(value: int) -> None:
    pipeline, ids = Pipeline(mask_is="probability"), []
    for index in range(20):
        result = pipeline.process(Frame(mask=drawn(value if index >= 8 else 250, 250), index=index))
        ids.append([track.id for track in result.tracks if track.state is TrackState.CONFIRMED])
        if index >= 8:
            assert min(one.existence for one in result) < max(one.existence for one in result)
    assert ids[1:] == [[1, 2]] * 19


def test_a_cable_that_is_taken_away_is_gone() -> None:
    pipeline = Pipeline(mask_is="probability")
    for index in range(20):
        result = pipeline.process(Frame(mask=drawn(250, 250) if index < 8 else drawn(0, 250), index=index))
    assert [track.id for track in result.tracks] == [2]


def test_a_faint_cable_that_no_track_knows_is_none() -> None:
    pipeline = Pipeline(mask_is="probability")
    for index in range(8):
        assert len(pipeline.process(Frame(mask=drawn(60, 250), index=index))) == 1
