"""Output of the pipeline: its checks and plain values."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace

import pytest
from builders import detection_of, through_json, wave

from dloftbs.detection import Crossing
from dloftbs.errors import InputError
from dloftbs.frame_result import FrameResult
from dloftbs.tracks import Track, TrackState


class TestFrameResult:
    def test_the_dictionary_is_strict_json(self):
        detection = detection_of(wave())
        track = Track(1, TrackState.TENTATIVE, detection.curve, None, 1, 0, detection)
        stage_ms = {"cleaning": 0.5, "fitting": 0.25}
        result = FrameResult((detection,), (track,), None, (480, 640), stage_ms, 7, 0.2, "a.png")
        data = through_json(result.to_dict())
        assert data["detections"] == [through_json(detection.to_dict())]
        assert data["tracks"] == [through_json(track.to_dict())]
        assert (data["index"], data["stamp"], data["name"], data["size"]) == (7, 0.2, "a.png", [480, 640])
        assert data["stage_ms"] == stage_ms
        assert result.total_ms == 0.75

    def test_as_a_sequence_it_is_its_detections(self):
        both = detection_of(wave()), detection_of(wave()).reversed()
        result = FrameResult(both, (), None, (4, 6))
        assert (len(result), list(result), result[0], result[-1], result[:1]) == (2, list(both), *both, both[:1])
        assert result
        assert not FrameResult((), (), "the mask is empty", (4, 6))
        with pytest.raises(IndexError):
            result[2]

    def test_crossings_are_among_what_was_found(self):
        crossing = Crossing((10.5, 20.0), ((0, 0.25), (0, 0.75)), 1, 0.5)
        result = FrameResult((detection_of(wave()),), (), None, (4, 6), crossings=(crossing,))
        assert through_json(result.to_dict())["crossings"] == [through_json(crossing.to_dict())]
        assert FrameResult((), (), None, (4, 6)).to_dict()["crossings"] == []

    def test_nothing_is_a_result_with_a_reason(self):
        result = FrameResult((), (), "the mask is empty", (4, 6))
        data = through_json(result.to_dict())
        assert (data["detections"], data["tracks"], data["reason"]) == ([], [], "the mask is empty")
        assert (data["stage_ms"], result.total_ms) == ({}, 0)

    def test_the_default_of_the_stage_times_is_shared_by_no_two_results(self):
        first, second = (FrameResult((), (), None, (4, 6)) for _ in range(2))
        assert first.stage_ms == second.stage_ms == {}
        assert first.stage_ms is not second.stage_ms

    def test_results_can_go_to_another_process(self):
        detection = detection_of(wave())
        result = FrameResult((detection,), (), None, (4, 6), {"cleaning": 0.5})
        again = pickle.loads(pickle.dumps(result))
        assert again.detections[0].curve == detection.curve
        assert again.to_dict() == result.to_dict()

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("detections", (1,)),
            ("tracks", None),
            ("reason", 5),
            *(("size", value) for value in ((4,), (4.0, 6), None, (-1, 6), (10**400, 6))),
            *(("stage_ms", value) for value in (None, {"a": "b"}, {1: 2.0}, {"a": math.nan})),
            *(("index", value) for value in (-1, 1.0)),
            *(("stamp", value) for value in (math.nan, "1", 10**400)),
            ("name", None),
            ("crossings", (None,)),
        ],
    )
    def test_wrong_fields_are_refused(self, name, value):
        with pytest.raises(InputError, match=f"{name} must"):
            replace(FrameResult((), (), None, (4, 6)), **{name: value})
